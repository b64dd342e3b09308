#pragma once
// Where sheets may start: between the walls, outside obstacles, apart from the fluid.

#include "sim/setup/scene.h"

namespace drench::sim {

/// Notes sheets alone that start beyond walls.
/// @throws Error with cloth, place, and what to move if a sheet beside fluid does so, a sheet
/// starts in an obstacle or through a sheet, or fluid starts nearer to a sheet than a quarter
/// spacing.
void check_cloth_start(const Shot& shot, Scene& scene);

}  // namespace drench::sim
