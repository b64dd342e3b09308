#pragma once
// Lights that can show nothing.

#include <Imath/ImathBox.h>

#include "pipeline/contract/shot/shot_check.h"

namespace drench {

/// Of all that may be drawn but the ground, m; what fluid does is not known beyond the domain's
/// open sides, and where cloth goes, and what moves: these count as far away.
Imath::Box3d extent_of_scene(const Shot& shot);

/// Warns of lights that are black, stand under the ground, or shine away from all there is.
void warn_of_useless_lights(const Shot& shot, const ShotSources& sources);

}  // namespace drench
