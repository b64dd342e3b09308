#pragma once
// An output folder: its lock, its manifest, and whether its files still are what the manifest says.
//
// A file is trusted when its size and modification time are those recorded: reading hundreds of MB
// to find out that nothing is to be done would take longer than half a second. The time is a hint
// in one direction only: where it or the size differs, the file is hashed, and the digest decides.
// The hint cannot see a disk that flips bits in place. That is found where a stage reads the file
// (the digest of every input is checked before use) and by `drench verify`, which hashes
// everything.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "pipeline/driver/file_lock.h"
#include "pipeline/driver/manifest.h"

namespace drench {

/// Kernel lock on an output folder: released by the kernel when its process ends, however it ends,
/// so that none is ever stale.
class FolderLock {
 public:
  /// Makes the folder if needed, and removes what killed runs left half-written in it, unless
  /// others share it now.
  /// @param kind  shared: drivers of one shot, on any machines, work in the folder at once.
  /// @throws Error if another driver holds it, saying who, or the folder cannot be written.
  explicit FolderLock(const std::filesystem::path& folder, LockKind kind = LockKind::exclusive);

 private:
  LockFile file_;
};

/// One of several drivers that share a folder simulates at a time: a simulation is a chain.
class SimulationLock {
 public:
  /// Waits while another driver simulates in the folder, and says so.
  /// @throws Error if the folder cannot be written.
  explicit SimulationLock(const std::filesystem::path& folder);

 private:
  LockFile file_;
};

enum class FileState { intact, missing, changed };

/// A record and what became of its file.
struct KnownFile {
  Record record;
  FileState state = FileState::intact;
};
using Snapshot = std::map<std::string, KnownFile>;  // by file name

/// What the record says against the file in `folder`: size and time first, the digest where they
/// differ. Never writes.
/// @throws Error as state_by_digest.
FileState state_of(const std::filesystem::path& folder, const Record& record);
Snapshot take_snapshot(const std::filesystem::path& folder, const Manifest& manifest);

/// Hashes the whole file; bytes that the disk does not give are as good as damaged.
/// @throws Error if this user may not read it, or the system lacks what reading takes: nothing is
/// known of the file then, and making it again might cost a simulation.
FileState state_by_digest(const std::filesystem::path& folder, const Record& record);
/// Whether that is intact.
bool has_recorded_digest(const std::filesystem::path& folder, const Record& record);

/// The record of a file just written into `folder`.
Record record_of_file(const std::filesystem::path& folder, const WrittenFile& written);

/// Files under `folder` that the manifest does not list, relative, sorted; the driver's own
/// (manifest, stats, lock, samples of stopped frames) are left out.
/// @throws Error if a folder may not be read.
std::vector<std::string> unlisted_files(const std::filesystem::path& folder,
                                        const Manifest& manifest);

/// Removes samples and pictures of frames in work. Call with the lock held.
void remove_frames_in_work(const std::filesystem::path& folder);

}  // namespace drench
