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
  ConstVecView low, high, sorted_low, sorted_high, position, to;
  SheetPieces pieces;
  float half, slack;

  template <class Visit>
  DRENCH_HD void for_each_pair_of(int t, const Visit& visit) const {
    if (owned[t] <= 0) return;
    const Vec3<float> l = low[t], h = high[t];
    const int x0 = grid.cell_x(l.x - half), x1 = grid.cell_x(h.x + half);
    const int y0 = grid.cell_y(l.y - half), y1 = grid.cell_y(h.y + half);
    const int z0 = grid.cell_z(l.z - half), z1 = grid.cell_z(h.z + half);
    for (int z = z0; z <= z1; ++z) {
      for (int y = y0; y <= y1; ++y) {
        const int end = cell_start[grid.index(x1, y, z) + 1];
        for (int k = cell_start[grid.index(x0, y, z)]; k < end; ++k)
          if (meets(k, l, h) && order[k] != t) pairs_of(t, order[k], visit);
      }
    }
  }
  DRENCH_HD bool meets(int k, Vec3<float> l, Vec3<float> h) const {
    return sorted_low.x[k] <= h.x && sorted_high.x[k] >= l.x && sorted_low.y[k] <= h.y &&
           sorted_high.y[k] >= l.y && sorted_low.z[k] <= h.z && sorted_high.z[k] >= l.z;
  }
  template <class Visit>
  DRENCH_HD void pairs_of(int t, int u, const Visit& visit) const {
    const int *a = corner + 3 * t, *b = corner + 3 * u;
    for (int c = 0; c < 3; ++c) {
      if (!(owned[t] & 1 << c) || among(a[c], b)) continue;
      const SheetPair pair{{a[c], b[0], b[1], b[2]}, u};
      if (may_meet(pair)) visit(pair);
    }
    if (t > u) return;
    for (int c = 0; c < 3; ++c) {
      if (!(owned[t] & 8 << c)) continue;
      const int a0 = a[c], a1 = a[c == 2 ? 0 : c + 1];
      for (int e = 0; e < 3; ++e) {
        if (!(owned[u] & 8 << e)) continue;
        const int b0 = b[e], b1 = b[e == 2 ? 0 : e + 1];
        if (a0 == b0 || a0 == b1 || a1 == b0 || a1 == b1) continue;
        const SheetPair pair{{a0, a1, b0, b1}, -1};
        if (may_meet(pair)) visit(pair);
      }
    }
  }
  static DRENCH_HD bool among(int v, const int* corners) {
    return v == corners[0] || v == corners[1] || v == corners[2];
  }

  DRENCH_HD bool may_meet(const SheetPair& pair) const {
    const bool edges = pieces.edges(pair);
    Vec3<float> x[4], d[4];
    pieces.gather(pair, position, x);
    pieces.gather(pair, to, d);
    for (int k = 0; k < 4; ++k) d[k] = d[k] - x[k];
    const float whole = pieces.vertex[pair.vertex[0]].half_thickness +
                        pieces.vertex[pair.vertex[3]].half_thickness;
    const float nearer = approach_of_pieces(edges, d) + 2.f * slack, reach = whole + nearer;
    const int last = edges ? 1 : 0;
    if (apart(x[0].x, x[last].x, x[1].x, x[2].x, x[3].x, edges) > reach ||
        apart(x[0].y, x[last].y, x[1].y, x[2].y, x[3].y, edges) > reach ||
        apart(x[0].z, x[last].z, x[1].z, x[2].z, x[3].z, edges) > reach)
      return false;
    const float distance = length(distance_of_pieces(edges, x).apart);
    return distance <= reach && distance <= pieces.thickness(pair) + nearer;
  }
  /// Along one axis, from the piece of a0 and a1 to that of b0 (unless `edges`), b1 and b2.
  static DRENCH_HD float apart(float a0, float a1, float b0, float b1, float b2, bool edges) {
    const float low = minimum(a0, a1), high = maximum(a0, a1);
    float below = minimum(b1, b2), above = maximum(b1, b2);
    if (!edges) below = minimum(below, b0), above = maximum(above, b0);
    return maximum(below - high, low - above);
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
  const float* half_thickness = c.half_thickness.data();
  const BoxesSpan span = parallel_reduce(
      state.queue, "self: boxes", c.triangles, BoxesSpan{},
      DRENCH_LAMBDA(int t) {
        if (owned[t] < 0) return BoxesSpan{};
        Bounds box;
        for (int k = 0; k < 3; ++k) {
          const int v = corner[3 * t + k];
          box = JoinBounds{}(box, JoinBounds{}(bounds_of(x[v]), bounds_of(to[v] - mean)));
        }
        // A thousandth more than enough, for what rounding takes.
        const float more = 1.001f * (half_thickness[t] + slack) +
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
          .low = low,
          .high = high,
          .sorted_low = sorted_low,
          .sorted_high = sorted_high,
          .position = x,
          .to = to,
          .pieces = sheet_pieces_of(state),
          .half = 1.0001f * span.half,
          .slack = slack};
}

}  // namespace

void load_self_contact(State& state, const ClothTopology& t) {
  SelfContact& s = state.self_contact;
  s.any = state.parameters.self_contact;
  if (!s.any) return;
  std::vector<SheetVertex> vertex(size_t(state.cloth.padded), SheetVertex{});
  for (int k = 0; k < int(t.corner.size()); ++k) {
    const size_t v = size_t(t.corner[k]);
    vertex[v] = {.rest = {t.rest.x[v], t.rest.y[v], t.rest.z[v]},
                 .half_thickness = t.half_thickness[k / 3],
                 .root_friction = std::sqrt(t.friction[v]),
                 .sheet = t.sheet[k / 3]};
    if (t.meets_sheets[v]) s.thickness = std::max(s.thickness, 2 * t.half_thickness[k / 3]);
  }
  from_host(s.vertex, vertex), from_host(s.owned, owned_pieces(t));
  for (VecColumn* column : {&s.low, &s.high, &s.sorted_low, &s.sorted_high})
    column->resize(t.triangles());
  s.to.resize(state.cloth.padded), s.wanted.resize(state.cloth.padded), s.load.resize(state.cloth.padded);
  s.cell.resize(t.triangles()), s.count.resize(t.triangles()), s.first.resize(t.triangles());
  s.portion.resize(state.cloth.padded);
}

void find_sheet_pairs(State& state, float slack) {
  SelfContact& s = state.self_contact;
  const int triangles = state.cloth.triangles;
  s.slack = slack;
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
  std::vector<int> first = to_host(s.count, triangles);
  int sum = 0;
  for (int& begin : first) {
    const int found = begin;
    begin = sum, sum += found;
  }
  s.first.upload(first.data(), first.size());
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
