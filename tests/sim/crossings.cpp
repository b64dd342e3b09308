#include "tests/sim/crossings.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace drench::sim_tests {

namespace {

double det(const V3d& a, const V3d& b, const V3d& c) { return a.dot(b.cross(c)); }

/// Corners less the point, at both ends of the substep.
struct Tetrahedron {
  V3d start[3], end[3];
  V3d corner(int k, double t) const { return start[k] * (1 - t) + end[k] * t; }
};

bool inside_outline(const Tetrahedron& m, double t) {
  const V3d a = m.corner(0, t), b = m.corner(1, t), c = m.corner(2, t);
  const V3d n = (b - a).cross(c - a);
  const double size = n.length2();
  if (size == 0) return false;
  const double wa = n.dot(b.cross(c)) / size, wb = n.dot(c.cross(a)) / size,
               wc = n.dot(a.cross(b)) / size;
  return std::min({wa, wb, wc}) >= -1e-9;
}

bool crosses(const Tetrahedron& m, const double (&f)[4], double t0, double t1, int depth) {
  const auto [least, largest] = std::minmax({f[0], f[1], f[2], f[3]});
  if (least > 0 || largest < 0) return false;
  if (depth == 40) return (f[0] > 0) != (f[3] > 0) && inside_outline(m, 0.5 * (t0 + t1));
  const double a = 0.5 * (f[0] + f[1]), b = 0.5 * (f[1] + f[2]), c = 0.5 * (f[2] + f[3]);
  const double ab = 0.5 * (a + b), bc = 0.5 * (b + c), middle = 0.5 * (ab + bc),
               t = 0.5 * (t0 + t1);
  const double left[4] = {f[0], a, ab, middle}, right[4] = {middle, bc, c, f[3]};
  return crosses(m, left, t0, t, depth + 1) || crosses(m, right, t, t1, depth + 1);
}

bool crosses(const Tetrahedron& m) {
  const V3d(&s)[3] = m.start, (&e)[3] = m.end;
  const double f[4] = {det(s[0], s[1], s[2]),
                       (det(e[0], s[1], s[2]) + det(s[0], e[1], s[2]) + det(s[0], s[1], e[2])) / 3,
                       (det(s[0], e[1], e[2]) + det(e[0], s[1], e[2]) + det(e[0], e[1], s[2])) / 3,
                       det(e[0], e[1], e[2])};
  return crosses(m, f, 0, 1, 0);
}

struct Box {
  V3d low{1e30}, high{-1e30};
  void add(const V3d& p) {
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  }
  bool meets(const Box& o) const {
    return low.x <= o.high.x && o.low.x <= high.x && low.y <= o.high.y && o.low.y <= high.y &&
           low.z <= o.high.z && o.low.z <= high.z;
  }
};

/// Periods to either side and none, m.
std::vector<V3d> images_of(const V3d& period) {
  std::vector<V3d> images{V3d(0)};
  for (int k = 0; k < 3; ++k) {
    if (!(period[k] > 0)) continue;
    for (size_t n = images.size(), i = 0; i < n; ++i) {
      V3d low = images[i], high = images[i];
      low[k] -= period[k], high[k] += period[k];
      images.push_back(low), images.push_back(high);
    }
  }
  return images;
}

double solid_angle(const V3d& a, const V3d& b, const V3d& c) {
  const double la = a.length(), lb = b.length(), lc = c.length();
  return 2 * std::atan2(det(a, b, c), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

}  // namespace

int count_crossings(const sim::ClothTopology& cloth, const sim::HostState& before,
                    const sim::HostState& after, const V3d& period) {
  const std::vector<V3d> images = images_of(period);
  const int triangles = cloth.triangles();
  const auto corner = [&](const sim::HostVec& vertices, int image, int k) {
    const V3d p = at(vertices, cloth.corner[size_t(k)]) + images[size_t(image)];
    return cloth.corner_shift.size() > 0 ? p + at(cloth.corner_shift, size_t(k)) : p;
  };
  std::vector<Box> box(size_t(triangles) * images.size());
  for (size_t t = 0; t < box.size(); ++t) {
    const int image = int(t) / triangles, first = 3 * (int(t) % triangles);
    for (int k = 0; k < 3; ++k) {
      box[t].add(corner(before.cloth_position, image, first + k));
      box[t].add(corner(after.cloth_position, image, first + k));
    }
  }
  // In the order of their lower x, so that a path looks at those alone that may begin before it
  // ends.
  std::vector<int> order(box.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return box[a].low.x < box[b].low.x; });
  double widest = 0;
  Box all;
  for (const Box& b : box)
    widest = std::max(widest, b.high.x - b.low.x), all.add(b.low), all.add(b.high);
  const std::vector<int> place = place_of_id(before);
  int count = 0;
  for (size_t i = 0; i < after.id.size(); ++i) {
    const V3d from = at(before.position, place[after.id[i]]);
    V3d to = at(after.position, i);
    for (int k = 0; k < 3; ++k)
      if (period[k] > 0) to[k] -= period[k] * std::round((to[k] - from[k]) / period[k]);
    Box path;
    path.add(from), path.add(to);
    if (!path.meets(all)) continue;
    const auto first = std::lower_bound(order.begin(), order.end(), path.low.x - widest,
                                        [&](int t, double x) { return box[t].low.x < x; });
    for (auto k = first; k != order.end() && box[*k].low.x <= path.high.x; ++k) {
      const int t = *k;
      if (!path.meets(box[t])) continue;
      Tetrahedron m;
      for (int k = 0; k < 3; ++k) {
        const int image = t / triangles, place = 3 * (t % triangles) + k;
        m.start[k] = corner(before.cloth_position, image, place) - from;
        m.end[k] = corner(after.cloth_position, image, place) - to;
      }
      count += crosses(m);
    }
  }
  return count;
}

int count_below(const sim::ClothTopology& cloth, const sim::HostState& state,
                const sim::HostVec& flat, double height) {
  int below = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d p = at(state.position, i);
    double difference = 0;
    for (int t = 0; t < cloth.triangles(); ++t) {
      V3d now[3], rest[3];
      for (int k = 0; k < 3; ++k) {
        now[k] = at(state.cloth_position, cloth.corner[3 * t + k]) - p;
        rest[k] = at(flat, cloth.corner[3 * t + k]) - p;
      }
      difference += solid_angle(now[0], now[1], now[2]) - solid_angle(rest[0], rest[1], rest[2]);
    }
    const bool between = std::abs(difference) > 2 * M_PI;
    below += between == (p.y > height);
  }
  return below;
}

}  // namespace drench::sim_tests
