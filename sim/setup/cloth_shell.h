#pragma once
// Shells from sheets: what of them never changes.

#include "sim/setup/scene.h"

namespace drench::sim {

/// Appends a sheet that is a shell, or zeros for one of springs: its vertices, triangles and
/// neighbours stand in `topology` already.
/// @param frame  whose rounding of places the rest shape shares with the start
void append_shell(const Sheet& sheet, const Cloth& cloth, const LocalFrame& frame,
                  ClothTopology& topology);

}  // namespace drench::sim
