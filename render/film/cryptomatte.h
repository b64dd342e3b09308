#pragma once
// Cryptomatte: which objects a pixel shows, and how much of each. Friedman and Jones 2015, "Fully
// Automatic ID Mattes with Support for Motion Blur and Transparency"; file format of the
// specification, version 1.2.

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/film/checkpoint_archive.h"

namespace drench::render {

/// MurmurHash3, 32 bits, x86 variant, seed 0, of a name's UTF-8 bytes.
uint32_t murmur3(std::string_view name);

/// The number that stands for a name in a picture: its hash as a float that is normal and finite.
float cryptomatte_id(std::string_view name);

/// The header entries of one Cryptomatte layer: key and value.
/// @param names  all that can be in the picture
std::vector<std::pair<std::string, std::string>> cryptomatte_header(
    const std::string& layer, const std::vector<std::string>& names);

/// What one pixel shows, by counting camera samples.
class CryptomattePixel {
 public:
  static constexpr int ranks = 6;

  /// @param thing  index of a name, negative: nothing
  void add(int thing);
  void archive(CheckpointArchive& file);
  /// Pairs of id and coverage, the largest first, of equals the lower index; zeros after the last.
  std::array<float, 2 * ranks> ranked(const std::vector<float>& ids, int samples) const;

 private:
  std::vector<std::pair<int, int>> counts_;  // of a thing, in the order they were met
};

}  // namespace drench::render
