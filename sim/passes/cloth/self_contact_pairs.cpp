#include "sim/passes/cloth/self_contact_pairs.h"

#include <algorithm>
#include <map>

#include "sim/backend/sort.h"
#include "sim/passes/coupling/polygon_grid.h"
#include "sim/solver.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// Which corners and sides every triangle stands for: the first that has them.
std::vector<int> owned_pieces(const ClothTopology& cloth) {
  std::vector<int> owned;
  std::vector<char> taken(size_t(cloth.vertices()), 0);
  std::map<std::pair<int, int>, int> side;
  for (int t = 0; t < cloth.triangles(); ++t) {
    const int* k = &cloth.corner[3 * size_t(t)];
    int bits = 0;
    for (int c = 0; c < 3; ++c) {
      const int a = k[c], b = k[(c + 1) % 3];
      if (!taken[size_t(a)]) bits |= 1 << c, taken[size_t(a)] = 1;
      if (side.emplace(std::minmax(a, b), t).second) bits |= 8 << c;
    }
    owned.push_back(cloth.meets_sheets[size_t(k[0])] ? bits : -1);
  }
  return owned;
}

/// What the boxes of all triangles span, and the half of the widest along any axis.
struct BoxesSpan {
  Bounds all;
  float half = 0.f;
};
struct JoinSpans {
  DRENCH_HD BoxesSpan operator()(const BoxesSpan& a, const BoxesSpan& b) const {
    return {JoinBounds{}(a.all, b.all), maximum(a.half, b.half)};
  }
};

/// Finds the triangles whose boxes meet that of one, and of these the pairs that may meet.
struct PairSearch {
  GridShape grid;
  const int *cell_start, *order, *owned, *corner;
  const SheetPoint* point;
  ConstVecView low, high, sorted_low, sorted_high;
  SheetPieces pieces;
  float half, slack;

