#pragma once
// A step of the incompressible fluid: particles move with the velocity they have, and the pressures
// that take the density there back to rest displace them and change that velocity. One solve a step
// at the predicted positions in place of the two of DFSPH (Bender and Koschier 2017): density is
// linear in the displacement, so what is left is the second order of the small correction and not
// of the whole step (docs/decisions/0001-one-solve-a-step.md).

#include "sim/passes/coupling/cloth_filter.h"
#include "sim/passes/coupling/collision_rounds.h"
#include "sim/passes/obstacle/obstacle_density.h"
#include "sim/passes/pressure/image_walls.h"
#include "sim/passes/pressure/pressure_solve.h"
#include "sim/passes/pressure/velocity_smoothing.h"

namespace drench::sim::DRENCH_BACKEND {

void predict_particles(State& state);

/// Neighbour lists, density, walls and the diagonal of the pressure matrix.
void find_neighbours(State& state);

void project_density(State& state);

/// Fluid and sheets go to their new places, each path tested against the moving triangles
/// (continuous collision).
void move_with_sheets(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
