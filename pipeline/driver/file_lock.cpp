#include "pipeline/driver/file_lock.h"

#include <fmt/format.h>
#include <sys/file.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"

namespace drench {

namespace {

/// @return whether it was taken
bool take(int descriptor, int operation, const std::filesystem::path& file) {
  while (::flock(descriptor, operation) != 0) {
    if (errno == EINTR) continue;
    if (errno == EWOULDBLOCK) return false;
    throw Error(fmt::format("{}: cannot be locked: {}", file.string(), system_reason(errno)));
  }
  return true;
}

}  // namespace

LockFile::LockFile(const std::filesystem::path& file)
    : path_(file), file_(file, O_RDWR | O_CREAT | O_NOFOLLOW, 0666) {
  if (file_.is_open()) return;
  throw Error(fmt::format("{}: the output folder cannot be written: {}", file.string(),
                          system_reason(errno)));
}

bool LockFile::try_take(LockKind kind) {
  if (!take(file_.value(), (kind == LockKind::shared ? LOCK_SH : LOCK_EX) | LOCK_NB, path_))
    return false;
  const std::string note = fmt::format("process {} on {}\n", ::getpid(), host_name());
  // The note only serves messages: the lock holds without it.
  if (::ftruncate(file_.value(), 0) == 0)
    (void)!::pwrite(file_.value(), note.data(), note.size(), 0);
  return true;
}

std::string LockFile::holder() const {
  std::array<char, 256> text{};
  const ssize_t size = ::pread(file_.value(), text.data(), text.size() - 1, 0);
  std::string holder(text.data(), size_t(std::max<ssize_t>(size, 0)));
  while (!holder.empty() && holder.back() == '\n') holder.pop_back();
  std::replace(holder.begin(), holder.end(), '\n', ' ');
  return holder.empty() ? "another process" : holder;
}

FileLock::FileLock(int descriptor, const std::filesystem::path& file) : descriptor_(descriptor) {
  take(descriptor, LOCK_EX, file);
}

FileLock::~FileLock() { ::flock(descriptor_, LOCK_UN); }

}  // namespace drench
