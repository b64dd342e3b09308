#pragma once
// Emitters, volumes and sinks: what none of their values shows alone.

#include "pipeline/contract/shot/shot.h"
#include "pipeline/contract/shot/shot_check.h"

namespace drench {

/// m^2; of a disc or rectangle, else 0.
double inlet_area(const FluidEmitter& emitter);

/// @throws Error with location, keys, values, reason and remedy for the first emitter, volume, sink
/// or wind that cannot be right.
void check_sources(const Shot& shot, const ShotSources& sources);

}  // namespace drench
