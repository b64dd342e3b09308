#pragma once
// Wavefront OBJ, the part that describes triangles; part of mesh_file.h.

#include <filesystem>
#include <string_view>

#include "pipeline/contract/frames.h"

namespace drench {

/// Positions, faces (polygons are cut into triangles; negative indices count back) and, where every
/// vertex has one texture coordinate only, uv. Velocity is zero. Groups, materials, normals, lines
/// and points are left out. @throws Error naming file, line and reason.
TriangleMesh read_obj(const std::filesystem::path& path, std::string_view text);

}  // namespace drench