  template <class Visit>
  DRENCH_HD void for_each_pair_of(int t, const Visit& visit) const {
    if (owned[t] < 0) return;
    const Vec3<float> l = low[t], h = high[t];
    const int x0 = grid.cell_x(l.x - half), x1 = grid.cell_x(h.x + half);
    const int y0 = grid.cell_y(l.y - half), y1 = grid.cell_y(h.y + half);
    const int z0 = grid.cell_z(l.z - half), z1 = grid.cell_z(h.z + half);
    for (int z = z0; z <= z1; ++z) {
      for (int y = y0; y <= y1; ++y) {
        const int end = cell_start[grid.index(x1, y, z) + 1];
        for (int k = cell_start[grid.index(x0, y, z)]; k < end; ++k)
          if (order[k] > t && meets(k, l, h)) pairs_of(t, order[k], visit);
      }
    }
  }
  DRENCH_HD bool meets(int k, Vec3<float> l, Vec3<float> h) const {
    return sorted_low.x[k] <= h.x && sorted_high.x[k] >= l.x && sorted_low.y[k] <= h.y &&
           sorted_high.y[k] >= l.y && sorted_low.z[k] <= h.z && sorted_high.z[k] >= l.z;
  }
  template <class Visit>
  DRENCH_HD void pairs_of(int t, int u, const Visit& visit) const {
    const SheetPoint a[3] = {point[corner[3 * t]], point[corner[3 * t + 1]],
                             point[corner[3 * t + 2]]},
                     b[3] = {point[corner[3 * u]], point[corner[3 * u + 1]],
                             point[corner[3 * u + 2]]};
    const float reach = reach_of(a, b);
    const Bounds all_a = JoinBounds{}(box(a[0], a[1]), bounds_of(a[2].x)),
                 all_b = JoinBounds{}(box(b[0], b[1]), bounds_of(b[2].x));
    corners_of(t, a, u, b, all_b, reach, visit);
    corners_of(u, b, t, a, all_a, reach, visit);
    for (int c = 0; c < 3; ++c) {
      if (!(owned[t] & 8 << c)) continue;
      const SheetPoint &a0 = a[c], &a1 = a[c == 2 ? 0 : c + 1];
      const Bounds side = box(a0, a1);
      if (apart(side, all_b, reach)) continue;
      for (int e = 0; e < 3; ++e) {
        const SheetPoint &b0 = b[e], &b1 = b[e == 2 ? 0 : e + 1];
        if (!(owned[u] & 8 << e) || is(a0, b0) || is(a0, b1) || is(a1, b0) || is(a1, b1)) continue;
        if (!apart(side, box(b0, b1), reach)) take(a0, a1, b0, b1, -1, reach, visit);
      }
    }
  }
  /// What the corners of one make with another.
  template <class Visit>
  DRENCH_HD void corners_of(int t, const SheetPoint (&a)[3], int u, const SheetPoint (&b)[3],
                            const Bounds& all, float reach, const Visit& visit) const {
    for (int c = 0; c < 3; ++c) {
      if (!(owned[t] & 1 << c) || is(a[c], b[0]) || is(a[c], b[1]) || is(a[c], b[2])) continue;
      if (!apart(bounds_of(a[c].x), all, reach)) take(a[c], b[0], b[1], b[2], u, reach, visit);
    }
  }
  static DRENCH_HD bool is(const SheetPoint& a, const SheetPoint& b) {
    return a.vertex == b.vertex;
  }
  static DRENCH_HD Bounds box(const SheetPoint& a, const SheetPoint& b) {
    return JoinBounds{}(bounds_of(a.x), bounds_of(b.x));
  }
  static DRENCH_HD bool apart(const Bounds& a, const Bounds& b, float reach) {
    return a.low.x > b.high.x + reach || b.low.x > a.high.x + reach || a.low.y > b.high.y + reach ||
           b.low.y > a.high.y + reach || a.low.z > b.high.z + reach || b.low.z > a.high.z + reach;
  }
  /// How far apart pieces of two triangles may be at the start and meet all the same, m.
  DRENCH_HD float reach_of(const SheetPoint (&a)[3], const SheetPoint (&b)[3]) const {
    const Vec3<float> common = (a[0].way + b[0].way) * 0.5f;
    float off2 = 0.f;
    for (int k = 0; k < 3; ++k)
      off2 = maximum(off2, maximum(length2(a[k].way - common), length2(b[k].way - common)));
    return a[0].half_thickness + b[0].half_thickness + 2.f * (square_root(off2) + slack);
  }
  /// Whether a plane across the line of their middles stands between two pieces with room to spare:
  /// what most neighbours in a sheet need no distance for.
  static DRENCH_HD bool apart_along_middles(bool edges, const Vec3<float> (&x)[4], float reach) {
    const Vec3<float> first = edges ? (x[0] + x[1]) * 0.5f : x[0],
                      second = edges ? (x[2] + x[3]) * 0.5f : (x[1] + x[2] + x[3]) * (1.f / 3.f),
                      axis = first - second;
    const float p0 = dot(axis, x[0]), p1 = dot(axis, x[1]), p2 = dot(axis, x[2]),
                p3 = dot(axis, x[3]), far = maximum(p2, p3);
    const float room = edges ? minimum(p0, p1) - far : p0 - maximum(p1, far);
    return room > 0.f && room * room > reach * reach * length2(axis);
  }
  template <class Visit>
  DRENCH_HD void take(const SheetPoint& a, const SheetPoint& b, const SheetPoint& c,
                      const SheetPoint& d, int triangle, float reach, const Visit& visit) const {
    const SheetPair pair{{a.vertex, b.vertex, c.vertex, d.vertex}, triangle};
    const bool edges = pieces.edges(pair);
    const Vec3<float> x[4] = {a.x, b.x, c.x, d.x}, way[4] = {a.way, b.way, c.way, d.way};
    if (apart_along_middles(edges, x, reach)) return;
    const float nearer = approach_of_pieces(edges, way) + 2.f * slack,
                distance = length(distance_of_pieces(edges, x).apart);
    const float whole = a.half_thickness + d.half_thickness;
    if (distance > whole + nearer) return;
    // What a needle's width joins are neighbours, as what shares a vertex.
    const float keeps = pieces.thickness(pair);
    if (keeps < 0.01f * whole) return;
    if (distance <= keeps + nearer && !pieces.sewn(pair)) visit(pair);
  }
};

