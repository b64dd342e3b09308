#pragma once
// Slivers, triangles with a small angle, are taken out of the mesh beside cloth, where vertices
// were moved together.

#include "surfacing/cloth_contact.h"

namespace drench::surfacing {

/// Has a triangle around v an angle whose cosine squared is above cos2, or two corners at one
/// point?
bool has_sliver(const std::vector<V3f>& position, const VertexRings& rings, uint32_t v, float cos2);

/// Merges vertices of triangles near cloth that have an angle below 10 degrees into a neighbour,
/// where that leaves fewer of them, the mesh a closed manifold, no triangle turned over and none
/// through cloth. Vertices that stay keep their position.
/// @param normal of the vertices; loses those that go
/// @return how many went.
size_t remove_slivers(LatticeMesh& mesh, VertexRings rings, ClothContact& contact,
                      const ClothSolids& cloth, std::vector<V3f>& normal);

}  // namespace drench::surfacing
