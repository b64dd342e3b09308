#include "sim/passes/cloth/triangle_obstacles.h"

#include <map>

#include "sim/solver.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// Which sides every triangle of a shell stands for: the first that has them.
std::vector<int> owned_sides(const ClothTopology& cloth) {
  std::vector<int> owned;
  std::map<std::pair<int, int>, int> side;
  for (int t = 0; t < cloth.triangles(); ++t) {
    int bits = 0;
    for (int c = 0; c < 3; ++c) {
      const int a = cloth.corner[3 * size_t(t) + c], b = cloth.corner[3 * size_t(t) + (c + 1) % 3];
      if (side.emplace(std::minmax(a, b), t).second) bits |= 1 << c;
    }
    owned.push_back(cloth.shell.area[size_t(t)] > 0.f ? bits : -1);
  }
  return owned;
}

/// Where paths end that come near an obstacle.
struct NearTriangles {
  TrianglePieces pieces;
  const int* side;
  ConstVecView ends;

  /// Of the paths of all corners.
  DRENCH_HD Bounds bounds(int t) const {
    Bounds box;
    const Vec3<float> in = pieces.hold.home(pieces.corners.at(pieces.position, 3 * t));
    for (int c = 0; c < 3; ++c) {
      box = JoinBounds{}(box, bounds_of(pieces.corners.at(pieces.position, 3 * t + c) + in));
      box = JoinBounds{}(box, bounds_of(pieces.corners.at(ends, 3 * t + c) + in));
    }
    return box;
  }
  DRENCH_HD bool near(int t, const ObstacleView& o, const Bounds& box) const {
    if (o.shape == ObstacleShape::plane) return false;  // none is nearer than a corner
    const float keep = pieces.distance_to(o, t);
    if (!o.near_path(box.low, box.high, keep + pieces.slack)) return false;
    const TrianglePaths p = pieces.paths(o, t, ends);
    const float reach = keep + p.approach + pieces.slack;
    const Vec3<float> middle = (p.from[0] + p.from[1] + p.from[2]) * (1.f / 3.f);
    float radius2 = 0.f;
    for (int c = 0; c < 3; ++c) radius2 = maximum(radius2, length2(p.from[c] - middle));
    const float radius = square_root(radius2);
    if (o.distance(middle, o.blend[0]) > radius + reach) return false;
    return !pinned_within(t, o, p, keep);
  }
  /// Pinned vertices may be inside.
  DRENCH_HD bool pinned_within(int t, const ObstacleView& o, const TrianglePaths& p,
                               float keep) const {
    int pinned = 0;
    for (int c = 0; c < 3; ++c) {
      if (pieces.inverse_mass[pieces.corners.vertex[3 * t + c]] > 0.f) continue;
      if (++pinned == 3 || o.distance(p.from[c], o.blend[0]) < keep) return true;
      if (o.distance(p.to[c], o.blend[1]) < keep) return true;
    }
    return false;
  }
  template <class Visit>
  DRENCH_HD void for_each_pair_of(int t, const Visit& visit) const {
    if (side[t] < 0) return;
    const Bounds box = bounds(t);
    for (int k = 0; k < pieces.hold.obstacles.count; ++k)
      if (near(t, pieces.obstacle(k), box)) visit(k);
  }
};

/// Finds the points of a pair that may come too near.
struct TouchSearch {
  TrianglePieces pieces;
  const int* side;
  ConstVecView ends;
  TriangleTouch* found;

  DRENCH_HD int operator()(TrianglePair& pair, int first) const {
    const int t = pair.triangle;
    const ObstacleView& o = pieces.obstacle(pair.obstacle);
    const TrianglePaths p = pieces.paths(o, t, ends);
    const float keep = pieces.distance_to(o, t), tiny = 1e-3f * keep,
                reach = keep + p.approach + pieces.slack;
    const TriangleLeast least(p.at(o, 0.f));
    pair.distance = least.all.distance;
    int count = 0;
    for (int c = 0; c < 3; ++c) {
      if (!(side[t] & 1 << c) || least.side[c].distance > reach || !least.on_side(c, tiny))
        continue;
      TriangleTouch touch{t, pair.obstacle, {0.f, 0.f, 0.f}, least.side[c].distance};
      touch.weight[c] = 1.f - least.side[c].at, touch.weight[c == 2 ? 0 : c + 1] = least.side[c].at;
      found[first + count++] = touch;
    }
    if (least.all.distance > reach || !least.inside(tiny)) return count;
    const float* w = least.all.weight;
    found[first + count++] = {t, pair.obstacle, {w[0], w[1], w[2]}, least.all.distance};
    return count;
  }
};

