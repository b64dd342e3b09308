// The drench program with a fault in its system calls, for tests: kills it at, or fails, the n-th
// call.
//
// DRENCH_FAULT=kill-before:rename:7   kill -9 before the 7th rename
// DRENCH_FAULT=kill-after:fsync:3     kill -9 after the 3rd fsync
// DRENCH_FAULT=fail:write:12          the 12th write and all after it fail: the disk is full
// DRENCH_FAULT=count:FILE             writes the number of calls of each kind to FILE at the end
//
// The calls are interposed: the program's own, and those that libstdc++ makes for OpenVDB and
// OpenEXR. Writes to standard output and error are left alone.

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

#include "pipeline/driver/command_line.h"

#define INTERPOSED extern "C" __attribute__((visibility("default")))

namespace {

enum Call { call_write, call_fsync, call_fdatasync, call_rename, call_unlink, calls };
constexpr const char* names[calls] = {"write", "fsync", "fdatasync", "rename", "unlink"};
std::atomic<int> counts[calls];

struct Fault {
  enum { none, kill_before, kill_after, fail } what = none;
  int call = -1, at = 0;

  Fault() {
    const char* text = std::getenv("DRENCH_FAULT");
    char kind[16]{}, name[16]{};
    if (!text || std::sscanf(text, "%15[^:]:%15[^:]:%d", kind, name, &at) != 3) return;
    for (int k = 0; k < calls; ++k) {
      if (std::strcmp(names[k], name) == 0) call = k;
    }
    what = std::strcmp(kind, "kill-before") == 0  ? kill_before
           : std::strcmp(kind, "kill-after") == 0 ? kill_after
                                                  : fail;
  }
};
const Fault fault;

void die() {
  ::kill(::getpid(), SIGKILL);
  for (;;) ::pause();
}

template <class Real>
auto interposed(Call call, Real real) -> decltype(real()) {
  const int count = ++counts[call];
  const bool here = fault.call == call && count == fault.at;
  if (here && fault.what == Fault::kill_before) die();
  if (fault.what == Fault::fail && fault.call == call && count >= fault.at) {
    errno = ENOSPC;
    return -1;
  }
  const auto result = real();
  if (here && fault.what == Fault::kill_after) die();
  return result;
}

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

void write_counts(const char* file) {
  if (std::FILE* out = std::fopen(file, "w")) {
    for (int k = 0; k < calls; ++k) std::fprintf(out, "%s %d\n", names[k], counts[k].load());
    std::fclose(out);
  }
}

}  // namespace

INTERPOSED ssize_t write(int descriptor, const void* data, size_t size) {
  static const auto real = next<ssize_t(int, const void*, size_t)>("write");
  if (descriptor <= STDERR_FILENO) return real(descriptor, data, size);
  return interposed(call_write, [&] { return real(descriptor, data, size); });
}

INTERPOSED ssize_t writev(int descriptor, const iovec* parts, int count) {
  static const auto real = next<ssize_t(int, const iovec*, int)>("writev");
  if (descriptor <= STDERR_FILENO) return real(descriptor, parts, count);
  return interposed(call_write, [&] { return real(descriptor, parts, count); });
}

INTERPOSED int fsync(int descriptor) {
  static const auto real = next<int(int)>("fsync");
  return interposed(call_fsync, [&] { return real(descriptor); });
}

INTERPOSED int fdatasync(int descriptor) {
  static const auto real = next<int(int)>("fdatasync");
  return interposed(call_fdatasync, [&] { return real(descriptor); });
}

INTERPOSED int rename(const char* from, const char* to) noexcept {
  static const auto real = next<int(const char*, const char*)>("rename");
  return interposed(call_rename, [&] { return real(from, to); });
}

INTERPOSED int unlink(const char* name) noexcept {
  static const auto real = next<int(const char*)>("unlink");
  return interposed(call_unlink, [&] { return real(name); });
}

int main(int argc, char** argv) {
  const int code = drench::drench_program(argc, argv);
  const char* text = std::getenv("DRENCH_FAULT");
  if (text && std::strncmp(text, "count:", 6) == 0) write_counts(text + 6);
  return code;
}
