// A fault in the system calls of a program, for tests: kills it at, or fails, the n-th call.
//
// DRENCH_FAULT=kill-before:rename:7     kill -9 before the 7th rename
// DRENCH_FAULT=kill-after:fsync:3       kill -9 after the 3rd fsync
// DRENCH_FAULT=fail:write:12            the 12th write and all after it fail: the disk is full
// DRENCH_FAULT=fail:close:1:.exr        the same, of the calls that go to files so named
// DRENCH_FAULT=short:write:1:.exr       the first such write puts down half; all after it fail
// DRENCH_FAULT=count:FILE               writes the number of calls of each kind to FILE at the end
//
// The calls are interposed: the program's own, and those that libstdc++ makes for OpenVDB. Writes
// to standard output and error are left alone. Linked into drench_faults it works on drench; the
// library drench_fault_library is loaded before ffmpeg, where only a fault with a name counts.

#include <dlfcn.h>
#include <signal.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#define INTERPOSED extern "C" __attribute__((visibility("default")))

namespace {

enum Call { call_write, call_fsync, call_fdatasync, call_rename, call_unlink, call_close, calls };
constexpr const char* names[calls] = {"write", "fsync", "fdatasync", "rename", "unlink", "close"};

struct Fault {
  enum { none, kill_before, kill_after, fail, cut_short } what = none;
  int call = -1, at = 0;
  std::string name;  // end of the names it applies to; empty: every file
  std::string counts;

  Fault() {
    const char* text = std::getenv("DRENCH_FAULT");
    if (text && std::strncmp(text, "count:", 6) == 0) counts = text + 6;
    char kind[16]{}, called[16]{}, file[64]{};
    if (!text || std::sscanf(text, "%15[^:]:%15[^:]:%d:%63s", kind, called, &at, file) < 3) return;
    for (int k = 0; k < calls; ++k) {
      if (std::strcmp(names[k], called) == 0) call = k;
    }
    name = file;
    what = std::strcmp(kind, "kill-before") == 0  ? kill_before
           : std::strcmp(kind, "kill-after") == 0 ? kill_after
           : std::strcmp(kind, "short") == 0      ? cut_short
                                                  : fail;
  }
};
/// Made at the first call, which other libraries' start-up may make; calls come after the end of
/// main, too.
const Fault& fault() {
  static const Fault* const made = new Fault;
  return *made;
}

/// Calls so far that the fault may apply to, and of every kind where they are to be counted.
struct Counts {
  std::atomic<int> seen{0};
  std::mutex mutex;
  std::map<std::string, int> of_kind;
};
Counts& counts() {
  static Counts* const made = new Counts;
  return *made;
}

void die() {
  ::kill(::getpid(), SIGKILL);
  for (;;) ::pause();
}

std::string path_of(int descriptor) {
  char link[32], path[4096];
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  const ssize_t size = ::readlink(link, path, sizeof path);
  return size > 0 ? std::string(path, size_t(size)) : "";
}

/// "exr", "manifest.jsonl": a kind of file.
std::string kind_of(std::string_view path) {
  const std::string_view file = path.substr(path.rfind('/') + 1);
  if (file.ends_with(".jsonl")) return std::string(file);
  const size_t dot = file.rfind('.');
  return std::string(dot == std::string_view::npos ? file : file.substr(dot + 1));
}

void count(Call call, const std::string& path) {
  Counts& all = counts();
  const std::scoped_lock lock(all.mutex);
  ++all.of_kind[names[call]];
  if (!path.empty()) ++all.of_kind[names[call] + ("." + kind_of(path))];
}

/// @param half  does half of the call; nothing where there is no such thing
template <class Path, class Real, class Half>
auto interposed(Call call, const Path& path, Real real, Half half) -> decltype(real()) {
  const Fault& now = fault();
  const int reason = errno;
  if (!now.counts.empty()) count(call, path());
  const bool applies = now.call == call && (now.name.empty() || path().ends_with(now.name));
  errno = reason;
  if (!applies) return real();
  const int at = ++counts().seen;
  if (at == now.at && now.what == Fault::kill_before) die();
  if (at == now.at && now.what == Fault::cut_short) return half();
  if (at >= now.at && (now.what == Fault::fail || now.what == Fault::cut_short)) {
    if (call == call_close) real();  // as close does: the descriptor is gone, the bytes may be too
    errno = ENOSPC;
    return -1;
  }
  const auto result = real();
  if (at == now.at && now.what == Fault::kill_after) die();
  return result;
}

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

/// At the end of the program.
struct CountsWriter {
  ~CountsWriter() {
    if (fault().counts.empty()) return;
    if (std::FILE* out = std::fopen(fault().counts.c_str(), "w")) {
      const std::scoped_lock lock(counts().mutex);
      for (const auto& [kind, times] : counts().of_kind)
        std::fprintf(out, "%s %d\n", kind.c_str(), times);
      std::fclose(out);
    }
  }
} counts_writer;

}  // namespace

INTERPOSED ssize_t write(int descriptor, const void* data, size_t size) {
  static const auto real = next<ssize_t(int, const void*, size_t)>("write");
  if (descriptor <= STDERR_FILENO) return real(descriptor, data, size);
  return interposed(
      call_write, [&] { return path_of(descriptor); }, [&] { return real(descriptor, data, size); },
      [&] { return real(descriptor, data, size / 2); });
}

INTERPOSED ssize_t writev(int descriptor, const iovec* parts, int count) {
  static const auto real = next<ssize_t(int, const iovec*, int)>("writev");
  if (descriptor <= STDERR_FILENO) return real(descriptor, parts, count);
  return interposed(
      call_write, [&] { return path_of(descriptor); },
      [&] { return real(descriptor, parts, count); }, [&] { return real(descriptor, parts, 1); });
}

INTERPOSED int fsync(int descriptor) {
  static const auto real = next<int(int)>("fsync");
  const auto sync = [&] { return real(descriptor); };
  return interposed(
      call_fsync, [&] { return path_of(descriptor); }, sync, sync);
}

INTERPOSED int fdatasync(int descriptor) {
  static const auto real = next<int(int)>("fdatasync");
  const auto sync = [&] { return real(descriptor); };
  return interposed(
      call_fdatasync, [&] { return path_of(descriptor); }, sync, sync);
}

INTERPOSED int close(int descriptor) {
  static const auto real = next<int(int)>("close");
  const auto close = [&] { return real(descriptor); };
  return interposed(
      call_close, [&] { return path_of(descriptor); }, close, close);
}

INTERPOSED int rename(const char* from, const char* to) noexcept {
  static const auto real = next<int(const char*, const char*)>("rename");
  const auto rename = [&] { return real(from, to); };
  return interposed(
      call_rename, [&] { return std::string(to); }, rename, rename);
}

INTERPOSED int unlink(const char* name) noexcept {
  static const auto real = next<int(const char*)>("unlink");
  const auto unlink = [&] { return real(name); };
  return interposed(
      call_unlink, [&] { return std::string(name); }, unlink, unlink);
}
