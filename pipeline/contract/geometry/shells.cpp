#include "pipeline/contract/geometry/shells.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <tuple>

#include "pipeline/contract/geometry/bounds.h"

namespace drench {

namespace {

using Imath::V3d, Imath::V3f;
using Triangle = Imath::Vec3<uint32_t>;

/// Sets that grow together; the smallest member names a set.
class Unions {
 public:
  explicit Unions(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  uint32_t find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void unite(uint32_t a, uint32_t b) {
    a = find(a), b = find(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b);
  }
  /// Numbers from 0 in the order of the first members.
  std::vector<int> numbers(int& count) {
    std::vector<int> number(parent_.size());
    count = 0;
    for (uint32_t i = 0; i < parent_.size(); ++i)
      number[i] = find(i) == i ? count++ : number[find(i)];
    return number;
  }

 private:
  std::vector<uint32_t> parent_;
};

/// One number for all vertices at one point.
std::vector<uint32_t> points_of(const TriangleMesh& mesh) {
  const auto& at = mesh.position;
  const auto before = [&](uint32_t a, uint32_t b) {
    return std::tie(at[a].x, at[a].y, at[a].z) < std::tie(at[b].x, at[b].y, at[b].z);
  };
  std::vector<uint32_t> order(at.size()), point(at.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), before);
  uint32_t number = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    if (i > 0 && before(order[i - 1], order[i])) ++number;
    point[order[i]] = number;
  }
  return point;
}

struct Edge {
  uint32_t low, high, triangle;
  int direction;  // 1: from low to high, -1
  bool same(const Edge& o) const { return low == o.low && high == o.high; }
};

/// @param point  of a vertex.
std::vector<Edge> edges_of(const TriangleMesh& mesh, const std::vector<uint32_t>& point) {
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangle.size());
  for (uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    for (int c = 0; c < 3; ++c) {
      const uint32_t a = point[mesh.triangle[t][c]], b = point[mesh.triangle[t][(c + 1) % 3]];
      if (a != b) edges.push_back({std::min(a, b), std::max(a, b), t, a < b ? 1 : -1});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& p, const Edge& q) {
    return std::tie(p.low, p.high, p.triangle) < std::tie(q.low, q.high, q.triangle);
  });
  return edges;
}

/// Calls visit(begin, end) for the triangles of each edge.
template <class Visit>
void for_each_edge(const std::vector<Edge>& edges, const Visit& visit) {
  for (size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].same(edges[begin])) ++end;
    visit(begin, end);
  }
}

/// Unites what would not be closed by itself at an edge of more than two triangles. @return whether
/// anything was.
bool close_sets(const std::vector<Edge>& edges, Unions& sets) {
  bool any = false;
  for_each_edge(edges, [&](size_t begin, size_t end) {
    if (end - begin == 2) return;
    std::vector<std::pair<uint32_t, int>> open;  // sets and their sums of ways
    for (size_t e = begin; e < end; ++e) {
      const uint32_t set = sets.find(edges[e].triangle);
      const auto known = std::find_if(open.begin(), open.end(),
                                      [set](const auto& one) { return one.first == set; });
      if (known == open.end()) {
        open.emplace_back(set, edges[e].direction);
      } else {
        known->second += edges[e].direction;
      }
    }
    std::erase_if(open, [](const auto& one) { return one.second == 0; });
    for (size_t k = 1; k < open.size(); ++k, any = true) sets.unite(open[0].first, open[k].first);
  });
  return any;
}

/// Across edges of two triangles, by their vertices and then by points, which seams of textures
/// have several vertices at. Across edges of more only as close_sets does, so that shells which
/// touch along an edge or a face stay apart.
std::vector<int> shells_of(const TriangleMesh& mesh, int& count) {
  Unions sets(mesh.triangle.size());
  const auto unite_pairs = [&](const std::vector<Edge>& edges) {
    for_each_edge(edges, [&](size_t begin, size_t end) {
      if (end - begin == 2) sets.unite(edges[begin].triangle, edges[begin + 1].triangle);
    });
  };
  std::vector<uint32_t> own(mesh.position.size());
  std::iota(own.begin(), own.end(), 0u);
  unite_pairs(edges_of(mesh, own));
  const std::vector<Edge> edges = edges_of(mesh, points_of(mesh));
  unite_pairs(edges);
  while (close_sets(edges, sets)) {
  }
  return sets.numbers(count);
}

