#pragma once
// Lights that can show nothing.

#include "pipeline/contract/shot_check.h"

namespace drench {

/// Warns of lights that are black, stand under the ground, or shine away from all there is.
void warn_of_useless_lights(const Shot& shot, const ShotSources& sources);

}  // namespace drench
