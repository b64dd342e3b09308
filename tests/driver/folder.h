#pragma once
// A temporary folder that goes away with the test.

#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace drench::test {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    // Memory where there is such a folder: thousands of fsyncs of small files otherwise take
    // minutes.
    const std::filesystem::path memory = "/dev/shm";
    const bool usable = ::access(memory.c_str(), W_OK) == 0;
    const std::filesystem::path parent = usable ? memory : std::filesystem::temp_directory_path();
    std::string name = (parent / "drench-test-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline void put_text(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

/// Flips one bit in the middle and puts the modification time back: damage that only bytes show.
inline void flip_bit_quietly(const std::filesystem::path& file) {
  const auto time = std::filesystem::last_write_time(file);
  std::string bytes = text_of(file);
  ASSERT_FALSE(bytes.empty());
  bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 0x10);
  put_text(file, bytes);
  std::filesystem::last_write_time(file, time);
}

}  // namespace drench::test
