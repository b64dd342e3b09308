#include "pipeline/driver/output_folder.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <optional>
#include <thread>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/descriptor.h"
#include "pipeline/contract/log.h"
#include "pipeline/driver/layout.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

int64_t mtime_of(const struct stat& status) {
  return int64_t(status.st_mtim.tv_sec) * 1'000'000'000 + status.st_mtim.tv_nsec;
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

void remove_leftovers(const fs::path& folder) {
  int removed = 0;
  for (const std::string_view part : layout::folders)
    removed += remove_stale_temporaries(folder / part);
  if (removed > 0) log_verbose("driver", fmt::format("removed {} half-written files", removed));
}

}  // namespace

FolderLock::FolderLock(const fs::path& folder, LockKind kind)
    : file_((make_folder(folder), folder / layout::lock)) {
  // Others that share it hold it alone for a moment at their start, and whoever has just taken it
  // has yet to write its name.
  const int tries = kind == LockKind::shared ? 60 : 1;
  for (int k = 0;; ++k) {
    if (file_.try_take(LockKind::exclusive)) {
      remove_leftovers(folder);
      if (kind == LockKind::exclusive) return;
    }
    // The kernel lets go of one kind before it gives the other: somebody may come in between.
    if (kind == LockKind::shared && file_.try_take(kind)) return;
    if (k == tries) {
      throw Error(
          fmt::format("{}: {} is working in this folder; wait until it has ended, or give "
                      "another --out",
                      folder.string(), file_.holder()));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

SimulationLock::SimulationLock(const fs::path& folder) : file_(folder / layout::simulation_lock) {
  for (bool said = false; !file_.try_take(LockKind::exclusive); said = true) {
    if (!said) log_info("driver", fmt::format("waits for {}, which simulates", file_.holder()));
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
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
  const Descriptor file(path, O_RDONLY | O_NONBLOCK | O_NOFOLLOW);
  if (!file.is_open() && says_nothing_of_the_file(errno)) fail_to_read(path, errno);
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
    if (std::find(layout::own.begin(), layout::own.end(), file) != layout::own.end()) continue;
    if (*fs::path(file).begin() == layout::farm) continue;
    if (!records.contains(file) && !layout::is_in_work(file)) files.push_back(file);
  }
  if (code) fail_to_read(folder, code.value());
  std::sort(files.begin(), files.end());
  return files;
}

void remove_frames_in_work(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code code;
  for (fs::directory_iterator entry(folder / "render", code), end; !code && entry != end;
       entry.increment(code))
    if (layout::is_in_work(entry->path().string())) files.push_back(entry->path());
  for (const fs::path& file : files) {
    fs::remove(file, code);
    if (code) {
      throw Error(
          fmt::format("{}: cannot be removed: {}", file.string(), system_reason(code.value())));
    }
  }
}

}  // namespace drench
