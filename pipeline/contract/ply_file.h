#pragma once
// The PLY reader of mesh_file.h, from memory.

#include <filesystem>
#include <string_view>

#include "pipeline/contract/frames.h"

namespace drench {

/// ASCII or binary little-endian; elements and properties that nobody reads are skipped.
/// @throws Error naming the file and the reason.
TriangleMesh read_ply(const std::filesystem::path& path, std::string_view text);

}  // namespace drench
