#pragma once
// A file descriptor that closes itself, and not in programs that this one starts.

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

namespace drench {

class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags, mode_t mode = 0)
      : value_(::open(path.c_str(), flags | O_CLOEXEC, mode)) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int value() const { return value_; }
  bool is_open() const { return value_ >= 0; }
  /// Closes and returns errno: some file systems report a full disk only here.
  int close() {
    const int result = ::close(value_);
    value_ = -1;
    return result == 0 ? 0 : errno;
  }

 private:
  int value_;
};

}  // namespace drench
