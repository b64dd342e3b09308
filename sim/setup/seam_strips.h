#pragma once
// Seams as the fluid sees them. What a seam sews are free edges, around which fluid flows, however
// near they come. A strip of triangles from edge to edge closes the seam: particles that are
// nearest to it, look through it or pass it meet a sheet that hangs on the vertices of both. Where
// the edges' surfaces are half a spacing apart or more the seam is open, and the strip not there.

#include "sim/solver.h"

namespace drench::sim {

/// Strips of all edges whose ends are sewn to the ends of an edge of another triangle, or have one
/// end in common with it, as at the tip of a dart. At least one of the two edges is free.
/// @param spacing  m, of the fluid
SeamStrips seam_strips(const ClothTopology& cloth, double spacing);

}  // namespace drench::sim