/// What two bounds have in common; empty if they do not overlap by more than a rounding.
Bounds common(const Bounds& a, const Bounds& b) {
  Bounds both;
  for (int k = 0; k < 3; ++k) {
    both.low[k] = std::max(a.low[k], b.low[k]), both.high[k] = std::min(a.high[k], b.high[k]);
    const double size = std::min(a.high[k] - a.low[k], b.high[k] - b.low[k]);
    if (!(both.high[k] - both.low[k] > 1e-5 * size)) return {};
  }
  return both;
}

constexpr int rays_a_side = 32;
constexpr double all_but = 1e-3;  // of a volume, that may stick out of what holds it

/// Of a shell's volume, what lies in another: by rays along each of the axes.
struct Fraction {
  double least = 1, most = 0;
  bool is_all() const { return std::min(least, most) > 1 - all_but; }
  void add(double fraction) { least = std::min(least, fraction), most = std::max(most, fraction); }
};

/// Relations of the shells of a mesh, by lengths along rays.
class Nesting {
 public:
  Nesting(const TriangleMesh& mesh, Shells& shells);
  void find_bodies();
  void find_depths();
  /// A shell of itself.
  bool winds_twice(int shell) const;
  /// Face to face, on either side.
  bool touch(int one, int other) const;

 private:
  void measure_own_rays(int shell, int axis);
  Fraction fraction(int of, int in) const;
  bool overlap(int one, int other) const;
  ShellRays rays_through(const Bounds& box, const std::vector<int>& of, int axis) const;

  const TriangleMesh& mesh_;
  Shells& shells_;
  std::vector<std::vector<uint32_t>> triangles_;  // of a shell
  std::vector<Bounds> bounds_;
  std::vector<std::vector<std::pair<int, Fraction>>> fractions_;  // of a shell, in those around it
  std::vector<std::pair<int, int>> within_;                       // the first lies in the second
};

Nesting::Nesting(const TriangleMesh& mesh, Shells& shells)
    : mesh_(mesh),
      shells_(shells),
      triangles_(size_t(shells.count())),
      bounds_(size_t(shells.count())),
      fractions_(size_t(shells.count())) {
  for (uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    const auto s = size_t(shells.shell[t]);
    triangles_[s].push_back(t);
    for (int c = 0; c < 3; ++c) bounds_[s].add(V3d(mesh.position[mesh.triangle[t][c]]));
  }
}

ShellRays Nesting::rays_through(const Bounds& box, const std::vector<int>& of, int axis) const {
  ShellRays::Grid grid;
  grid.axis = axis;
  for (int k = 0; k < 2; ++k) {
    // Off the middles of cells, which symmetric meshes have corners on.
    const int across = (axis + k + 1) % 3;
    const double size = box.high[across] - box.low[across];
    grid.step[k] = size / rays_a_side, grid.count[k] = rays_a_side;
    grid.low[k] = box.low[across] + (k == 0 ? 0.4729 : 0.5381) * grid.step[k];
  }
  std::vector<uint32_t> triangles;
  for (const int s : of)
    triangles.insert(triangles.end(), triangles_[size_t(s)].begin(), triangles_[size_t(s)].end());
  return {mesh_, shells_.shell, triangles, grid};
}

/// Calls visit(length, count) for each piece of each ray.
template <class Visit>
void along(const ShellRays& rays, const Shells& shells, const Visit& visit) {
  BodyCount count(shells);  // all windings are 0 again behind the last crossing
  for (int k = 0; k < rays_a_side; ++k) {
    for (int j = 0; j < rays_a_side; ++j) {
      const auto* last = rays.end(j, k);
      for (const auto* c = rays.begin(j, k); c != last; ++c) {
        count.pass(*c);
        if (c + 1 != last) visit(c[1].x - c[0].x, count);
      }
    }
  }
}

