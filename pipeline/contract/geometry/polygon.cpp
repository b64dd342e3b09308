#include "pipeline/contract/geometry/polygon.h"

#include <algorithm>
#include <cmath>

namespace drench {

namespace {

using Imath::V2d;
using Imath::V3d;
using Triangles = std::vector<std::array<uint32_t, 3>>;

/// Twice the area of a, b, c; positive if they turn left.
double turn(const V2d& a, const V2d& b, const V2d& c) { return (b - a).cross(c - a); }

V3d newell_normal(std::span<const Imath::V3f> corner) {
  const V3d origin(corner[0]);
  V3d normal(0);
  for (size_t k = 0; k < corner.size(); ++k) {
    const V3d a = V3d(corner[k]) - origin, b = V3d(corner[(k + 1) % corner.size()]) - origin;
    normal += a.cross(b);
  }
  return normal;
}

/// Along the normal's largest part, so that the polygon turns left.
std::vector<V2d> projected(std::span<const Imath::V3f> corner, const V3d& normal) {
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::vector<V2d> flat;
  flat.reserve(corner.size());
  for (const Imath::V3f& p : corner)
    flat.push_back(normal[axis] > 0 ? V2d(p[u], p[v]) : V2d(p[v], p[u]));
  return flat;
}

Triangles fan(size_t n) {
  Triangles triangles;
  for (uint32_t k = 2; k < n; ++k) triangles.push_back({0, k - 1, k});
  return triangles;
}

/// Less than this fraction of the square of its longest edge, twice the area of a triangle is that
/// of a sliver: its corners are on a line but for rounding.
constexpr double sliver = 1e-5;

bool is_sliver(const V2d& a, const V2d& b, const V2d& c) {
  const double longest = std::max({(b - a).length2(), (c - b).length2(), (a - c).length2()});
  return !(turn(a, b, c) > sliver * longest);
}

/// Turns left or goes on at every corner, and once around in all: no star either. Corners at the
/// position of the one before do not count.
bool is_convex(const std::vector<V2d>& p) {
  const size_t n = p.size();
  size_t last = n - 1;
  while (last > 0 && p[last] == p[0]) --last;
  V2d before = p[0] - p[last];
  int changes = 0;  // of the sign of an edge's x
  double sign = 0;
  for (size_t k = 0; k < n; ++k) {
    const V2d edge = p[(k + 1) % n] - p[k];
    if (edge == V2d(0)) continue;
    if (before.cross(edge) < 0) return false;
    before = edge;
    if (edge.x == 0) continue;
    if (sign != 0 && (edge.x > 0) != (sign > 0)) ++changes;
    sign = edge.x;
  }
  return changes <= 2;
}

bool has_sliver(const std::vector<V2d>& p, const Triangles& triangles) {
  return std::any_of(triangles.begin(), triangles.end(),
                     [&](const auto& t) { return is_sliver(p[t[0]], p[t[1]], p[t[2]]); });
}

bool cross_each_other(const V2d& a, const V2d& b, const V2d& c, const V2d& d) {
  if (std::max(a.x, b.x) < std::min(c.x, d.x) || std::max(c.x, d.x) < std::min(a.x, b.x) ||
      std::max(a.y, b.y) < std::min(c.y, d.y) || std::max(c.y, d.y) < std::min(a.y, b.y))
    return false;
  const double c_side = turn(a, b, c), d_side = turn(a, b, d), a_side = turn(c, d, a),
               b_side = turn(c, d, b);
  return ((c_side > 0 && d_side < 0) || (c_side < 0 && d_side > 0)) &&
         ((a_side > 0 && b_side < 0) || (a_side < 0 && b_side > 0));
}

bool crosses_itself(const std::vector<V2d>& p) {
  const size_t n = p.size();
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = i + 2; j < n; ++j) {
      if (i == 0 && j + 1 == n) continue;
      if (cross_each_other(p[i], p[i + 1], p[j], p[(j + 1) % n])) return true;
    }
  }
  return false;
}

