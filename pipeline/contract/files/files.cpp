#include "pipeline/contract/files/files.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <mutex>
#include <new>
#include <optional>
#include <regex>
#include <set>
#include <system_error>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/descriptor.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail_to_write(const fs::path& path, int error_number) {
  throw Error(fmt::format("{}: cannot be written: {}", path.string(), system_reason(error_number)));
}

[[noreturn]] void fail_to_read(const fs::path& path, int error_number) {
  throw Error(fmt::format("{}: cannot be read: {}", path.string(), system_reason(error_number)));
}

/// The temporaries this process is writing now: not stale although the process lives.
struct LiveTemporaries {
  std::mutex mutex;
  std::set<fs::path> paths;
};
LiveTemporaries& live_temporaries() {
  static LiveTemporaries live;
  return live;
}

/// Names this machine: two may have processes of one number at work in a folder.
const std::string& host_digits() {
  static const std::string digits = [] {
    const std::string name = host_name();
    return hash_bytes(name.data(), name.size()).hex().substr(0, 8);
  }();
  return digits;
}

/// A name beside `path` that no other process or thread uses; removed unless kept. The extension is
/// kept because some writers choose their format by it.
class Temporary {
 public:
  explicit Temporary(const fs::path& path) {
    static std::atomic<unsigned> count{0};
    name_ =
        path.parent_path() / fmt::format(".{}.{}.{}-{}.tmp{}", path.stem().string(), host_digits(),
                                         ::getpid(), count++, path.extension().string());
    ::unlink(name_.c_str());
    const std::scoped_lock lock(live_temporaries().mutex);
    live_temporaries().paths.insert(key(name_));
  }
  ~Temporary() {
    ::unlink(name_.c_str());
    const std::scoped_lock lock(live_temporaries().mutex);
    live_temporaries().paths.erase(key(name_));
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  const fs::path& name() const { return name_; }

  /// One spelling for one file, whatever folder it was reached from.
  static fs::path key(const fs::path& name) { return fs::absolute(name).lexically_normal(); }

 private:
  fs::path name_;
};

struct Owner {
  std::string host;  // host_digits() of its machine
  pid_t process = 0;
};

/// Who wrote `.STEM.HOST.PID-COUNT.tmp.EXT`; nothing if the name is not of that form.
std::optional<Owner> owner_of_temporary(const std::string& name) {
  static const std::regex form(
      R"(\.[\s\S]*\.([0-9a-f]{8})\.([1-9][0-9]{0,8})-[0-9]+\.tmp(\.[\s\S]*)?)");
  std::smatch found;
  if (!std::regex_match(name, found, form)) return {};
  return Owner{found[1], pid_t(std::stol(found[2]))};
}

/// Whether a process may be writing it now. One on another machine is not: whoever clears a folder
/// holds its lock.
bool is_live(const Owner& owner, const fs::path& temporary) {
  if (owner.host != host_digits()) return false;
  if (owner.process != ::getpid()) return ::kill(owner.process, 0) == 0 || errno != ESRCH;
  const std::scoped_lock lock(live_temporaries().mutex);
  return live_temporaries().paths.contains(Temporary::key(temporary));
}

void ignore_file_size_signal() {
  // A file size limit must come back as EFBIG, not end the process half-way.
  static const auto previous = ::signal(SIGXFSZ, SIG_IGN);
  (void)previous;
}

void make_parent(const fs::path& path) {
  if (path.filename().empty()) throw Error(fmt::format("'{}' names no file", path.string()));
  std::error_code code;
  if (fs::is_directory(path, code)) {
    throw Error(
        fmt::format("{}: a folder stands where the file should be written; move it away or "
                    "choose another output folder",
                    path.string()));
  }
  if (path.parent_path().empty()) return;
  fs::create_directories(path.parent_path(), code);
  if (code) fail_to_write(path.parent_path(), code.value());
}

/// Brings the file to the disk, reads it again for its digest and gives it its name.
WrittenFile commit(const Temporary& temporary, const fs::path& path,
                   const std::optional<Digest>& expected) {
  WrittenFile written{.path = path, .size = 0, .digest = {}};
  {
    Descriptor file(temporary.name(), O_RDONLY | O_NOFOLLOW);
    if (!file.is_open()) fail_to_write(path, errno);
    struct stat status {};
    if (::fstat(file.value(), &status) != 0) fail_to_write(path, errno);
    if (!S_ISREG(status.st_mode)) fail_to_write(path, EINVAL);
    if (::fsync(file.value()) != 0) fail_to_write(path, errno);
    written.size = uint64_t(status.st_size);
    written.digest = hash_file(temporary.name());
    if (expected && written.digest != *expected) {
      throw Error(
          fmt::format("{}: what is on the disk is not what was written; check the disk and "
                      "run again",
                      path.string()));
    }
    if (const int reason = file.close()) fail_to_write(path, reason);
  }
  if (::rename(temporary.name().c_str(), path.c_str()) != 0) fail_to_write(path, errno);
  const fs::path folder = path.parent_path().empty() ? fs::path(".") : path.parent_path();
  const Descriptor parent(folder, O_RDONLY | O_DIRECTORY);
  // EINVAL: the file system has no sync for folders (some network and FUSE systems).
  if (parent.is_open() && ::fsync(parent.value()) != 0 && errno != EINVAL) {
    fail_to_write(folder, errno);
  }
  return written;
}

void write_all(const fs::path& temporary, const fs::path& path, std::string_view bytes) {
  Descriptor file(temporary, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW, 0666);
  if (!file.is_open()) fail_to_write(path, errno);
  while (!bytes.empty()) {
    const ssize_t done = ::write(file.value(), bytes.data(), bytes.size());
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) fail_to_write(path, done < 0 ? errno : ENOSPC);
    bytes.remove_prefix(size_t(done));
  }
  if (const int reason = file.close()) fail_to_write(path, reason);
}

