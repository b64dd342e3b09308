#pragma once
// Foam caches: OpenVDB point grids that open in Houdini. Library drench_vdb.

#include <filesystem>

#include "pipeline/contract/files/files.h"
#include "pipeline/contract/frames.h"

namespace drench {

/// Writes 16-bit positions in voxels of 4 spacings and the other columns as they are, Blosc: what
/// is read is the state that the next frame starts from. Columns are P, v, id, age, pscale and kind
/// (0 spray, 1 foam, 2 bubble). Equal frames give equal bytes, for any thread count.
/// @throws Error for a particle that is not finite or too far away.
WrittenFile write_foam(const std::filesystem::path& path, const FoamFrame& frame);

/// Foam sorted by id. @throws Error if damaged or not such a file.
FoamFrame read_foam(const std::filesystem::path& path);

}  // namespace drench