/// Boxes of the paths beside their common motion, in a grid.
PairSearch sort_boxes(State& state, float slack) {
  const ClothState& c = state.cloth;
  SelfContact& s = state.self_contact;
  const ConstVecView x = c.position.view(), to = s.to.view();
  const Vec3<double> sum = parallel_reduce(
      state.queue, "self: mean path", c.vertices, Vec3<double>{0, 0, 0},
      DRENCH_LAMBDA(int i) { return to_double(to[i] - x[i]); }, Plus{});
  const Vec3<float> mean = to_float(sum * (1. / c.vertices));
  const VecView low = s.low.view(), high = s.high.view();
  const int *corner = c.corner.data(), *owned = s.owned.data();
  const SheetVertex* of = s.vertex.data();
  SheetPoint* point = s.point.data();
  parallel_for(
      state.queue, "self: points", c.vertices, DRENCH_LAMBDA(int i) {
        point[i] = {x[i], to[i] - x[i], of[i].half_thickness, i};
      });
  const BoxesSpan span = parallel_reduce(
      state.queue, "self: boxes", c.triangles, BoxesSpan{},
      DRENCH_LAMBDA(int t) {
        if (owned[t] < 0) return BoxesSpan{};
        Bounds box;
        for (int k = 0; k < 3; ++k) {
          const SheetPoint p = point[corner[3 * t + k]];
          box = JoinBounds{}(box, JoinBounds{}(bounds_of(p.x), bounds_of(p.x + (p.way - mean))));
        }
        // A thousandth more than enough, for what rounding takes.
        const float more = 1.001f * (point[corner[3 * t]].half_thickness + slack) +
                           1e-6f * (length(box.low) + length(box.high));
        const Vec3<float> room{more, more, more};
        box = {box.low - room, box.high + room};
        low.set(t, box.low), high.set(t, box.high);
        const Vec3<float> size = box.high - box.low, middle = (box.low + box.high) * 0.5f;
        return BoxesSpan{bounds_of(middle), 0.5f * maximum(size.x, maximum(size.y, size.z))};
      },
      JoinSpans{});
  s.grid = make_grid_shape(span.all.low, span.all.high, 2.f * span.half);
  const GridShape grid = s.grid;
  int* cell = s.cell.data();
  parallel_for(
      state.queue, "self: cells", c.triangles, DRENCH_LAMBDA(int t) {
        cell[t] = owned[t] < 0 ? grid.cells() : grid.cell((low[t] + high[t]) * 0.5f);
      });
  stable_sort_keys(state.queue, s.cell, c.triangles, grid.cells(), s.order, s.cell_start);
  const int* order = s.order.data();
  const VecView sorted_low = s.sorted_low.view(), sorted_high = s.sorted_high.view();
  parallel_for(
      state.queue, "self: sorted boxes", c.triangles, DRENCH_LAMBDA(int k) {
        sorted_low.set(k, low[order[k]]), sorted_high.set(k, high[order[k]]);
      });
  return {.grid = grid,
          .cell_start = s.cell_start.data(),
          .order = order,
          .owned = owned,
          .corner = corner,
          .point = point,
          .low = low,
          .high = high,
          .sorted_low = sorted_low,
          .sorted_high = sorted_high,
          .pieces = sheet_pieces_of(state),
          .half = 1.0001f * span.half,
          .slack = slack};
}

}  // namespace

