#include "tests/stress/exact_crossing.h"

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace drench::stress_tests {

namespace {

using Imath::V3d;

/// A sum of doubles without rounding: partial sums that do not overlap, rising (Shewchuk 1997).
class ExactSum {
 public:
  void add(double x) {
    size_t kept = 0;
    for (size_t k = 0; k < count_; ++k) {
      double y = part_[k];
      if (std::abs(x) < std::abs(y)) std::swap(x, y);
      const double high = x + y, low = y - (high - x);
      if (low != 0) part_[kept++] = low;
      x = high;
    }
    part_[kept++] = x, count_ = kept;
  }
  void add_product(double a, double b) {
    const double high = a * b;
    add(high), add(std::fma(a, b, -high));
  }
  void add_product(double a, double b, double c) {
    const double high = a * b;
    add_product(high, c), add_product(std::fma(a, b, -high), c);
  }
  int sign() const {
    const double top = count_ > 0 ? part_[count_ - 1] : 0;
    return (top > 0) - (top < 0);
  }

 private:
  std::array<double, 64> part_;
  size_t count_ = 0;
};

/// +-det(p, q, r).
void add_determinant(ExactSum& sum, double sign, const Point& p, const Point& q, const Point& r) {
  for (int k = 0; k < 3; ++k) {
    const size_t x = size_t(k), y = size_t(k + 1) % 3, z = size_t(k + 2) % 3;
    sum.add_product(sign * p[x], q[y], r[z]), sum.add_product(-sign * p[x], q[z], r[y]);
  }
}

/// Sign of the area of a triangle seen along an axis.
int orientation_along(size_t axis, const Point& a, const Point& b, const Point& c) {
  const size_t x = (axis + 1) % 3, y = (axis + 2) % 3;
  ExactSum sum;
  const auto add = [&](const Point& p, const Point& q) {
    sum.add_product(p[x], q[y]), sum.add_product(-p[y], q[x]);
  };
  add(b, c), add(c, a), add(a, b);
  return sum.sign();
}

/// Seen along an axis, of segments in one plane.
bool segments_meet(size_t axis, const Point& a, const Point& b, const Point& p, const Point& q) {
  const int ap = orientation_along(axis, a, b, p), aq = orientation_along(axis, a, b, q),
            pa = orientation_along(axis, p, q, a), pb = orientation_along(axis, p, q, b);
  if (ap * aq > 0 || pa * pb > 0) return false;
  if (ap != 0 || aq != 0 || pa != 0 || pb != 0) return true;
  for (const size_t k : {(axis + 1) % 3, (axis + 2) % 3})
    if (std::max(a[k], b[k]) < std::min(p[k], q[k]) || std::max(p[k], q[k]) < std::min(a[k], b[k]))
      return false;
  return true;
}

bool meet_in_plane(const Point& p, const Point& q, const std::array<Point, 3>& t) {
  for (size_t axis = 0; axis < 3; ++axis) {
    const int way = orientation_along(axis, t[0], t[1], t[2]);
    if (way == 0) continue;
    bool inside = true, meets = false;
    for (size_t k = 0; k < 3; ++k) {
      const Point &a = t[k], &b = t[(k + 1) % 3];
      inside &= way * orientation_along(axis, a, b, p) >= 0;
      meets |= segments_meet(axis, a, b, p, q);
    }
    return inside || meets;
  }
  return false;
}

V3d vec(const Point& p) { return V3d(p[0], p[1], p[2]); }
V3d place(const sim::HostVec& x, int v) { return vec(place_of(x, size_t(v))); }
V3d place(const std::vector<Point>& x, int v) { return vec(x[size_t(v)]); }

struct Box {
  V3d low{1e300}, high{-1e300};
  void add(const V3d& p) {
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  }
  void add(const Box& b) { add(b.low), add(b.high); }
  bool meets(const Box& other, double room) const {
    for (int k = 0; k < 3; ++k)
      if (low[k] > other.high[k] + room || other.low[k] > high[k] + room) return false;
    return true;
  }
};

/// Boxes of triangles as a tree.
class Boxes {
 public:
  template <class Places>
  Boxes(const sim::ClothTopology& cloth, const Places& x) : box_(size_t(cloth.triangles())) {
    for (size_t k = 0; k < cloth.corner.size(); ++k) box_[k / 3].add(place(x, cloth.corner[k]));
    order_.resize(box_.size());
    std::iota(order_.begin(), order_.end(), 0);
    if (!order_.empty()) build(0, order_.size());
  }
  /// Calls f(t, u), t < u, for boxes that come within `room`.
  template <class F>
  void for_each_pair(double room, const F& f) const {
    std::vector<size_t> stack;
    for (size_t t = 0; t < box_.size(); ++t) {
      stack.assign(1, 0);
      while (!stack.empty()) {
        const Node& n = node_[stack.back()];
        const size_t left = stack.back() + 1;
        stack.pop_back();
        if (!n.box.meets(box_[t], room)) continue;
        if (n.right != 0) {
          stack.push_back(n.right), stack.push_back(left);
          continue;
        }
        for (size_t k = n.first; k < n.last; ++k)
          if (order_[k] > int(t) && box_[size_t(order_[k])].meets(box_[t], room))
            f(int(t), order_[k]);
      }
    }
  }

 private:
  struct Node {
    Box box;
    size_t first, last, right = 0;  // the left child follows
  };
  void build(size_t first, size_t last) {
    const size_t at = node_.size();
    Box all;
    for (size_t k = first; k < last; ++k) all.add(box_[size_t(order_[k])]);
    node_.push_back({all, first, last});
    if (last - first <= 4) return;
    const V3d size = all.high - all.low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const size_t middle = (first + last) / 2;
    const auto begin = order_.begin();
    std::nth_element(begin + long(first), begin + long(middle), begin + long(last),
                     [&](int a, int b) {
                       const Box &p = box_[size_t(a)], &q = box_[size_t(b)];
                       return p.low[axis] + p.high[axis] < q.low[axis] + q.high[axis];
                     });
    build(first, middle);
    node_[at].right = node_.size();
    build(middle, last);
  }

  std::vector<Box> box_;
  std::vector<int> order_;
  std::vector<Node> node_;
};

double to_segment(const V3d& p, const V3d& a, const V3d& b) {
  const V3d d = b - a;
  return (p - a - d * std::clamp((p - a).dot(d) / d.length2(), 0., 1.)).length();
}

double to_triangle(const V3d& p, const V3d& a, const V3d& b, const V3d& c) {
  const V3d n = (b - a).cross(c - a);
  const bool inside = n.dot((b - a).cross(p - a)) >= 0 && n.dot((c - b).cross(p - b)) >= 0 &&
                      n.dot((a - c).cross(p - c)) >= 0;
  if (inside && n.length2() > 0) return std::abs(n.dot(p - a)) / n.length();
  return std::min({to_segment(p, a, b), to_segment(p, b, c), to_segment(p, c, a)});
}

/// Either lines that pass each other within both segments, or an end of one.
double between_segments(const V3d& a, const V3d& b, const V3d& p, const V3d& q) {
  const V3d d = b - a, e = q - p, n = d.cross(e), r = p - a;
  double least = std::min(
      {to_segment(a, p, q), to_segment(b, p, q), to_segment(p, a, b), to_segment(q, a, b)});
  const double n2 = n.length2();
  if (n2 == 0) return least;
  const double s = r.cross(e).dot(n) / n2, u = r.cross(d).dot(n) / n2;
  if (s >= 0 && s <= 1 && u >= 0 && u <= 1)
    least = std::min(least, std::abs(r.dot(n)) / std::sqrt(n2));
  return least;
}

/// Of a thickness: pieces of a sheet that are nearer at rest are neighbours, as those that share a
/// vertex are. Needles have such.
constexpr double joined = 0.01;

/// Two pieces of four vertices: the first one of the triangle that the others are, or two edges.
enum class Pieces { vertex_triangle, edges };

double distance(Pieces pieces, const std::array<int, 4>& v, const sim::HostVec& x) {
  const V3d a = place(x, v[0]), b = place(x, v[1]), c = place(x, v[2]), d = place(x, v[3]);
  return pieces == Pieces::edges ? between_segments(a, b, c, d) : to_triangle(a, b, c, d);
}

/// Of an edge and a triangle, m.
double distance_at_rest(const sim::ClothTopology& cloth, int p, int q, const int* b) {
  const auto from = [&](Pieces pieces, const std::array<int, 4>& v) {
    return distance(pieces, v, cloth.rest);
  };
  double least = std::min(from(Pieces::vertex_triangle, {p, b[0], b[1], b[2]}),
                          from(Pieces::vertex_triangle, {q, b[0], b[1], b[2]}));
  for (int e = 0; e < 3; ++e)
    least = std::min(least, from(Pieces::edges, {p, q, b[e], b[(e + 1) % 3]}));
  return least;
}

}  // namespace

int orientation(const Point& a, const Point& b, const Point& c, const Point& d) {
  const V3d o = vec(a), p = vec(b) - o, q = vec(c) - o, r = vec(d) - o;
  const auto size = [](const V3d& v) { return V3d(std::abs(v.x), std::abs(v.y), std::abs(v.z)); };
  const V3d m = size(p), n = size(q);
  const V3d most(m.y * n.z + m.z * n.y, m.z * n.x + m.x * n.z, m.x * n.y + m.y * n.x);
  const double volume = p.cross(q).dot(r), rounding = 2e-15 * most.dot(size(r));
  if (volume > rounding) return 1;
  if (volume < -rounding) return -1;
  ExactSum sum;
  add_determinant(sum, 1, b, c, d), add_determinant(sum, -1, a, c, d);
  add_determinant(sum, 1, a, b, d), add_determinant(sum, -1, a, b, c);
  return sum.sign();
}

bool meet(const Point& p, const Point& q, const std::array<Point, 3>& t) {
  for (size_t k = 0; k < 3; ++k) {
    if (std::max(p[k], q[k]) < std::min({t[0][k], t[1][k], t[2][k]})) return false;
    if (std::min(p[k], q[k]) > std::max({t[0][k], t[1][k], t[2][k]})) return false;
  }
  const int from = orientation(t[0], t[1], t[2], p), to = orientation(t[0], t[1], t[2], q);
  if (from * to > 0) return false;
  if (from == 0 && to == 0) return meet_in_plane(p, q, t);
  const int ab = orientation(p, q, t[0], t[1]), bc = orientation(p, q, t[1], t[2]),
            ca = orientation(p, q, t[2], t[0]);
  return std::min({ab, bc, ca}) >= 0 || std::max({ab, bc, ca}) <= 0;
}

Point place_of(const sim::HostVec& x, size_t v) { return {x.x[v], x.y[v], x.z[v]}; }

int count_meetings(const sim::ClothTopology& cloth, const std::vector<Point>& position) {
  const std::vector<int> sewn = sim::sewn_points(cloth);
  int count = 0;
  const auto meetings = [&](int t, int u) {
    const int *a = &cloth.corner[3 * size_t(t)], *b = &cloth.corner[3 * size_t(u)];
    const auto at = [&](int v) { return position[size_t(v)]; };
    const std::array<Point, 3> of{at(b[0]), at(b[1]), at(b[2])};
    const auto among = [&](int v) {
      const int p = sewn[size_t(v)];
      return p == sewn[size_t(b[0])] || p == sewn[size_t(b[1])] || p == sewn[size_t(b[2])];
    };
    for (int c = 0; c < 3; ++c) {
      const int p = a[c], q = a[(c + 1) % 3];
      if (among(p) || among(q) || !meet(at(p), at(q), of)) continue;
      const double keep = joined * 2 * double(cloth.half_thickness[size_t(t)]);
      count += cloth.sheet[size_t(t)] != cloth.sheet[size_t(u)] ||
               0.9 * distance_at_rest(cloth, p, q, b) >= keep;
    }
  };
  Boxes(cloth, position).for_each_pair(0, [&](int t, int u) { meetings(t, u), meetings(u, t); });
  return count;
}

double least_distance(const sim::ClothTopology& cloth, const sim::HostVec& position, double most) {
  const std::vector<int> sewn = sim::sewn_points(cloth);
  double least = most;
  const auto measure = [&](Pieces pieces, const std::array<int, 4>& v, int t, int u) {
    const size_t first = pieces == Pieces::edges ? 2 : 1;
    for (size_t a = 0; a < first; ++a)
      for (size_t b = first; b < 4; ++b)
        if (sewn[size_t(v[a])] == sewn[size_t(v[b])]) return;
    double keep = double(cloth.half_thickness[size_t(t)]) + cloth.half_thickness[size_t(u)];
    const double apart = distance(pieces, v, position);
    if (apart >= least * keep) return;
    if (cloth.sheet[size_t(t)] == cloth.sheet[size_t(u)]) {
      const double at_rest = 0.9 * distance(pieces, v, cloth.rest);
      if (at_rest < joined * keep) return;
      keep = std::min(keep, at_rest);
    }
    least = std::min(least, apart / keep);
  };
  const float thickest =
      2 * *std::max_element(cloth.half_thickness.begin(), cloth.half_thickness.end());
  Boxes(cloth, position).for_each_pair(most * double(thickest), [&](int t, int u) {
    const int *a = &cloth.corner[3 * size_t(t)], *b = &cloth.corner[3 * size_t(u)];
    for (int c = 0; c < 3; ++c) {
      measure(Pieces::vertex_triangle, {a[c], b[0], b[1], b[2]}, t, u);
      measure(Pieces::vertex_triangle, {b[c], a[0], a[1], a[2]}, u, t);
      for (int e = 0; e < 3; ++e)
        measure(Pieces::edges, {a[c], a[(c + 1) % 3], b[e], b[(e + 1) % 3]}, t, u);
    }
  });
  return least;
}

}  // namespace drench::stress_tests
