#pragma once
// Models of sheets, and constants of shells, that a shot does not give.

#include "pipeline/contract/shot/shot.h"
#include "pipeline/contract/shot/shot_check.h"

namespace drench {

/// Decides ClothModel::automatic and gives every shell the constants of its fabric, but for those
/// whose keys the shot has.
/// @throws Error for a fabric that there is none of, and for keys of both models.
void take_fabrics(Shot& shot, const ShotSources& sources);

}  // namespace drench
