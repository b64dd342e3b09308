#pragma once
// Camera, lights, materials and who uses them: what none of their values shows alone.

#include "pipeline/contract/shot/shot.h"
#include "pipeline/contract/shot/shot_check.h"

namespace drench {

/// @throws Error with location, keys, values, reason and remedy for the first part of the picture
/// that cannot be right.
void check_picture(const Shot& shot, const ShotSources& sources);

}  // namespace drench
