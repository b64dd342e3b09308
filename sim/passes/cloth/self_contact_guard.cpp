#include "sim/backend/sort.h"
#include "sim/passes/cloth/triangle_obstacles.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// Whether the paths of a pair are safe, to the bit of where they end.
struct PairTest {
  const SheetPair* pair;
  SheetPieces pieces;
  ConstVecView position, next;
  float* stop;

  DRENCH_HD bool stops(int k) const {
    const SheetPair& p = pair[k];
    Vec3<double> x[4], d[4];
    for (int c = 0; c < 4; ++c) {
      x[c] = to_double(position[p.vertex[c]]);
      d[c] = to_double(next[p.vertex[c]]) - x[c];
    }
    const float whole =
        pieces.vertex[p.vertex[0]].half_thickness + pieces.vertex[p.vertex[3]].half_thickness;
    const double part = safe_part(pieces.edges(p), x, d, 0.01 * whole);
    stop[k] = part < 1 ? float(part) : 2.f;
    return part < 1;
  }
};

/// How a round stops what is not safe.
enum class Stop {
  at_part,   // where it is safe if the others keep their paths
  bounded,   // within less than half the least distance to what may meet it (Chen et al. 2025)
  at_base,   // what is not safe where it started, or the obstacle that stops it takes it
  at_start,  // all of it where it started
};

struct VertexStop {
  const SheetPair* pair;
  SheetPieces pieces;
  const int *start, *entry;
  const float* stop;
  ConstVecView position, wanted;
  VecView next;
  float* portion;
  TriangleStops at_obstacles;
  Stop how;

  DRENCH_HD void operator()(int v) const {
    float part = 2.f, nearest = 1e30f;
    for (int e = start[v]; e < start[v + 1]; ++e) {
      part = minimum(part, stop[entry[e] >> 2]);
      if (how == Stop::bounded) nearest = minimum(nearest, distance(pair[entry[e] >> 2]));
    }
    const TriangleStops::Stop met = at_obstacles(v);
    part = minimum(part, met.part);
    if (how == Stop::at_start || (how == Stop::at_base && part < 1.f)) part = 0.f;
    if (part >= 1.f) return;
    const Vec3<float> base = base_of(v, met.obstacle);
    float may = portion[v] * part;
    const Vec3<float> way = wanted[v] - base;
    if (how == Stop::bounded)
      may = minimum(portion[v] * minimum(met.part, 1.f),
                    0.4f * nearest / maximum(length(way), 1e-30f));
    if (may < 1e-3f) may = 0.f;
    portion[v] = may;
    next.set(v, may == 0.f ? base : base + way * may);
  }
  /// Where no part of its path takes a vertex. m
  DRENCH_HD Vec3<float> base_of(int v, int obstacle) const {
    const Vec3<float> x = position[v];
    if (!at_obstacles.any) return x;
    int& by = at_obstacles.carrier[v];
    if (by < 0) by = obstacle;
    if (how == Stop::at_start) by = -1;
    return by < 0 ? x : x + at_obstacles.carried(by, x);
  }
  DRENCH_HD float distance(const SheetPair& p) const {
    Vec3<float> x[4];
    pieces.gather(p, position, x);
    return length(distance_of_pieces(pieces.edges(p), x).apart);
  }
};

void sort_pairs(State& state) {
  SelfContact& s = state.self_contact;
  const SheetPair* pair = s.pair.data();
  const int entries = 4 * s.pairs;
  if (entries == 0) {
    s.pair_start.resize(size_t(state.cloth.padded) + 1);
    s.pair_start.clear_bytes(state.queue, 0);
    return;
  }
  s.key.resize(entries);
  int* key = s.key.data();
  parallel_for(
      state.queue, "self: keys of pairs", entries,
      DRENCH_LAMBDA(int e) { key[e] = pair[e >> 2].vertex[e & 3]; });
  stable_sort_keys(state.queue, s.key, entries, state.cloth.padded, s.pair_entry, s.pair_start);
}

