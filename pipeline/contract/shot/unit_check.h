#pragma once
// Values that may stand, and look as if they were meant in another unit.

#include "pipeline/contract/shot/shot.h"

namespace drench {

/// Warns of keys that all lie before the simulation starts, as seconds in place of frames do; of
/// sheets as thick as millimetres, or as heavy as grams, taken for metres and kilograms; of what
/// races; of solids that the fluid cannot feel.
void warn_of_units(const Shot& shot);

}  // namespace drench
