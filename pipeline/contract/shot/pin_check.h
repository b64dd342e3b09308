#pragma once
// Pins and seams of sheets: what none of their values shows alone.

#include "pipeline/contract/shot/shot_check.h"

namespace drench {

/// Vertices of an edge of a grid, in their order.
std::vector<uint32_t> edge_vertices(GridEdge edge, const V2i& cells);

/// @throws Error with location, keys, values, reason and remedy for the first pin or seam that
/// cannot be right.
void check_pins(const Shot& shot, const ShotSources& sources);

}  // namespace drench
