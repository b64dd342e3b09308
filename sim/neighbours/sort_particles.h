#pragma once
// Particles sorted by cell at the start of every step; ties keep their order, which a checkpoint
// holds.

#include "sim/neighbours/periodic.h"
#include "sim/passes/coupling/polygon_grid.h"
#include "sim/passes/obstacle/drain.h"

namespace drench::sim::DRENCH_BACKEND {

/// Cells of all particles, their order by cell and where cells begin.
void sort_by_cell(State& state);

void sort_particles(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
