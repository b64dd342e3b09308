#pragma once
// Triangle meshes as PLY (binary little-endian) with velocity and attributes, or as OBJ.

#include <filesystem>
#include <span>

#include "pipeline/contract/files/files.h"
#include "pipeline/contract/frames.h"

namespace drench {

/// Columns: x y z, vx vy vz, and those present: nx ny nz, s t, rest_x rest_y rest_z, those of
/// mesh_columns.h, point, id; faces of 3, contact if present. Texture coordinates are s t because
/// Blender's own reader knows no other names.
WrittenFile write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh);

/// Positions, normals if present, and triangles as Wavefront OBJ, for programs that read no PLY;
/// floats in the fewest digits that read back equal.
WrittenFile write_obj(const std::filesystem::path& path, const TriangleMesh& mesh);

/// What of a file's corners is kept beside the vertices, which are split where corners differ in
/// it.
enum class CornerData { none, uv, uv_and_normal };

/// Reads PLY (ASCII or binary of either byte order) or OBJ, by extension; polygons are cut into
/// triangles (polygon.h). Input is hostile: counts are checked against the file's size, indices
/// against the vertex count, positions for being finite. What is left out or mended is a warning.
/// @param cut_by  where the vertices are when polygons are cut, m or any unit; as in the file if
/// empty.
/// @return velocities are 0 where the file has none; `point` where vertices were split.
/// @throws Error naming the file, the location in it and the reason.
TriangleMesh read_mesh(const std::filesystem::path& path, CornerData corners = CornerData::none,
                       std::span<const Imath::V3f> cut_by = {});

}  // namespace drench