int starts_of(const Column<int>& counts, int n, Column<int>& first) {
  std::vector<int> start = to_host(counts, n);
  int sum = 0;
  for (int& begin : start) {
    const int found = begin;
    begin = sum, sum += found;
  }
  first.resize(n);
  first.upload(start.data(), start.size());
  return sum;
}

void load_self_contact(State& state, const ClothTopology& t) {
  SelfContact& s = state.self_contact;
  const bool at_obstacles = state.triangle_obstacles.any;
  s.any = state.parameters.self_contact || at_obstacles;
  if (!s.any) return;
  std::vector<SheetVertex> vertex(size_t(state.cloth.padded), SheetVertex{});
  const std::vector<int> point = sewn_points(t);
  for (int k = 0; k < int(t.corner.size()); ++k) {
    const size_t v = size_t(t.corner[k]);
    vertex[v] = {.rest = {t.rest.x[v], t.rest.y[v], t.rest.z[v]},
                 .half_thickness = t.half_thickness[k / 3],
                 .root_friction = std::sqrt(t.friction[v]),
                 .sheet = t.sheet[k / 3],
                 .point = point[v]};
    if (t.meets_sheets[v] || at_obstacles)
      s.thickness = std::max(s.thickness, 2 * t.half_thickness[k / 3]);
  }
  const bool joined = t.corner_shift.size() > 0;
  const auto rest = [&](size_t k) {
    const Vec3<float> x = vertex[size_t(t.corner[k])].rest;
    if (!joined) return x;
    return x + Vec3<float>{t.corner_shift.x[k], t.corner_shift.y[k], t.corner_shift.z[k]};
  };
  double edges = 0;
  for (size_t k = 0; k < t.corner.size(); ++k)
    edges += length(rest(k % 3 == 2 ? k - 2 : k + 1) - rest(k));
  s.edge = float(edges / double(t.corner.size()));
  from_host(s.vertex, vertex), from_host(s.owned, owned_pieces(t));
  for (VecColumn* column : {&s.low, &s.high, &s.sorted_low, &s.sorted_high})
    column->resize(t.triangles());
  s.to.resize(state.cloth.padded), s.wanted.resize(state.cloth.padded),
      s.load.resize(state.cloth.padded), s.block.resize(size_t(6) * state.cloth.padded);
  s.cell.resize(t.triangles()), s.count.resize(t.triangles()), s.first.resize(t.triangles());
  s.portion.resize(state.cloth.padded), s.point.resize(state.cloth.padded);
}

void find_sheet_pairs(State& state, float slack) {
  SelfContact& s = state.self_contact;
  const int triangles = state.cloth.triangles;
  s.slack = slack;
  if (!state.parameters.self_contact) return;
  const PairSearch search = sort_boxes(state, slack);
  int* count = s.count.data();
  s.pairs = parallel_reduce(
      state.queue, "self: count pairs", triangles, 0,
      DRENCH_LAMBDA(int t) {
        int found = 0;
        search.for_each_pair_of(t, [&](const SheetPair&) { ++found; });
        count[t] = found;
        return found;
      },
      Plus{});
  if (s.pairs == 0) return;
  starts_of(s.count, triangles, s.first);
  s.pair.resize(s.pairs);
  const int* begin = s.first.data();
  SheetPair* pair = s.pair.data();
  parallel_for(
      state.queue, "self: pairs", triangles, DRENCH_LAMBDA(int t) {
        if (count[t] == 0) return;
        int at = begin[t];
        search.for_each_pair_of(t, [&](const SheetPair& found) { pair[at++] = found; });
      });
}

bool sheet_pairs_hold(const State& state, const ConstVecView& next) {
  const SelfContact& s = state.self_contact;
  const ConstVecView to = s.to.view();
  const float off2 = parallel_reduce(
      state.queue, "self: off the paths", state.cloth.vertices, 0.f,
      DRENCH_LAMBDA(int i) { return length2(next[i] - to[i]); }, Larger{});
  return off2 <= s.slack * s.slack;
}

}  // namespace drench::sim::DRENCH_BACKEND
