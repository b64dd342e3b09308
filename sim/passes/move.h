#pragma once
// The end of a step: particles and cloth move to their new places.

#include "sim/passes/cloth_springs.h"
#include "sim/passes/path_test.h"

namespace drench::sim::DRENCH_BACKEND {

/// Symplectic Euler inside the walls: velocity first, then position. A particle that still reaches the
/// last tenth of a spacing before a wall stops there (the wall's pressure has failed it).
struct Mover {
  float low[3], high[3];
  bool wall[3];
  float dt;

  DRENCH_HD Vec3<float> operator()(Vec3<float> x, Vec3<float>& v) const {
    float p[3] = {x.x + dt * v.x, x.y + dt * v.y, x.z + dt * v.z}, u[3] = {v.x, v.y, v.z};
    for (int k = 0; k < 3; ++k) {
      if (!wall[k]) continue;
      if (p[k] < low[k]) p[k] = low[k], u[k] = max0(u[k]);
      if (p[k] > high[k]) p[k] = high[k], u[k] = -max0(-u[k]);
    }
    v = {u[0], u[1], u[2]};
    return {p[0], p[1], p[2]};
  }
};

inline Mover mover_of(const Parameters& p, float dt) {
  Mover mover{{}, {}, {p.wall[0], p.wall[1], p.wall[2]}, dt};
  for (int k = 0; k < 3; ++k) {
    mover.low[k] = p.low[k] + 0.1f * p.spacing, mover.high[k] = p.high[k] - 0.1f * p.spacing;
  }
  return mover;
}

inline void move_particles(State& state) {
  FluidState& f = state.fluid;
  const VecView x = f.position.view(), v = f.velocity.view();
  const Mover mover = mover_of(state.parameters, float(state.dt));
  parallel_for("move particles", f.count, DRENCH_LAMBDA(int i) {
    Vec3<float> velocity = v[i];
    x.set(i, mover(x[i], velocity));
    v.set(i, velocity);
  });
}

inline void finish_substep(ClothState& c) {
  c.position.swap(c.next);
  c.velocity.swap(c.next_velocity);
}

inline void move_cloth(State& state) {
  const float dt = float(state.dt / state.substeps);
  for (int s = 0; s < state.substeps; ++s) {
    cloth_verlet(state, cloth_buffers(state.cloth), dt);
    finish_substep(state.cloth);
  }
}

/// Particles and cloth together, substep by substep, each path tested against the moving triangles.
inline void copy_vectors(const char* name, VecView to, VecView from, int n) {
  parallel_for(name, n, DRENCH_LAMBDA(int i) { to.set(i, from[i]); });
}

struct GuardCount {
  int hits = 0, unresolved = 0;
};
struct AddGuardCounts {
  DRENCH_HD GuardCount operator()(GuardCount a, GuardCount b) const {
    return {a.hits + b.hits, a.unresolved + b.unresolved};
  }
};

inline PathTest path_test_of(State& state) {
  FluidState& f = state.fluid;
  ClothState& c = state.cloth;
  const VecView next = c.next.view(), start = c.start.view();
  const float moved2 = parallel_reduce("path test: cloth motion", c.vertices, 0.f,
                                       DRENCH_LAMBDA(int v) { return length2(next[v] - start[v]); },
                                       Larger{});
  const Parameters& p = state.parameters;
  return {polygons_of(c), c.position.view(), next, c.next_velocity.view(), f.velocity.view(),
          f.normal.view(), f.start.view(), f.position.view(), f.owed.view(), f.triangle.data(),
          c.held.data(), c.stop_sum.data(), f.stopped.data(), f.sheet_distance.data(), c.mass.data(),
          c.inverse_mass.data(), c.share.data(),
          p.particle_mass, 1e-3f * p.spacing, std::sqrt(moved2), 4};
}

/// The near particles, or all when cloth moves so far that any could meet it.
inline int path_test_count(const State& state, const PathTest& test) {
  const bool all = test.cloth_moved > 0.4f * state.parameters.support_radius;
  return all ? state.fluid.count : state.contact.near;
}

/// One round: where each particle ends, into f.impulse.
inline GuardCount test_paths(State& state, const PathTest& test, float dt) {
  FluidState& f = state.fluid;
  const VecView x = f.position.view(), v = f.velocity.view(), end = f.impulse.view();
  const Mover mover = mover_of(state.parameters, dt);
  const int *triangle = f.triangle.data(), *order = state.contact.order.data();
  int* held = f.held.data();
  return parallel_reduce("path test", path_test_count(state, test), GuardCount{}, DRENCH_LAMBDA(int k) {
    const int i = order[k];  // the near ones come first
    const bool still = held[i] || triangle[i] < 0;
    Vec3<float> velocity = still ? Vec3<float>{0.f, 0.f, 0.f} : v[i];
    Vec3<float> to = mover(x[i], velocity);
    if (!still) v.set(i, velocity);
    GuardCount result;
    if (triangle[i] < 0 || test.in_reach(i, to)) {
      const Vec3<float> wanted = to;
      if (!test.resolve(i, x[i], to)) {
        result.unresolved = 1;
        held[i] = held[i] || test.stopped[i] < 0;  // nothing left to stop but itself
      }
      result.hits = result.unresolved || to.x != wanted.x || to.y != wanted.y || to.z != wanted.z;
    }
    end.set(i, to);
    return result;
  }, AddGuardCounts{});
}

/// Takes back the substep of the vertices that particles stopped in this round, or of all. A stopped vertex
/// takes on the mean velocity of those particles; what that changes of its momentum they share.
inline void hold_cloth(State& state, const PathTest& test, bool everywhere) {
  ClothState& c = state.cloth;
  FluidState& f = state.fluid;
  const VecView next = c.next.view(), next_v = c.next_velocity.view(), x = c.position.view(),
                velocity = f.velocity.view();
  const int *order = state.contact.order.data(), *corner = c.corner.data();
  int* hold = c.held.data();
  const float* mass = c.mass.data();
  const float inverse_mass = 1.f / state.parameters.particle_mass;
  parallel_for("path test: share momentum", path_test_count(state, test), DRENCH_LAMBDA(int k) {
    const int i = order[k], t = test.stopped[i];
    if (t < 0) return;
    Vec3<float> gain{0.f, 0.f, 0.f};
    for (int e = 0; e < 3; ++e) {
      const int v = corner[3 * t + e];
      if (hold[v] || test.inverse_mass[v] == 0.f) continue;
      gain = gain + (next_v[v] - test.stop_velocity(v)) * (mass[v] / float(test.stop_count(v)));
    }
    velocity.set(i, velocity[i] + gain * inverse_mass);
  });
  parallel_for("path test: hold cloth", c.vertices, DRENCH_LAMBDA(int v) {
    const bool stopped = test.stop_count(v) > 0;
    if (!everywhere && !stopped) return;
    if (stopped && !hold[v] && test.inverse_mass[v] > 0.f) next_v.set(v, test.stop_velocity(v));
    for (int k = 0; k < 4; ++k) test.stop_sum[4 * v + k] = 0;
    hold[v] = 1;
    next.set(v, x[v]);
  });
}

/// Particles out of reach of any sheet move once, over the whole step: nothing to test.
inline void move_far_particles(State& state) {
  FluidState& f = state.fluid;
  const VecView x = f.position.view(), v = f.velocity.view();
  const Mover mover = mover_of(state.parameters, float(state.dt));
  const int* triangle = f.triangle.data();
  parallel_for("move far particles", f.count, DRENCH_LAMBDA(int i) {
    if (triangle[i] >= 0) return;
    Vec3<float> velocity = v[i];
    x.set(i, mover(x[i], velocity));
    v.set(i, velocity);
  });
}

/// Far particles have made their step already; should cloth come as far as them they stand still for it.
inline void accept_paths(State& state, int count) {
  const VecView x = state.fluid.position.view(), end = state.fluid.impulse.view();
  const int* order = state.contact.order.data();
  parallel_for("path test: accept", count, DRENCH_LAMBDA(int k) { x.set(order[k], end[order[k]]); });
}

inline void move_coupled(State& state) {
  FluidState& f = state.fluid;
  ClothState& c = state.cloth;
  const float dt = float(state.dt / state.substeps);
  copy_vectors("keep starts", f.start.view(), f.position.view(), f.count);
  copy_vectors("keep cloth starts", c.start.view(), c.position.view(), c.vertices);
  move_far_particles(state);
  for (int s = 0; s < state.substeps; ++s) {
    cloth_verlet(state, cloth_buffers(c), dt);
    f.held.clear_bytes(0);
    f.stopped.clear_bytes(0xff);
    c.held.clear_bytes(0);
    c.stop_sum.clear_bytes(0);
    int tested = 0;
    for (int round = 0;; ++round) {
      const PathTest test = path_test_of(state);
      tested = std::max(tested, path_test_count(state, test));
      const GuardCount count = test_paths(state, test, dt);
      state.guard_hits += count.hits;
      if (count.unresolved == 0) break;
      ++state.guard_holds;
      const bool everywhere = round >= 24;
      hold_cloth(state, test, everywhere);
      if (!everywhere) continue;
      f.held.clear_bytes(1);
      test_paths(state, path_test_of(state), dt);
      break;
    }
    accept_paths(state, tested);
    finish_substep(c);
  }
}

}  // namespace drench::sim::DRENCH_BACKEND
