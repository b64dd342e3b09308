#pragma once
// The passes of a step in order. A pass that is not in the plan costs no memory and no launch.

#include <span>

#include "sim/solver.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

struct Pass {
  const char* name;
  bool (*when)(const Parameters& p, bool cloth);
  ColumnSet reads, writes;
  void (*launch)(State& state);
  ColumnSet writes_beside_cloth = {};  // in a shot with cloth, too; step_plan adds it to writes
  bool of_sheets = false;              // left out of a step while all_sheets_sleep
};

/// Every pass there is, in order.
std::span<const Pass> every_pass();
/// The plan of a shot: those whose `when` holds.
std::vector<Pass> step_plan(const Parameters& parameters, bool cloth);

/// A step of cloth that no fluid touches.
void step_cloth_alone(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
