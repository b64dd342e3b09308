#pragma once
// The kernel's lock of an open file (flock): it ends with the process that holds it, so that none
// is ever stale. Over NFS it holds between machines (Linux turns it into a byte-range lock, and
// reads and writes under it see what others wrote).

#include <filesystem>
#include <string>

#include "pipeline/contract/files/descriptor.h"

namespace drench {

enum class LockKind {
  exclusive,
  shared  // any number of these at once
};

/// A file that says who holds its lock.
class LockFile {
 public:
  /// Opens it, or makes it. @throws Error naming the file
  explicit LockFile(const std::filesystem::path& file);
  /// Takes the lock, or changes its kind, and notes this process as its holder.
  /// @return whether it was free. @throws Error if the file cannot be locked at all.
  bool try_take(LockKind kind);
  /// "process 12 on node7"
  std::string holder() const;

 private:
  const std::filesystem::path path_;
  const Descriptor file_;
};

/// An exclusive lock while it lives, for a few system calls: waits for it.
class FileLock {
 public:
  /// @throws Error naming the file if it cannot be locked.
  FileLock(int descriptor, const std::filesystem::path& file);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  const int descriptor_;
};

}  // namespace drench
