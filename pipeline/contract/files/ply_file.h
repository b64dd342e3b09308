#pragma once
// The PLY reader of mesh_file.h, from memory.

#include <filesystem>
#include <string_view>

#include "pipeline/contract/files/mesh_file.h"

namespace drench {

/// ASCII or binary; elements and properties that nobody reads are skipped. Texture coordinates
/// stand at vertices (u v, s t, texture_u texture_v) or, as wanted, at the corners of faces
/// (texcoord).
/// @throws Error naming the file and the reason.
TriangleMesh read_ply(const std::filesystem::path& path, std::string_view text,
                      CornerData corners = CornerData::none,
                      std::span<const Imath::V3f> cut_by = {});

}  // namespace drench
