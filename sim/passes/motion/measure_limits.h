#pragma once
// What limits the next step: the largest speed and acceleration, and whether anything is lost.

#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// Largest speeds and accelerations of fluid and cloth, or the first of either that blew up.
Limits measure_limits(const State& state);

}  // namespace drench::sim::DRENCH_BACKEND
