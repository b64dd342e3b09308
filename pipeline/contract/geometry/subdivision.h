#pragma once
// Sheets of cloth as they are meshed and drawn: smooth where their triangles fold.

#include "pipeline/contract/frames.h"

namespace drench {

/// A sheet's limit surface under Loop's subdivision (Loop, "Smooth subdivision surfaces based on
/// triangles", 1987; edges and corners of the sheet stay such), by OpenSubdiv. Two triangles that
/// share an edge, or the points of one, share the new vertices there, so that nothing opens.
/// Velocity, uv and wetness are linear between the corners of a triangle; other columns, which
/// neither meshing nor drawing reads, are left out. Edges of more than two triangles stay sharp.
/// @param mesh    its columns as TriangleMesh says
/// @param levels  at least 0, which gives the mesh itself; each divides triangles into 4
/// @param limit   > 0, m: no point moves as far as this from its place on the flat triangle, so
///                that sheets and solids that are twice as far apart do not meet
TriangleMesh subdivided(const TriangleMesh& mesh, int levels, float limit);

/// Of a sheet of so many triangles: 2, or as many as leave it no more than 2^18 triangles.
int automatic_levels(size_t triangles);

}  // namespace drench
