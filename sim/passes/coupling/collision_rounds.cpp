#include "sim/passes/coupling/collision_rounds.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

void copy_vectors(Queue& queue, const char* name, VecView to, ConstVecView from, int n) {
  parallel_for(
      queue, name, n, DRENCH_LAMBDA(int i) { to.set(i, from[i]); });
}

}  // namespace

Drift drift_of(const State& state) {
  return {state.fluid.drift.view(), state.fluid.drift.x.size() > 0};
}

ContinuousCollision continuous_collision_of(State& state, float moved) {
  FluidState& f = state.fluid;
  ClothState& c = state.cloth;
  const ConstVecView next = c.next.view(), start = c.start.view();
  const float moved2 = parallel_reduce(
      state.queue, "collision: cloth motion", c.vertices, 0.f,
      DRENCH_LAMBDA(int v) { return length2(next[v] - start[v]); }, Larger{});
  const Parameters& p = state.parameters;
  const ClothWalls walls = cloth_walls_of(p);
  return {
      .polygons = polygons_of(state),
      .cloth = c.position.view(),
      .cloth_next = next,
      .cloth_velocity = c.next_velocity.view(),
      .velocity = f.velocity.view(),
      .normal = f.normal.view(),
      .start = f.start.view(),
      .position = f.position.view(),
      .owed = f.owed.view(),
      .hold = c.held.data(),
      .stop_sum = c.stop_sum.data(),
      .stopped = f.stopped.data(),
      .nearest = f.triangle.data(),
      .edge = f.edge.data(),
      .distance = f.cloth_distance.data(),
      .cloth_mass = c.mass.data(),
      .inverse_mass = c.inverse_mass.data(),
      .contact_weight = c.share.data(),
      .mass = p.particle_mass,
      .clearance = collision_clearance * p.spacing,
      .cloth_moved = std::max(std::sqrt(moved2), moved),
      .attempts = 4,
      .ground = {constraint_projection(state), (walls.low + walls.high) * 0.5f, p.incompressible}};
}

