#pragma once
// The end of a coupled step: particles and cloth move together, and where a path meets a triangle
// both are stopped, in rounds, until none does (continuous_collision.h).

#include "sim/passes/cloth/cloth_obstacles.h"
#include "sim/passes/coupling/continuous_collision.h"
#include "sim/passes/motion/advection.h"

namespace drench::sim::DRENCH_BACKEND {

/// What a particle's path has beside dt times its velocity.
struct Drift {
  ConstVecView drift;  // m
  bool any;
  template <class Index>
  DRENCH_HD auto at(Index i) const {
    decltype(drift.at(i)) none{{}, {}, {}};
    return any ? drift.at(i) : none;
  }
};
Drift drift_of(const State& state);

/// Particles whose path was changed, and those that need another round.
struct GuardCount {
  int hits = 0, unresolved = 0;
  DRENCH_HD GuardCount operator+(GuardCount other) const {
    return {hits + other.hits, unresolved + other.unresolved};
  }
};

/// The collision test of a substep, from the start of it to ClothState::next.
/// @param moved  how far cloth came in the substeps before, m: a triangle that springs back starts
/// there.
ContinuousCollision continuous_collision_of(State& state, float moved);

/// The particles that are tested: the guarded ones, or all once cloth has come farther than they
/// were chosen for.
struct Tested {
  const int *order, *guarded;  // the near list, indices in it
  int count;
  bool all;
  DRENCH_HD int operator[](int k) const { return all ? k : order[guarded[k]]; }
};

/// To the bit.
DRENCH_HD bool same(Vec3<float> a, Vec3<float> b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/// Particles and cloth together, substep by substep, each path tested against the moving triangles
/// (continuous collision).
void move_coupled(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
