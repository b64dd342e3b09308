#pragma once
// Files are written whole or not at all: a temporary name in the same folder, checked, fsynced,
// renamed.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/hash.h"

namespace drench {

/// What a finished file is.
struct WrittenFile {
  std::filesystem::path path;
  uint64_t size = 0;
  Digest digest;
};

/// Lets `write` fill a temporary file beside `path`, then fsyncs it, checks it, hashes it, renames
/// it to `path` and fsyncs the folder. If `write` throws or the disk is full, nothing is left
/// behind and what stood at `path` before still does. Creates missing parent folders.
/// @throws Error naming the file and the system's reason.
WrittenFile write_file_whole(
    const std::filesystem::path& path,
    const std::function<void(const std::filesystem::path& temporary)>& write);
WrittenFile write_file_whole(const std::filesystem::path& path, std::string_view bytes);

/// @throws Error if the file is missing, not a regular file, or larger than max_bytes.
std::vector<std::byte> read_file(const std::filesystem::path& path, uint64_t max_bytes = uint64_t(1)
                                                                                         << 36);
std::string read_text(const std::filesystem::path& path, uint64_t max_bytes = 1 << 24);

/// Removes the temporaries that killed runs left in `folder` (not below it): files that
/// write_file_whole named, `.STEM.HOST.PID-COUNT.tmp.EXT`, whose process is gone, or was one of
/// another machine. A missing folder holds none. Call with the lock of whatever the folder belongs
/// to, so that no other machine writes into it.
/// @return how many were removed.
/// @throws Error if the folder cannot be listed or a file not removed.
int remove_stale_temporaries(const std::filesystem::path& folder);

/// Name of this machine.
std::string host_name();

/// What the system means by an errno and what to do about it: "no space left on device; free ...".
std::string system_reason(int error_number);

}  // namespace drench
