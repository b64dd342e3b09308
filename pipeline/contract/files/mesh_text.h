#pragma once
// Text of mesh files as programs write it: byte order marks, UTF-16, decimal commas. Part of
// mesh_file.h.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace drench {

/// Without a byte order mark; UTF-16 becomes ASCII, in which '?' stands for what has none. Bytes
/// without such a mark stay as they are.
/// @throws Error if it is UTF-16 and ends within a character.
std::string plain_text(const std::filesystem::path& path, std::string text);

/// Reads numbers of one file, which has either decimal points or decimal commas.
class NumberReader {
 public:
  /// Rounded once, so that what was written in the fewest digits comes back equal; may be infinite
  /// or not a number. Nothing if it is no number, or has a comma in a file with points.
  std::optional<double> real(std::string_view word);
  std::optional<float> single(std::string_view word);
  uint64_t commas() const { return commas_; }
  /// Of the decimal commas there were.
  void warn(const std::filesystem::path& path) const;

 private:
  template <class T>
  std::optional<T> read(std::string_view word);
  uint64_t commas_ = 0;
  bool points_ = false;
};

}  // namespace drench
