#pragma once
// Pictures that can show nothing.

#include "pipeline/contract/shot/shot.h"

namespace drench {

/// Warns of a shot without any light, and of a camera that stands in a solid or under the ground,
/// or looks away from all there is, in every frame. Only where frames are to be rendered.
void warn_of_empty_pictures(const Shot& shot);

}  // namespace drench
