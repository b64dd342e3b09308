#pragma once
// Particles that sinks take, and those that have left the domain: both sort behind all cells.

#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// Gives particles in a sink the key first_key + its index; the first sink takes what lies in two.
void mark_drained(State& state, int first_key);
/// Drops what has sorted behind all cells, and counts it.
void drop_removed(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
