#pragma once
// What the fuzz targets of file readers share. Each is one function that libFuzzer calls with
// bytes; whatever these are, a reader returns or throws Error, within its limits of memory and
// time.

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"

namespace drench::fuzz {

/// A file in memory that holds the bytes; the same name every time.
class FileUnderTest {
 public:
  explicit FileUnderTest(const std::string& extension)
      : path_("/dev/shm/drench-fuzz-" + std::to_string(getpid()) + extension) {
    set_log_level(LogLevel::quiet);
  }
  ~FileUnderTest() { std::filesystem::remove(path_); }
  const std::filesystem::path& holding(const uint8_t* bytes, size_t size) const {
    std::ofstream(path_, std::ios::binary | std::ios::trunc)
        .write(reinterpret_cast<const char*>(bytes), std::streamsize(size));
    return path_;
  }

 private:
  std::filesystem::path path_;
};

/// @return 0, for libFuzzer.
template <class Read>
int expect_errors_only(const Read& read) {
  try {
    read();
  } catch (const Error&) {
  }
  return 0;
}

}  // namespace drench::fuzz
