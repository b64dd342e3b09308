#pragma once
// The end of a step in which nothing meets: particles and cloth move to their new positions.

#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// Fluid alone: a step of symplectic Euler within the domain's walls.
void move_particles(State& state);

/// Cloth takes on what a substep has left in ClothState::next and next_velocity.
void finish_substep(ClothState& c);

/// Cloth alone: explicit substeps over a step.
void move_cloth(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
