#pragma once
// Where the mesh lies on cloth.

#include <cstdint>
#include <vector>

#include "surfacing/cloth_solid.h"
#include "surfacing/marching_cubes.h"
#include "surfacing/smooth.h"

namespace drench::surfacing {

/// By vertex of the mesh as it was extracted; empty where there is no cloth.
struct ClothContact {
  std::vector<int8_t> side;    // of the cloth's triangle that it faces, 1 or -1; 0: none
  std::vector<V3f> extracted;  // voxels

  bool touches(const Triangle& t) const {
    return !side.empty() && side[t.x] && side[t.y] && side[t.z];
  }
};

/// Vertices in the gap around the cloth that face it.
ClothContact find_contact(const LatticeMesh& mesh, const VertexRings& rings,
                          const ClothSolids& cloth);

bool crosses_cloth(const LatticeMesh& mesh, const Triangle& t, const ClothSolids& cloth);

/// Moves vertices in contact to `offset` voxels before the cloth, and the corners of slivers that
/// this makes, there and at the rims, along the surface to the mean of their neighbours. What would
/// cross cloth between its vertices goes back, to where it was extracted and farther:
/// the rim of a cloth may stand out of the gap around it.
/// @param normal  of the mesh before
/// @return the triangles that cross cloth all the same.
size_t lay_on_cloth(LatticeMesh& mesh, const VertexRings& rings, const ClothContact& contact,
                    const ClothSolids& cloth, const std::vector<V3f>& normal, float offset);

/// Unit normals of the free surface, in which triangles in contact have no part; 0 inside the
/// contact.
std::vector<V3f> free_normals(const LatticeMesh& mesh, const VertexRings& rings,
                              const ClothContact& contact);

/// Vertices in contact move as the cloth does, m/s.
void move_with_cloth(const LatticeMesh& mesh, const ClothContact& contact, const ClothSolids& cloth,
                     std::vector<V3f>& velocity);

}  // namespace drench::surfacing
