#pragma once
// Obstacles and periodic axes: what a seam would cut.

#include "pipeline/contract/shot/shot.h"
#include "pipeline/contract/shot/shot_check.h"

namespace drench {

/// @throws Error with location, key, values, reason and remedy for the first plane that is not the
/// same all along a periodic axis, and for the first box that would overlap an image of itself
/// askew, at any frame of the shot.
void check_obstacles_at_seams(const Shot& shot, const ShotSources& sources);

}  // namespace drench
