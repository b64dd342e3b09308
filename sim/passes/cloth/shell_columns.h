#pragma once
// Shells from the host's arrays to columns.

#include "sim/solver.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// Fills ShellState, after the rest of the cloth; nothing where no sheet is a shell.
void load_shell(State& state, const ClothTopology& cloth);

}  // namespace drench::sim::DRENCH_BACKEND
