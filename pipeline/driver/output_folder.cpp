#include "pipeline/driver/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"
#include "pipeline/driver/layout.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

int64_t mtime_of(const struct stat& status) {
  return int64_t(status.st_mtim.tv_sec) * 1'000'000'000 + status.st_mtim.tv_nsec;
}

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown host";
}

std::string holder_of(int descriptor) {
  std::array<char, 256> text{};
  const ssize_t size = ::pread(descriptor, text.data(), text.size() - 1, 0);
  std::string holder(text.data(), size_t(std::max<ssize_t>(size, 0)));
  std::replace(holder.begin(), holder.end(), '\n', ' ');
  return holder.empty() ? "another process" : holder;
}

void make_folder(const fs::path& folder) {
  std::error_code code;
  fs::create_directories(folder, code);
  if (code || !fs::is_directory(folder)) {
    throw Error(fmt::format("{}: the output folder cannot be made: {}", folder.string(),
                            system_reason(code ? code.value() : ENOTDIR)));
  }
}

[[noreturn]] void fail_to_read(const fs::path& path, int reason) {
  throw Error(fmt::format("{}: cannot be read: {}", path.string(), system_reason(reason)));
}

/// Whether an errno is about this user and this process, and not about the file.
bool says_nothing_of_the_file(int reason) {
  return reason == EACCES || reason == EPERM || reason == EMFILE || reason == ENFILE ||
         reason == ENOMEM;
}

/// Of the name itself, a link not followed; nothing if there is none. @throws Error if the folder
/// may not be read.
std::optional<struct stat> status_of(const fs::path& path) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) == 0) return status;
  if (says_nothing_of_the_file(errno)) fail_to_read(path, errno);
  return {};
}

}  // namespace

FolderLock::FolderLock(const fs::path& folder) {
  make_folder(folder);
  const fs::path file = folder / layout::lock;
  descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (descriptor_ < 0) {
    throw Error(fmt::format("{}: the output folder cannot be written: {}", file.string(),
                            system_reason(errno)));
  }
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    const int reason = errno;
    const std::string holder = reason == EWOULDBLOCK ? holder_of(descriptor_) : "";
    ::close(descriptor_);
    if (reason != EWOULDBLOCK) {
      throw Error(fmt::format("{}: cannot be locked: {}", file.string(), system_reason(reason)));
    }
    throw Error(
        fmt::format("{}: {} is working in this folder; wait until it has ended, or give "
                    "another --out",
                    folder.string(), holder));
  }
  const std::string note = fmt::format("process {} on {}\n", ::getpid(), host_name());
  // The note only serves the message above: the lock holds without it.
  if (::ftruncate(descriptor_, 0) == 0) (void)!::pwrite(descriptor_, note.data(), note.size(), 0);
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

FileState state_of(const fs::path& folder, const Record& record) {
  const std::optional<struct stat> status = status_of(folder / record.file);
  if (!status) return FileState::missing;
  if (!S_ISREG(status->st_mode) || uint64_t(status->st_size) != record.size) {
    return FileState::changed;
  }
  if (mtime_of(*status) == record.mtime_ns) return FileState::intact;
  return state_by_digest(folder, record);
}

Snapshot take_snapshot(const fs::path& folder, const Manifest& manifest) {
  Snapshot snapshot;
  for (auto& [file, record] : manifest.records()) {
    snapshot[file] = {record, state_of(folder, record)};
  }
  return snapshot;
}

FileState state_by_digest(const fs::path& folder, const Record& record) {
  const fs::path path = folder / record.file;
  const std::optional<struct stat> status = status_of(path);
  if (!status) return FileState::missing;
  if (!S_ISREG(status->st_mode) || uint64_t(status->st_size) != record.size) {
    return FileState::changed;
  }
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
  if (descriptor < 0 && says_nothing_of_the_file(errno)) fail_to_read(path, errno);
  if (descriptor >= 0) ::close(descriptor);
  try {
    return hash_file(path) == record.digest ? FileState::intact : FileState::changed;
  } catch (const Error&) {
    return FileState::changed;
  }
}

bool has_recorded_digest(const fs::path& folder, const Record& record) {
  return state_by_digest(folder, record) == FileState::intact;
}

Record record_of_file(const fs::path& folder, const WrittenFile& written) {
  struct stat status {};
  if (::lstat(written.path.c_str(), &status) != 0) {
    throw Error(
        fmt::format("{}: vanished just after it was written; does another program clean "
                    "this folder?",
                    written.path.string()));
  }
  Record record;
  record.file = written.path.lexically_relative(folder).generic_string();
  record.size = written.size;
  record.digest = written.digest;
  record.mtime_ns = mtime_of(status);
  return record;
}

std::vector<std::string> unlisted_files(const fs::path& folder, const Manifest& manifest) {
  const std::map<std::string, Record> records = manifest.records();
  std::vector<std::string> files;
  std::error_code code;
  for (fs::recursive_directory_iterator entry(folder, code), end; !code && entry != end;
       entry.increment(code)) {
    if (entry->is_directory(code)) continue;
    const std::string file = entry->path().lexically_relative(folder).generic_string();
    if (file == layout::manifest || file == layout::stats || file == layout::lock) continue;
    if (!records.contains(file) && !layout::is_frame_samples(file)) files.push_back(file);
  }
  if (code) fail_to_read(folder, code.value());
  std::sort(files.begin(), files.end());
  return files;
}

void remove_frame_samples(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code code;
  for (fs::directory_iterator entry(folder / "render", code), end; !code && entry != end;
       entry.increment(code))
    if (layout::is_frame_samples(entry->path().string())) files.push_back(entry->path());
  for (const fs::path& file : files) {
    fs::remove(file, code);
    if (code) {
      throw Error(
          fmt::format("{}: cannot be removed: {}", file.string(), system_reason(code.value())));
    }
  }
}

void remove_leftovers(const fs::path& folder) {
  int removed = 0;
  for (const std::string_view part : layout::folders)
    removed += remove_stale_temporaries(folder / part);
  if (removed > 0) log_verbose("driver", fmt::format("removed {} half-written files", removed));
}

}  // namespace drench
