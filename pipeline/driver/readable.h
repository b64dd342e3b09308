#pragma once
// Whether a file of an output folder can be read as what its name says.

#include <filesystem>
#include <string>

namespace drench {

/// Reads the whole file. @return why it cannot be read; empty if it can, or if nothing reads files
/// so named.
std::string why_unreadable(const std::filesystem::path& file);

}  // namespace drench
