#include "tests/sim/sheet_crossings.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace drench::sim_tests {

namespace {

/// Six times the volume of a tetrahedron.
double volume(const V3d& a, const V3d& b, const V3d& c, const V3d& d) {
  return (b - a).cross(c - a).dot(d - a);
}

bool passes(const V3d& p, const V3d& q, const V3d (&t)[3]) {
  // What lies in one plane but for rounding has no side.
  const double edge = std::max((t[1] - t[0]).length(), (p - q).length()),
               rounding = 1e-13 * edge * edge * edge;
  const double from = volume(t[0], t[1], t[2], p), to = volume(t[0], t[1], t[2], q);
  if (std::min(from, to) > -rounding || std::max(from, to) < rounding) return false;
  const double ab = volume(p, q, t[0], t[1]), bc = volume(p, q, t[1], t[2]),
               ca = volume(p, q, t[2], t[0]);
  return std::min({ab, bc, ca}) > rounding || std::max({ab, bc, ca}) < -rounding;
}

struct Box {
  V3d low{1e300}, high{-1e300};
  void add(const V3d& p) {
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  }
  bool meets(const Box& other, double room) const {
    for (int k = 0; k < 3; ++k)
      if (low[k] > other.high[k] + room || other.low[k] > high[k] + room) return false;
    return true;
  }
};

std::vector<Box> boxes_of(const sim::ClothTopology& cloth, const sim::HostVec& x) {
  std::vector<Box> box(size_t(cloth.triangles()));
  for (size_t k = 0; k < cloth.corner.size(); ++k) box[k / 3].add(at(x, size_t(cloth.corner[k])));
  return box;
}

/// Calls f(t, u), t < u, for triangles whose boxes come within `room` of each other.
template <class F>
void for_each_near(const std::vector<Box>& box, double room, const F& f) {
  std::vector<size_t> order(box.size());
  std::iota(order.begin(), order.end(), size_t(0));
  std::sort(order.begin(), order.end(),
            [&](size_t a, size_t b) { return box[a].low.x < box[b].low.x; });
  for (size_t i = 0; i < order.size(); ++i) {
    const Box& a = box[order[i]];
    for (size_t j = i + 1; j < order.size() && box[order[j]].low.x <= a.high.x + room; ++j)
      if (a.meets(box[order[j]], room))
        f(std::min(order[i], order[j]), std::max(order[i], order[j]));
  }
}

double distance_to_segment(const V3d& p, const V3d& a, const V3d& b) {
  const V3d d = b - a;
  return (p - a - d * std::clamp((p - a).dot(d) / d.length2(), 0., 1.)).length();
}

double distance_to_triangle(const V3d& p, const V3d (&t)[3]) {
  const V3d n = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  bool inside = true;
  double edges = 1e300;
  for (int k = 0; k < 3; ++k) {
    const V3d &a = t[k], &b = t[(k + 1) % 3];
    inside &= n.dot((b - a).cross(p - a)) >= 0;
    edges = std::min(edges, distance_to_segment(p, a, b));
  }
  return inside ? std::abs(n.dot(p - t[0])) : edges;
}

}  // namespace

int count_sheet_crossings(const sim::ClothTopology& cloth, const sim::HostVec& position) {
  int count = 0;
  const auto passing = [&](size_t t, size_t u) {
    const int *a = &cloth.corner[3 * t], *b = &cloth.corner[3 * u];
    const V3d of[3] = {at(position, size_t(b[0])), at(position, size_t(b[1])),
                       at(position, size_t(b[2]))};
    const auto among = [&](int v) { return v == b[0] || v == b[1] || v == b[2]; };
    for (int c = 0; c < 3; ++c) {
      const int p = a[c], q = a[(c + 1) % 3];
      if (among(p) || among(q)) continue;
      count += passes(at(position, size_t(p)), at(position, size_t(q)), of);
    }
  };
  for_each_near(boxes_of(cloth, position), 0, [&](size_t t, size_t u) {
    passing(t, u);
    passing(u, t);
  });
  return count;
}

double least_distance_of_sheets(const sim::ClothTopology& cloth, const sim::HostVec& position,
                                double most) {
  double least = most;
  const auto measure = [&](size_t t, size_t u) {
    const int *a = &cloth.corner[3 * t], *b = &cloth.corner[3 * u];
    const V3d of[3] = {at(position, size_t(b[0])), at(position, size_t(b[1])),
                       at(position, size_t(b[2]))};
    for (int c = 0; c < 3; ++c)
      least = std::min(least, distance_to_triangle(at(position, size_t(a[c])), of));
  };
  for_each_near(boxes_of(cloth, position), most, [&](size_t t, size_t u) {
    if (cloth.sheet[t] == cloth.sheet[u]) return;
    measure(t, u);
    measure(u, t);
  });
  return least;
}

}  // namespace drench::sim_tests
