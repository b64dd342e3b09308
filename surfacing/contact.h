#pragma once
// Where the mesh lies on sheets.

#include <cstdint>
#include <vector>

#include "surfacing/cloth_solid.h"
#include "surfacing/extract.h"
#include "surfacing/smooth.h"

namespace drench::surfacing {

/// By vertex of the mesh as it was extracted; empty where there are no sheets.
struct SheetContact {
  std::vector<int8_t> side;    // of the sheet's triangle that it faces, 1 or -1; 0: none
  std::vector<V3f> extracted;  // voxels

  bool touches(const Triangle& t) const {
    return !side.empty() && side[t.x] && side[t.y] && side[t.z];
  }
};

/// Vertices in the gap around the sheets that face one.
SheetContact find_contact(const LatticeMesh& mesh, const VertexRings& rings, const Sheets& sheets);

bool crosses_a_sheet(const LatticeMesh& mesh, const Triangle& t, const Sheets& sheets);

/// Moves vertices in contact to `offset` voxels before the sheets, and the corners of slivers that
/// this makes, there and at the rims, along the surface to the mean of their neighbours. What would
/// cross a sheet between its vertices goes back on its way, to where it was extracted and farther:
/// the rim of a sheet may stand out of the gap around it.
/// @param normal  of the mesh before
/// @return the triangles that cross a sheet all the same.
size_t lay_on_sheets(LatticeMesh& mesh, const VertexRings& rings, const SheetContact& contact,
                     const Sheets& sheets, const std::vector<V3f>& normal, float offset);

/// Unit normals of the free surface, in which triangles in contact have no part; 0 inside the
/// contact.
std::vector<V3f> free_normals(const LatticeMesh& mesh, const VertexRings& rings,
                              const SheetContact& contact);

/// Vertices in contact move as the sheet does, m/s.
void move_with_sheets(const LatticeMesh& mesh, const SheetContact& contact, const Sheets& sheets,
                      std::vector<V3f>& velocity);

}  // namespace drench::surfacing