template <class Buffer>
Buffer read_whole(const fs::path& path, uint64_t max_bytes) {
  // O_NONBLOCK: opening a FIFO must not wait for a writer.
  const Descriptor file(path, O_RDONLY | O_NONBLOCK);
  if (!file.is_open()) fail_to_read(path, errno);
  struct stat status {};
  if (::fstat(file.value(), &status) != 0) fail_to_read(path, errno);
  if (S_ISDIR(status.st_mode)) fail_to_read(path, EISDIR);
  if (!S_ISREG(status.st_mode)) {
    throw Error(fmt::format("{}: is not a regular file; give a file on disk", path.string()));
  }
  const auto size = uint64_t(status.st_size);
  if (size > max_bytes) {
    throw Error(fmt::format("{}: has {} bytes; at most {} are read here. Is it the file you meant?",
                            path.string(), size, max_bytes));
  }
  Buffer buffer(size, {});
  uint64_t done = 0;
  while (done < size) {
    const ssize_t got = ::read(file.value(), buffer.data() + done, size - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail_to_read(path, errno);
    if (got == 0) {
      throw Error(
          fmt::format("{}: became shorter while it was read; run again when nothing else "
                      "writes it",
                      path.string()));
    }
    done += uint64_t(got);
  }
  return buffer;
}

}  // namespace

std::string system_reason(int error_number) {
  const char* advice = nullptr;
  switch (error_number) {
    case ENOSPC:
      advice = "the disk is full; free space or choose another output folder";
      break;
    case EDQUOT:
      advice = "your disk quota is used up; free space or choose another folder";
      break;
    case EFBIG:
      advice = "the file size limit is reached; raise it (ulimit -f)";
      break;
    case EACCES:
    case EPERM:
      advice = "permission is missing; change it or choose another folder";
      break;
    case EROFS:
      advice = "the file system is read-only; choose another folder";
      break;
    case ENOTDIR:
      advice = "a file stands where a folder is needed; move it or choose another";
      break;
    case EISDIR:
      advice = "it is a folder; name a file";
      break;
    case ENOENT:
      advice = "it does not exist; check the path";
      break;
    case ENAMETOOLONG:
      advice = "shorten the name";
      break;
    case EMFILE:
      advice = "raise the limit of open files (ulimit -n)";
      break;
    case EIO:
      advice = "the disk or network failed; check it and run again";
      break;
    default:
      break;
  }
  const std::string reason = std::system_category().message(error_number);
  return advice ? fmt::format("{}: {}", reason, advice) : reason;
}

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown host";
}

WrittenFile write_file_whole(const fs::path& path,
                             const std::function<void(const fs::path& temporary)>& write) {
  ignore_file_size_signal();
  make_parent(path);
  const Temporary temporary(path);
  try {
    write(temporary.name());
  } catch (const Error&) {
    throw;
  } catch (const Stopped&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::logic_error&) {
    throw;
  } catch (const std::exception& problem) {  // a library's own I/O error: the user's to fix
    throw Error(fmt::format("{}: cannot be written: {}", path.string(), problem.what()));
  }
  return commit(temporary, path, {});
}

WrittenFile write_file_whole(const fs::path& path, std::string_view bytes) {
  ignore_file_size_signal();
  make_parent(path);
  const Temporary temporary(path);
  write_all(temporary.name(), path, bytes);
  return commit(temporary, path, hash_bytes(bytes.data(), bytes.size()));
}

std::vector<std::byte> read_file(const fs::path& path, uint64_t max_bytes) {
  return read_whole<std::vector<std::byte>>(path, max_bytes);
}

std::string read_text(const fs::path& path, uint64_t max_bytes) {
  return read_whole<std::string>(path, max_bytes);
}

int remove_stale_temporaries(const fs::path& folder) {
  std::error_code code;
  if (!fs::exists(folder, code)) return 0;
  fs::directory_iterator entry(folder, code);
  int removed = 0;
  for (; !code && entry != fs::directory_iterator(); entry.increment(code)) {
    const std::optional<Owner> owner = owner_of_temporary(entry->path().filename().string());
    if (!owner || is_live(*owner, entry->path())) continue;
    if (::unlink(entry->path().c_str()) != 0 && errno != ENOENT) {
      fail_to_write(entry->path(), errno);
    }
    ++removed;
  }
  if (code) fail_to_read(folder, code.value());
  return removed;
}

}  // namespace drench
