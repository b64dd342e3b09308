#pragma once
// Whether an MP4 that another program wrote is whole.

#include <filesystem>
#include <string>

namespace drench {

/// What is wrong with a movie as it lies on the disk, empty if nothing: its boxes (ISO 14496-12)
/// end where the file ends, the index names `frames` pictures, and their bytes fit into the data.
/// The encoder may end well although its last write failed.
/// @throws Error if the file cannot be read.
std::string why_not_whole_mp4(const std::filesystem::path& file, size_t frames);

}  // namespace drench