/// What is left of a polygon while its ears are cut off.
class EarCutter {
 public:
  explicit EarCutter(const std::vector<V2d>& p) : p_(p), next_(p.size()), previous_(p.size()) {
    for (uint32_t k = 0; k < p.size(); ++k) {
      next_[k] = uint32_t((k + 1) % p.size());
      previous_[k] = uint32_t((k + p.size() - 1) % p.size());
    }
  }

  std::optional<Triangles> cut() {
    size_t left = p_.size();
    uint32_t at = 0;
    for (uint32_t k = 0; k < p_.size() && left > 3; ++k) {
      if (p_[k] != p_[next_[k]]) continue;
      at = clip(k), --left;  // two corners at one point
    }
    for (; left > 3; --left) {
      const std::optional<uint32_t> ear = find_ear(at, left);
      if (!ear) return {};
      at = next_[clip(*ear)];  // not the same corner again: slivers would have it in common
    }
    triangles_.push_back({previous_[at], at, next_[at]});
    return std::move(triangles_);
  }

 private:
  double turn_at(uint32_t k) const { return turn(p_[previous_[k]], p_[k], p_[next_[k]]); }

  /// Cuts corner k off. @return the one behind it.
  uint32_t clip(uint32_t k) {
    triangles_.push_back({previous_[k], k, next_[k]});
    next_[previous_[k]] = next_[k];
    return previous_[next_[k]] = previous_[k], next_[k];
  }

  /// An ear that is no sliver and leaves none if there is one; else any with an area; else a corner
  /// on a straight line, which covers nothing.
  std::optional<uint32_t> find_ear(uint32_t start, size_t left) const {
    std::optional<uint32_t> thin, straight;
    uint32_t k = start;
    for (size_t tried = 0; tried < left; ++tried, k = next_[k]) {
      const double area = turn_at(k);
      if (area == 0 && !straight) straight = k;
      if (!(area > 0)) continue;
      if (!is_sliver(p_[previous_[k]], p_[k], p_[next_[k]]) && is_empty(k, sliver)) return k;
      if (!thin && is_empty(k, 0)) thin = k;
    }
    return thin ? thin : straight;
  }

  /// Whether no corner lies in the triangle at k, or beyond its cut by a fraction `beyond` of the
  /// cut's length. Corners at the position of one of its own do not count: a slit comes back there.
  bool is_empty(uint32_t k, double beyond) const {
    const V2d &a = p_[previous_[k]], &b = p_[k], &c = p_[next_[k]];
    const double outside = -beyond * (c - a).length2();
    for (uint32_t j = next_[next_[k]]; j != previous_[k]; j = next_[j]) {
      const V2d& q = p_[j];
      if (q == a || q == b || q == c) continue;
      if (turn(a, b, q) >= 0 && turn(b, c, q) >= 0 && turn(c, a, q) >= outside) return false;
    }
    return true;
  }

  const std::vector<V2d>& p_;
  std::vector<uint32_t> next_, previous_;
  Triangles triangles_;
};

}  // namespace

std::optional<Triangles> triangulate(std::span<const Imath::V3f> corner) {
  const size_t n = corner.size();
  if (n <= 3) return fan(n);
  const V3d normal = newell_normal(corner);
  std::vector<V2d> flat = projected(corner, normal);
  if (normal == V3d(0)) {
    // Nothing but a line, or loops of opposite turn that cancel: seen along each axis in turn.
    for (const V3d& axis : {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)})
      if (n <= most_corners && crosses_itself(projected(corner, axis))) return {};
    return fan(n);
  }
  if (!is_convex(flat)) {
    if (n > most_corners || crosses_itself(flat)) return {};
    return EarCutter(flat).cut();
  }
  Triangles triangles = fan(n);
  if (n > most_corners || !has_sliver(flat, triangles)) return triangles;
  return EarCutter(flat).cut().value_or(std::move(triangles));
}

}  // namespace drench