namespace {

Tested tested_of(const State& state, float cloth_moved) {
  const bool all = cloth_moved > state.contact.cloth_reach;
  return {state.contact.order.data(), state.contact.guarded.data(),
          all ? state.fluid.count : state.contact.guard_count, all};
}

/// One round: where each particle ends, into f.end. In the first of an incompressible step it
/// is there, as the pressure solve found it.
GuardCount resolve_paths(State& state, const ContinuousCollision& test, const Tested& tested,
                         float dt, int round) {
  FluidState& f = state.fluid;
  const ConstVecView x = f.position.view();
  const VecView v = f.velocity.view(), end = f.end.view();
  const Drift drift = drift_of(state);
  const bool found = drift.any && round == 0;
  const Mover mover = path_mover_of(state.parameters, dt);
  const ObstacleGuard guard = obstacle_guard_of(state, 0);
  const int *triangle = f.triangle.data(), *moved = f.moved.data();
  int* held = f.held.data();
  return parallel_reduce(
      state.queue, "collision: paths", tested.count, GuardCount{},
      DRENCH_LAMBDA(int k) {
        const int i = tested[k];
        const bool still = held[i] || moved[i];
        Vec3<float> velocity = still ? Vec3<float>{0.f, 0.f, 0.f} : v[i];
        Vec3<float> to = still ? x[i] : found ? end[i] : mover(x[i] + drift.at(i), velocity);
        if (!still) v.set(i, velocity);
        GuardCount result;
        if (triangle[i] < 0 || test.in_reach(i, to)) {
          const Vec3<float> wanted = to;
          bool clear = test.resolve(i, x[i], to);
          // What the sheet has turned aside may now meet an obstacle, and the other way round.
          for (int turn = 0; guard.obstacles.count > 0 && turn < 4; ++turn) {
            if (!clear || (!held[i] && same(to, wanted))) break;
            Vec3<float> u = v[i];
            const Vec3<float> out = guard(x[i], to, u);
            if (same(out, to)) break;
            v.set(i, u);
            to = out;
            clear = test.resolve(i, x[i], to);
          }
          if (!clear) {
            result.unresolved = 1;
            held[i] = held[i] || test.stopped[i] < 0;  // nothing left to stop but itself
          }
          result.hits = result.unresolved || !same(to, wanted);
        }
        end.set(i, to);
        return result;
      },
      Plus{});
}

/// Which vertices are put back to the substep's start.
enum class Held { stopped, all };

/// Takes back the substep of the vertices that particles stopped in this round, or of all. A
/// stopped vertex takes on its common velocity with those particles; what that changes of its
/// momentum they share.
void hold_cloth(State& state, const ContinuousCollision& test, const Tested& tested, Held which) {
  ClothState& c = state.cloth;
  FluidState& f = state.fluid;
  const VecView next = c.next.view(), next_v = c.next_velocity.view();
  const ConstVecView x = c.position.view();
  const VecView velocity = f.velocity.view();
  const int* corner = c.corner.data();
  int* hold = c.held.data();
  const bool all = which == Held::all;
  const float* mass = c.mass.data();
  const float inverse_mass = 1.f / state.parameters.particle_mass;
  parallel_for(
      state.queue, "collision: share momentum", tested.count, DRENCH_LAMBDA(int k) {
        const int i = tested[k], t = test.stopped[i];
        if (t < 0) return;
        Vec3<float> gain{0.f, 0.f, 0.f};
        for (int e = 0; e < 3; ++e) {
          const int v = corner[3 * t + e];
          if (hold[v] || test.inverse_mass[v] == 0.f) continue;
          const Vec3<float> lost = next_v[v] - test.stop_velocity(v, next_v[v]);
          gain = gain + lost * (mass[v] / float(test.stop_count(v)));
        }
        velocity.set(i, velocity[i] + gain * inverse_mass);
      });
  parallel_for(
      state.queue, "collision: hold cloth", c.vertices, DRENCH_LAMBDA(int v) {
        const bool stopped = test.stop_count(v) > 0;
        if (!all && !stopped) return;
        if (stopped && !hold[v] && test.inverse_mass[v] > 0.f)
          next_v.set(v, test.stop_velocity(v, next_v[v]));
        for (int k = 0; k < 4; ++k) test.stop_sum[4 * v + k] = 0;
        hold[v] = 1;
        if (all || test.inverse_mass[v] > 0.f) next.set(v, x[v]);  // a pin goes its way
      });
  if (state.parameters.obstacles > 0) carry_held_vertices(state);
  guard_sheets(state);  // others may go through what is held
}

/// Chooses the particles that could meet a sheet within the step, with room for cloth to move twice
/// as far as the contact solve predicts. All others make their whole step now: nothing to test. No
/// step of the solvers' own choice takes a particle that is not near as far as a sheet; should one,
/// all paths are tested. They count as a support away, not as beyond_support says: no checkpoint
/// has that.
void move_unguarded_particles(State& state) {
  FluidState& f = state.fluid;
  const ClothState& c = state.cloth;
  const float dt = float(state.dt), spacing = state.parameters.spacing;
  const ConstVecView predicted = c.predicted.view(), cloth_velocity = c.velocity.view();
  const bool solved = state.contact.near > 0;  // else nothing was predicted
  const float speed2 = parallel_reduce(
      state.queue, "guard: cloth speed", c.vertices, 0.f,
      DRENCH_LAMBDA(int v) {
        return maximum(length2(cloth_velocity[v]), solved ? length2(predicted[v]) : 0.f);
      },
      Larger{});
  const float reach = 2.f * dt * std::sqrt(speed2) + 0.05f * spacing;
  // Others than the near ones are only known to be a support away, and may have come nearer since.
  state.contact.cloth_reach = std::min(reach, 0.4f * state.parameters.support_radius);
  const VecView x = f.position.view(), v = f.velocity.view(), start = f.start.view();
  const ConstVecView normal = f.normal.view();
  const ConstVecView end = f.end.view();
  const float* distance = f.cloth_distance.data();
  const int *triangle = f.triangle.data(), *order = state.contact.order.data();
  int *moved = f.moved.data(), *key = state.contact.key.data();
  const Mover mover = path_mover_of(state.parameters, dt);
  const Drift drift = drift_of(state);
  const float room = reach + 2.f * collision_clearance * spacing,
              support = state.parameters.support_radius;
  const float every_path = state.parameters.every_path ? 1.f : 0.f;
  const bool far_ones = any_lane(
      state.queue, "guard: move", f.count, DRENCH_LAMBDA(auto i) {
        const auto from = x.at(i);
        auto velocity = v.at(i);
        using T = decltype(from.x);
        start.put(i, from);
        const auto near = is_index(load(triangle, i));
        const T d = load(distance, i), least = select(near, maximum(d, -d), T(support)),
                path = T(dt) * square_root(length2(velocity)) + square_root(length2(drift.at(i)));
        // Beyond a free edge the distance is not kept.
        const auto on_edge = near & (length2(normal.at(i)) <= T(0.f)),
                   guard = on_edge | (least <= path + T(room)) | (T(every_path) > T(0.f));
        const Vec3<T> old = velocity, to = drift.any ? end.at(i) : mover(from, velocity);
        x.put(i, select(guard, from, to));  // to the bit, as without sheets
        v.put(i, select(guard, old, velocity));
        store(moved, i, !guard);
        return guard & (!near);
      });
  if (far_ones) state.contact.cloth_reach = -1.f;  // see Tested
  parallel_for(
      state.queue, "guard: keys", state.contact.near,
      DRENCH_LAMBDA(int k) { key[k] = moved[order[k]]; });
  stable_sort_keys(state.queue, state.contact.key, state.contact.near, 1, state.contact.guarded,
                   state.contact.guard_start);
  state.contact.guard_count = value_at(state.contact.guard_start, 1);
}

/// Others have made their step already; should cloth come as far as them they stand still for it.
void accept_paths(State& state, const Tested& tested) {
  const VecView x = state.fluid.position.view();
  const ConstVecView end = state.fluid.end.view();
  parallel_for(
      state.queue, "collision: accept", tested.count,
      DRENCH_LAMBDA(int k) { x.set(tested[k], end[tested[k]]); });
}

/// Tests the paths of one substep, round by round, until all are free. Returns how far any vertex
/// has come from its position at the start of the step so far, m, before it was held.
/// @param moved  the same of the substep before.
float guard_substep(State& state, float dt, float moved) {
  FluidState& f = state.fluid;
  ClothState& c = state.cloth;
  ContinuousCollision test = continuous_collision_of(state, moved);
  moved = test.cloth_moved;
  const Tested tested = tested_of(state, moved);
  if (tested.count == 0) return moved;
  f.held.clear_bytes(state.queue, 0);
  f.stopped.clear_bytes(state.queue, 0xff);
  c.held.clear_bytes(state.queue, 0);
  c.stop_sum.clear_bytes(state.queue, 0);
  for (int round = 0;; ++round) {
    const GuardCount count = resolve_paths(state, test, tested, dt, round);
    state.guard_hits += count.hits;
    state.owes |= count.hits > 0;
    if (count.unresolved == 0) break;
    ++state.guard_holds;
    const Held which = round < 24 ? Held::stopped : Held::all;
    hold_cloth(state, test, tested, which);
    test = continuous_collision_of(state, moved);
    if (which == Held::stopped) continue;
    f.held.clear_bytes(state.queue, 1);
    resolve_paths(state, test, tested, dt, round + 1);
    break;
  }
  accept_paths(state, tested);
  return moved;
}

/// Far particles come nearer to the sheets by what they moved beside them: no more than beside any
/// motion in the box that holds those of all vertices, and so of all triangles.
void bring_far_particles_nearer(State& state) {
  FluidState& f = state.fluid;
  const ClothState& c = state.cloth;
  const ConstVecView to = c.position.view();
  const ConstVecView from = c.start.view();
  const Bounds of_cloth = parallel_reduce(
      state.queue, "cloth: motions", c.vertices, Bounds{},
      DRENCH_LAMBDA(int v) { return bounds_of(to[v] - from[v]); }, JoinBounds{});
  const ConstVecView x = f.position.view(), start = f.start.view();
  float* beyond_support = f.beyond_support.data();
  for_each_lane(
      state.queue, "fluid: nearer to cloth", f.count, DRENCH_LAMBDA(auto i) {
        const auto moved = x.at(i) - start.at(i);
        using T = decltype(moved.x);
        const auto most = [](T m, float low, float high) {
          return maximum(m - T(low), T(high) - m);
        };
        const Vec3<T> beside{most(moved.x, of_cloth.low.x, of_cloth.high.x),
                             most(moved.y, of_cloth.low.y, of_cloth.high.y),
                             most(moved.z, of_cloth.low.z, of_cloth.high.z)};
        store(beyond_support, i, load(beyond_support, i) - square_root(length2(beside)));
      });
}

}  // namespace

void move_coupled(State& state) {
  const float dt = float(state.dt / state.substeps);
  copy_vectors(state.queue, "keep cloth starts", state.cloth.start.view(),
               state.cloth.position.view(), state.cloth.vertices);
  move_unguarded_particles(state);
  float moved = 0.f;
  for (int s = 0; s < state.substeps; ++s) {
    if (!state.parameters.incompressible) cloth_verlet(state, cloth_buffers(state.cloth), dt);
    moved = guard_substep(state, dt, moved);
    finish_substep(state.cloth);
    if (state.after_substep) state.after_substep();
  }
  bring_far_particles_nearer(state);
  if (any_periodic(state.parameters)) wrap_positions(state);
}

}  // namespace drench::sim::DRENCH_BACKEND