void Nesting::measure_own_rays(int shell, int axis) {
  std::vector<int> of{shell};
  const Bounds& own = bounds_[size_t(shell)];
  for (int other = 0; other < shells_.count(); ++other) {
    if (other == shell) continue;
    const Bounds both = common(own, bounds_[size_t(other)]);
    if (both.low.x < both.high.x) of.push_back(other);
  }
  if (of.size() == 1) return;
  double whole = 0;
  std::vector<double> in(of.size(), 0);
  along(rays_through(own, of, axis), shells_, [&](double length, const BodyCount& count) {
    if (!count.in_shell(shell)) return;
    whole += length;
    for (size_t k = 1; k < of.size(); ++k) in[k] += count.in_shell(of[k]) ? length : 0;
  });
  auto& fractions = fractions_[size_t(shell)];
  for (size_t k = 1; k < of.size(); ++k) {
    if (axis == 0) fractions.emplace_back(of[k], Fraction{});
    if (whole > 0) fractions[k - 1].second.add(in[k] / whole);
  }
}

Fraction Nesting::fraction(int of, int in) const {
  for (const auto& [other, fraction] : fractions_[size_t(of)])
    if (other == in) return fraction;
  return {0, 0};
}

/// Rays through the part that the bounds of two shells have in common see overlaps that are small
/// beside either.
bool Nesting::overlap(int one, int other) const {
  const Bounds &a = bounds_[size_t(one)], &b = bounds_[size_t(other)];
  bool found = false;
  for (int axis = 0; axis < 3 && !found; ++axis) {
    const double least = 1e-4 * std::min(a.high[axis] - a.low[axis], b.high[axis] - b.low[axis]);
    along(rays_through(common(a, b), {one, other}, axis), shells_,
          [&](double length, const BodyCount& count) {
            found |= length > least && count.in_shell(one) && count.in_shell(other);
          });
  }
  return found;
}

bool Nesting::winds_twice(int shell) const {
  const Bounds& own = bounds_[size_t(shell)];
  const double least = 1e-4 * (own.high.x - own.low.x);
  bool found = false;
  along(rays_through(own, {shell}, 0), shells_, [&](double length, const BodyCount& count) {
    found |= length > least && std::abs(count.winding(shell)) > 1;
  });
  return found;
}

bool Nesting::touch(int one, int other) const {
  const Bounds &a = bounds_[size_t(one)], &b = bounds_[size_t(other)];
  for (int axis = 0; axis < 3; ++axis) {
    Bounds both;
    bool meet = true;
    double slack = 0;  // m, along the axis
    for (int k = 0; k < 3; ++k) {
      both.low[k] = std::max(a.low[k], b.low[k]), both.high[k] = std::min(a.high[k], b.high[k]);
      const double size = std::min(a.high[k] - a.low[k], b.high[k] - b.low[k]);
      if (k == axis) slack = 1e-6 * size;
      meet &= both.high[k] - both.low[k] >= (k == axis ? -1e-6 : 1e-5) * size;
    }
    if (!meet) continue;
    const ShellRays rays = rays_through(both, {one, other}, axis);
    for (int ray = 0; ray < rays_a_side * rays_a_side; ++ray) {
      const auto* const first = rays.begin(ray % rays_a_side, ray / rays_a_side);
      const auto* const last = rays.end(ray % rays_a_side, ray / rays_a_side);
      const auto* const at = std::adjacent_find(first, last, [&](const auto& p, const auto& q) {
        return p.shell != q.shell && q.x - p.x <= slack;
      });
      if (at != last) return true;
    }
  }
  return false;
}

void Nesting::find_bodies() {
  Unions bodies{size_t(shells_.count())};
  for (int s = 0; s < shells_.count(); ++s)
    for (int axis = 0; axis < 3; ++axis) measure_own_rays(s, axis);
  for (int a = 0; a < shells_.count(); ++a) {
    for (const auto& [b, fraction_of_a] : fractions_[size_t(a)]) {
      if (b < a) continue;
      const Fraction fraction_of_b = fraction(b, a);
      const bool a_in_b = fraction_of_a.is_all(), b_in_a = fraction_of_b.is_all();
      if (a_in_b != b_in_a) {
        within_.emplace_back(a_in_b ? a : b, a_in_b ? b : a);
      } else if (a_in_b || std::max(fraction_of_a.most, fraction_of_b.most) > all_but ||
                 overlap(a, b)) {
        bodies.unite(uint32_t(a), uint32_t(b));
      }
    }
  }
  int count = 0;
  shells_.body = bodies.numbers(count);
  shells_.depth.assign(size_t(count), 0);
}

