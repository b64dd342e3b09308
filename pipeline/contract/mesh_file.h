#pragma once
// Triangle meshes as PLY (binary little-endian) with velocity and attributes, or as OBJ.

#include <filesystem>

#include "pipeline/contract/files.h"
#include "pipeline/contract/frames.h"

namespace drench {

/// Columns: x y z, vx vy vz, and those present: nx ny nz, u v, rest_x rest_y rest_z; faces
/// of 3, contact if present.
WrittenFile write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh);

/// Positions, normals if present, and triangles as Wavefront OBJ, for programs that read no PLY;
/// floats in the fewest digits that read back equal.
WrittenFile write_obj(const std::filesystem::path& path, const TriangleMesh& mesh);

/// Reads PLY (ASCII or little-endian; polygons are cut into triangles) or OBJ, by extension. Input
/// is hostile: counts are checked against the file's size, indices against the vertex count, values
/// for being finite. @throws Error naming the file and the reason.
TriangleMesh read_mesh(const std::filesystem::path& path);

}  // namespace drench