int count_unsafe(State& state) {
  SelfContact& s = state.self_contact;
  if (s.pairs == 0) return 0;
  s.stop.resize(s.pairs);
  const PairTest test{s.pair.data(), sheet_pieces_of(state), state.cloth.position.view(),
                      state.cloth.next.view(), s.stop.data()};
  return parallel_reduce(
      state.queue, "self: unsafe pairs", s.pairs, 0,
      DRENCH_LAMBDA(int k) { return int(test.stops(k)); }, Plus{});
}

/// Notes where vertices would go, before the first is stopped.
void keep_wanted_paths(State& state) {
  const VecView wanted = state.self_contact.wanted.view();
  const ConstVecView next = state.cloth.next.view();
  float* portion = state.self_contact.portion.data();
  const bool at_obstacles = state.triangle_obstacles.any;
  int* carrier = state.triangle_obstacles.carrier.data();
  parallel_for(
      state.queue, "self: wanted paths", state.cloth.vertices, DRENCH_LAMBDA(int v) {
        wanted.set(v, next[v]);
        portion[v] = 1.f;
        if (at_obstacles) carrier[v] = -1;
      });
}

/// One round of stops.
void stop_vertices(State& state, Stop how) {
  SelfContact& s = state.self_contact;
  sort_pairs(state);
  const VertexStop stop{.pair = s.pair.data(),
                        .pieces = sheet_pieces_of(state),
                        .start = s.pair_start.data(),
                        .entry = s.pair_entry.data(),
                        .stop = s.stop.data(),
                        .position = state.cloth.position.view(),
                        .wanted = s.wanted.view(),
                        .next = state.cloth.next.view(),
                        .portion = s.portion.data(),
                        .at_obstacles = triangle_stops_of(state),
                        .how = how};
  parallel_for(
      state.queue, "self: stop", state.cloth.vertices, DRENCH_LAMBDA(int v) { stop(v); });
}

/// Without rebound.
void give_stopped_velocities(State& state) {
  ClothState& c = state.cloth;
  const ConstVecView x = c.position.view(), next = c.next.view();
  const VecView velocity = c.next_velocity.view(), predicted = c.predicted.view();
  const float *portion = state.self_contact.portion.data(), inverse_dt = 1.f / float(state.dt);
  const TriangleStops stops = triangle_stops_of(state);
  const float* mass = c.mass.data();
  parallel_for(
      state.queue, "self: stopped velocities", c.vertices, DRENCH_LAMBDA(int v) {
        if (portion[v] == 1.f) return;
        const Vec3<float> u = (next[v] - x[v]) * inverse_dt;
        if (stops.any && stops.carrier[v] >= 0)
          stops.hold.react(stops.carrier[v], (u - velocity[v]) * mass[v]);
        velocity.set(v, u), predicted.set(v, u);
      });
}

void find_pairs_of_paths(State& state) {
  const VecView to = state.self_contact.to.view();
  const ConstVecView next = state.cloth.next.view();
  parallel_for(
      state.queue, "self: paths", state.cloth.vertices,
      DRENCH_LAMBDA(int v) { to.set(v, next[v]); });
  find_sheet_pairs(state, 0.f);
  find_triangles_at_obstacles(state);
}

}  // namespace

void guard_sheets(State& state) {
  if (!state.self_contact.any) return;
  constexpr int rounds_at_part = 8, rounds_bounded = 16, rounds = 20;
  int round = 0;
  for (;; ++round) {
    // Who is stopped has others come at him that moved along with him.
    if (!sheet_pairs_hold(state, state.cloth.next.view())) find_pairs_of_paths(state);
    const int pairs = count_unsafe(state), triangles = count_unsafe_triangles(state);
    if (pairs + triangles == 0) break;
    if (round == 0) keep_wanted_paths(state);
    // An obstacle may take what it carries through others, so that this has its rounds, too.
    stop_vertices(state, round < rounds_at_part   ? Stop::at_part
                         : round < rounds_bounded ? Stop::bounded
                         : round < rounds         ? Stop::at_base
                                                  : Stop::at_start);
    if (round == rounds) break;
  }
  if (round > 0) give_stopped_velocities(state);
}

}  // namespace drench::sim::DRENCH_BACKEND
