#pragma once
// Marching cubes on the evaluated blocks: an indexed mesh whose vertices are shared.

#include <vector>

#include "surfacing/field.h"

namespace drench::surfacing {

using Triangle = Imath::Vec3<uint32_t>;

/// Vertices of one block, consecutive in the mesh.
struct BlockVertices {
  V3i block;
  uint32_t begin, end;
};

/// Closed 2-manifold mesh in voxels from the lattice's origin. Vertices follow the order of blocks
/// and, in a block, axis of the cut edge, z, y, x; triangles that of blocks and cells.
struct LatticeMesh {
  std::vector<V3f> position;
  std::vector<Triangle> triangle;
  std::vector<BlockVertices> block;
};

/// @param field      is used up: its values go before there are triangles
/// @param max_bytes  that the mesh and what is made from it may take; Error with the number if not.
LatticeMesh extract_surface(ColourField field, float iso_value, double max_bytes);

}  // namespace drench::surfacing
