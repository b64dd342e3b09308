#pragma once
// Wavefront OBJ, the part that describes triangles; part of mesh_file.h.

#include <filesystem>
#include <string_view>

#include "pipeline/contract/files/mesh_file.h"

namespace drench {

/// Positions, faces (negative indices count back) and, as wanted, texture coordinates and normals
/// of corners. Velocity is zero. Groups, materials, lines and points are left out.
/// @throws Error naming file, line and reason.
TriangleMesh read_obj(const std::filesystem::path& path, std::string_view text,
                      CornerData corners = CornerData::none,
                      std::span<const Imath::V3f> cut_by = {});

}  // namespace drench