void Nesting::find_depths() {
  std::set<std::pair<int, int>> pairs;
  for (const auto& [inner, outer] : within_) {
    const int a = shells_.body[size_t(inner)], b = shells_.body[size_t(outer)];
    if (a != b && pairs.emplace(a, b).second) ++shells_.depth[size_t(a)];
  }
}

/// By the divergence theorem about the shell's first corner, so that one far off has a sign, too.
std::vector<double> volumes_of(const TriangleMesh& mesh, const Shells& shells) {
  std::vector<double> volume(size_t(shells.count()), 0);
  std::vector<const V3f*> origin(size_t(shells.count()), nullptr);
  for (size_t t = 0; t < mesh.triangle.size(); ++t) {
    const Triangle& c = mesh.triangle[t];
    const auto s = size_t(shells.shell[t]);
    if (!origin[s]) origin[s] = &mesh.position[c.x];
    const V3d o(*origin[s]);
    volume[s] += (V3d(mesh.position[c.x]) - o)
                     .dot((V3d(mesh.position[c.y]) - o).cross(V3d(mesh.position[c.z]) - o));
  }
  return volume;
}

// ---- rays ----

__extension__ typedef __int128 Wide;
using Fixed = int64_t;
constexpr double fixed_scale = 1 << 20;  // of a step of the grid

struct Flat {
  Fixed y, z;
};

/// Which side of the edge from a to b a ray lies on. On the edge it counts as moved by a first
/// infinitesimal along y, and by a second one along z.
int side_of(const Flat& a, const Flat& b, const Flat& ray, Wide& value) {
  const Wide y = b.y - a.y, z = b.z - a.z;
  value = y * Wide(ray.z - a.z) - z * Wide(ray.y - a.y);
  if (value != 0) return value > 0 ? 1 : -1;
  if (z != 0) return z < 0 ? 1 : -1;
  return y > 0 ? 1 : y < 0 ? -1 : 0;
}

struct FlatTriangle {
  Flat corner[3];
  double x[3];
  int first[2], last[2];  // rays that may meet it

  FlatTriangle(const TriangleMesh& mesh, const Triangle& t, const ShellRays::Grid& grid) {
    for (int c = 0; c < 3; ++c) {
      const V3f& p = mesh.position[t[c]];
      x[c] = p[grid.axis];
      corner[c] = {fixed(p[(grid.axis + 1) % 3], grid, 0), fixed(p[(grid.axis + 2) % 3], grid, 1)};
    }
    for (int k = 0; k < 2; ++k) {
      Fixed low = INT64_MAX, high = INT64_MIN;
      for (const Flat& c : corner)
        low = std::min(low, k ? c.z : c.y), high = std::max(high, k ? c.z : c.y);
      first[k] = int(std::clamp(std::ceil(double(low) / fixed_scale), 0., double(grid.count[k])));
      last[k] =
          int(std::clamp(std::floor(double(high) / fixed_scale), -1., double(grid.count[k] - 1)));
    }
  }
  static Fixed fixed(double value, const ShellRays::Grid& grid, int k) {
    // Beyond 2^50 no ray is near: grids are small beside that.
    const double steps = (value - grid.low[k]) / grid.step[k];
    return Fixed(std::llround(std::clamp(steps * fixed_scale, -0x1p60, 0x1p60)));
  }
  /// @return what a winding number changes by, 0 if the ray misses.
  int meet(int j, int k, double& at) const {
    const Flat ray{Fixed(j) << 20, Fixed(k) << 20};
    Wide value[3];
    int side[3];
    for (int c = 0; c < 3; ++c)
      side[c] = side_of(corner[(c + 1) % 3], corner[(c + 2) % 3], ray, value[c]);
    if (side[0] != side[1] || side[1] != side[2] || side[0] == 0) return 0;
    const double w[3] = {double(value[0]), double(value[1]), double(value[2])};
    const double sum = w[0] + w[1] + w[2];
    if (sum == 0) return 0;  // seen from its edge
    at = (w[0] * x[0] + w[1] * x[1] + w[2] * x[2]) / sum;
    return side[0] > 0 ? -1 : 1;  // its normal points along x: out
  }
};

}  // namespace

