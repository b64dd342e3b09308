#pragma once
// Files of a test: their text, and damage to it.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/temporary_folder.h"

namespace drench::test {

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