/// Makes the row of a touch.
struct TouchRow {
  TrianglePieces pieces;
  ConstVecView velocity, path;
  float dt, gravity;

  DRENCH_HD SheetRow operator()(const TriangleTouch& touch) const {
    SheetRow r{};
    const int t = touch.triangle;
    const ObstacleView& o = pieces.obstacle(touch.obstacle);
    Vec3<float> x{0.f, 0.f, 0.f}, way = x, speed = x;
    float inverse = 0.f;
    for (int c = 0; c < 3; ++c) {
      const int v = pieces.corners.vertex[3 * t + c];
      const float w = touch.weight[c];
      r.vertex[c] = v, r.weight[c] = w;
      inverse += w * w * pieces.inverse_mass[v];
      x = x + pieces.corners.at(pieces.position, 3 * t + c) * w;
      way = way + path[v] * (dt * w), speed = speed + velocity[v] * w;
    }
    r.vertex[3] = r.vertex[0], r.obstacle = touch.obstacle;
    const Vec3<float> in = pieces.hold.home(pieces.corners.at(pieces.position, 3 * t));
    const Vec3<float> own = o.to_own(0, x + in);
    r.normal = o.turn(1, o.normal(own, o.blend[0]));
    if (inverse == 0.f || length2(r.normal) < 0.5f) return r;
    r.mass = 1.f / inverse;
    const float whole = pieces.distance_to(o, t), twice = 2.f * whole;
    const float room = pieces.hold.shares ? pieces.hold.shared(touch.obstacle, twice, x + in) : twice;
    r.thickness = minimum(room, whole);
    r.pressed = room < twice;
    r.friction = o.friction;
    const Vec3<float> carried = o.to_frame(1, own) - o.to_frame(0, own);
    const float grown = o.distance(own, o.blend[0]) - o.distance(own, o.blend[1]);
    r.gap = touch.distance + dot(r.normal, way - carried) - grown;
    r.slip = HoldRevision::across(way - carried, r.normal);
    r.speed = HoldRevision::across(speed - carried * (1.f / dt), r.normal);
    // As of pairs of sheets (self_contact.cpp).
    const float apart = dt * maximum(square_root(gravity * r.thickness), 20.f * r.thickness);
    r.target = minimum(r.thickness, touch.distance + minimum(apart, 0.25f * r.thickness));
    if (r.gap > r.target + gravity * dt * dt) return r;
    r.stiffness = row_stiffness * r.mass;
    if (length(r.speed) < r.friction * gravity * dt) r.grip = row_grip * r.mass;
    return r;
  }
};

/// Whether the paths of a pair are safe.
struct TriangleTest {
  TrianglePieces pieces;
  ConstVecView next;
  const TrianglePair* pair;
  float* stop;

  DRENCH_HD bool stops(int k) const {
    const ObstacleView& o = pieces.obstacle(pair[k].obstacle);
    const TrianglePaths p = pieces.paths(o, pair[k].triangle, next);
    stop[k] = 2.f;
    const float start = pair[k].distance, half = pieces.half_thickness[pair[k].triangle];
    // What is too near already may stay so.
    const float keep = minimum(half, start - 0.01f * half);
    float t = 0.f, distance = start;
    for (int step = 0; step < 64; ++step) {
      if (p.approach * (1.f - t) <= distance - keep) return false;
      if (step > 0 && distance <= keep + 0.02f * (start - keep)) break;
      t += (distance - keep) / p.approach;
      distance = TriangleLeast(p.at(o, t)).all.distance;
    }
    stop[k] = t;
    return true;
  }
};

