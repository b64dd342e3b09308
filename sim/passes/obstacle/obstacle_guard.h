#pragma once
// Prediction and pressure beside obstacles: every path ends at the last guard (obstacle_path.h).
// Pressure stops particles about half a spacing off: the guard acts on what it has failed.

#include "sim/passes/obstacle/obstacle_path.h"
#include "sim/passes/pressure/incompressible.h"

namespace drench::sim::DRENCH_BACKEND {

/// predict_particles with obstacles that move at the same time.
void predict_around_obstacles(State& state);

/// project_density with obstacles where the step ends.
void project_around_obstacles(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