ShellRays::ShellRays(const TriangleMesh& mesh, const std::vector<int>& shell,
                     const std::vector<uint32_t>& triangles, const Grid& grid)
    : grid_(grid) {
  start_.assign(size_t(grid.count[0]) * size_t(grid.count[1]) + 1, 0);
  const auto each = [&](const auto& visit) {
    for (const uint32_t t : triangles) {
      const FlatTriangle flat(mesh, mesh.triangle[t], grid);
      double x = 0;
      for (int k = flat.first[1]; k <= flat.last[1]; ++k) {
        for (int j = flat.first[0]; j <= flat.last[0]; ++j) {
          if (const int turn = flat.meet(j, k, x)) visit(ray(j, k), Crossing{x, shell[t], turn});
        }
      }
    }
  };
  each([&](size_t ray, const Crossing&) { ++start_[ray + 1]; });
  std::partial_sum(start_.begin(), start_.end(), start_.begin());
  crossing_.resize(start_.back());
  std::vector<size_t> next(start_.begin(), start_.end() - 1);
  each([&](size_t ray, const Crossing& crossing) { crossing_[next[ray]++] = crossing; });
  for (size_t r = 0; r + 1 < start_.size(); ++r) {
    std::sort(crossing_.begin() + long(start_[r]), crossing_.begin() + long(start_[r + 1]),
              [](const Crossing& a, const Crossing& b) {
                return std::tie(a.x, a.shell, a.turn) < std::tie(b.x, b.shell, b.turn);
              });
  }
}

void BodyCount::pass(const ShellRays::Crossing& crossing) {
  int& winding = winding_[size_t(crossing.shell)];
  const bool before = winding != 0;
  winding += crossing.turn;
  if (before == (winding != 0)) return;
  int& holders = holders_[size_t(shells_.body[size_t(crossing.shell)])];
  holders += before ? -1 : 1;
  if (before ? holders == 0 : holders == 1) holding_ += before ? -1 : 1;
}

Shells find_shells(const TriangleMesh& mesh) {
  Shells shells;
  int count = 0;
  shells.shell = shells_of(mesh, count);
  shells.body.resize(size_t(count));  // each its own until they are compared
  std::iota(shells.body.begin(), shells.body.end(), 0);
  shells.depth.assign(size_t(count), 0);
  if (count < 2) return shells;
  Nesting nesting(mesh, shells);
  nesting.find_bodies();
  nesting.find_depths();
  return shells;
}

bool holds_twice(const TriangleMesh& mesh) {
  Shells shells = find_shells(mesh);
  if (shells.bodies() < shells.count()) return true;
  const Nesting nesting(mesh, shells);
  for (int s = 0; s < shells.count(); ++s)
    if (nesting.winds_twice(s)) return true;
  return false;
}

bool shells_meet(const TriangleMesh& mesh) {
  Shells shells = find_shells(mesh);
  if (shells.bodies() < shells.count()) return true;
  const Nesting nesting(mesh, shells);
  for (int a = 0; a < shells.count(); ++a)
    for (int b = a + 1; b < shells.count(); ++b)
      if (nesting.touch(a, b)) return true;
  return false;
}

void orient_shells(TriangleMesh& mesh) {
  const Shells shells = find_shells(mesh);
  const std::vector<double> volume = volumes_of(mesh, shells);
  for (size_t t = 0; t < mesh.triangle.size(); ++t) {
    const int s = shells.shell[t];
    if (volume[size_t(s)] == 0) continue;  // a sheet folded onto itself: neither side is outward
    if ((volume[size_t(s)] < 0) == shells.is_cavity(s)) continue;
    std::swap(mesh.triangle[t].y, mesh.triangle[t].z);
  }
}

}  // namespace drench