void find_touches(State& state) {
  TriangleObstacles& s = state.triangle_obstacles;
  s.found.resize(4 * s.pairs), s.touch_count.resize(s.pairs);
  const TouchSearch search{triangle_pieces_of(state), s.side.data(), state.self_contact.to.view(),
                           s.found.data()};
  TrianglePair* pair = s.pair.data();
  int* count = s.touch_count.data();
  parallel_for(
      state.queue, "triangles: touches", s.pairs,
      DRENCH_LAMBDA(int k) { count[k] = search(pair[k], 4 * k); });
  s.touches = starts_of(s.touch_count, s.pairs, s.touch_first);
  if (s.touches == 0) return;
  s.touch.resize(s.touches);
  const int* first = s.touch_first.data();
  const TriangleTouch* found = s.found.data();
  TriangleTouch* touch = s.touch.data();
  parallel_for(
      state.queue, "triangles: collect", s.pairs, DRENCH_LAMBDA(int k) {
        for (int e = 0; e < count[k]; ++e) touch[first[k] + e] = found[4 * k + e];
      });
}

}  // namespace

void load_triangle_obstacles(State& state, const ClothTopology& cloth) {
  TriangleObstacles& s = state.triangle_obstacles;
  s.any = state.shell.any && state.parameters.obstacles > 0;
  if (!s.any) return;
  from_host(s.side, owned_sides(cloth));
  s.count.resize(cloth.triangles()), s.carrier.resize(state.cloth.padded);
}

void find_triangles_at_obstacles(State& state) {
  TriangleObstacles& s = state.triangle_obstacles;
  s.pairs = s.touches = 0;
  if (!s.any) return;
  const int triangles = state.cloth.triangles;
  const NearTriangles near{triangle_pieces_of(state), s.side.data(), state.self_contact.to.view()};
  int* count = s.count.data();
  const int any = parallel_reduce(
      state.queue, "triangles: near obstacles", triangles, 0,
      DRENCH_LAMBDA(int t) {
        int found = 0;
        near.for_each_pair_of(t, [&](int) { ++found; });
        count[t] = found;
        return found;
      },
      Plus{});
  if (any == 0) return;
  s.pairs = starts_of(s.count, triangles, s.first);
  s.pair.resize(s.pairs), s.stop.resize(s.pairs);
  const int* first = s.first.data();
  TrianglePair* pair = s.pair.data();
  parallel_for(
      state.queue, "triangles: pairs", triangles, DRENCH_LAMBDA(int t) {
        if (count[t] == 0) return;
        int at = first[t];
        near.for_each_pair_of(t, [&](int k) { pair[at++] = {t, k, 0.f}; });
      });
  find_touches(state);
}

void put_touch_rows(State& state, int first) {
  TriangleObstacles& s = state.triangle_obstacles;
  if (s.touches == 0) return;
  const float* g = state.parameters.gravity;
  const TouchRow make{triangle_pieces_of(state), state.cloth.velocity.view(),
                      path_velocity_of(state), float(state.dt), std::hypot(g[0], g[1], g[2])};
  const TriangleTouch* touch = s.touch.data();
  SheetRow* row = state.self_contact.row.data() + first;
  parallel_for(
      state.queue, "triangles: rows", s.touches, DRENCH_LAMBDA(int k) { row[k] = make(touch[k]); });
}

void react_to_touch_rows(State& state) {
  const SelfContact& s = state.self_contact;
  if (state.triangle_obstacles.touches == 0) return;
  const ClothHold hold = cloth_hold_of(state);
  const ConstVecView change = state.cloth_system.change.view();
  const SheetRow* row = s.row.data();
  const BearingRow* bears = s.bears.data();
  const float inverse_dt = 1.f / float(state.dt);
  parallel_for(
      state.queue, "triangles: reactions", s.bearing, DRENCH_LAMBDA(int k) {
        const SheetRow& r = row[bears[k].row];
        if (r.obstacle < 0) return;
        hold.react(r.obstacle, (push_of(r) - SheetRows::pull(bears[k], change)) * inverse_dt);
      });
}

int count_unsafe_triangles(State& state) {
  TriangleObstacles& s = state.triangle_obstacles;
  if (s.pairs == 0) return 0;
  const TriangleTest test{triangle_pieces_of(state), state.cloth.next.view(), s.pair.data(),
                          s.stop.data()};
  return parallel_reduce(
      state.queue, "triangles: unsafe", s.pairs, 0,
      DRENCH_LAMBDA(int k) { return int(test.stops(k)); }, Plus{});
}

}  // namespace drench::sim::DRENCH_BACKEND
