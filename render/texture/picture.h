#pragma once
// Pictures from outside as their files hold them: OpenEXR, Radiance HDR, PNG, JPEG and TIFF, told
// apart by their first bytes.

#include <OpenEXR/ImfChromaticities.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace drench::render {

/// Colours and skies are light. Data (normals) are numbers: what a file says of colours is not for
/// them.
enum class PictureUse { colour, sky, data };

/// What pictures may take together, asked before memory is taken.
class PictureMemory {
 public:
  PictureMemory() = default;  // as much as there is
  explicit PictureMemory(uint64_t most_bytes) : most_(most_bytes) {}
  /// @param gib  0: as much as there is
  static PictureMemory within(double gib) {
    return gib > 0 ? PictureMemory(uint64_t(gib * double(1 << 30))) : PictureMemory();
  }

  /// @param what  of the picture, for the message: "16384 x 16384 pixels of 3 x 8 bits"
  /// @throws Error naming the picture, its size and what is left.
  void take(const std::filesystem::path& path, const std::string& what, uint64_t bytes);
  void give_back(uint64_t bytes) { taken_ -= std::min(bytes, taken_); }
  uint64_t taken() const { return taken_; }  // bytes
  static PictureMemory& without_limit();

 private:
  uint64_t most_ = ~uint64_t(0), taken_ = 0;
};

/// How a picture's codes, 0 to 1 of what its samples hold, stand for light.
struct ColourCode {
  using Curve = std::function<float(float)>;
  std::array<Curve, 3> to_linear;  // of R, G and B; not for samples that are floats
  Imf::Chromaticities primaries;

  static ColourCode srgb();
  static ColourCode linear(const Imf::Chromaticities& primaries);
};

struct Raster {
  enum class Sample { u8, u16, f16, f32 };

  int width = 0, height = 0;
  Sample sample = Sample::u8;
  int colours = 3;               // 1: grey, or an index of `palette`; 3: R, G, B
  int stride = 3;                // samples a pixel; those after the colours are not used
  std::vector<std::byte> bytes;  // row-major from the top left
  std::vector<std::array<uint8_t, 3>> palette;  // 256 entries, or none
  ColourCode code;

  size_t pixels() const { return size_t(width) * size_t(height); }
};

size_t bytes_of(Raster::Sample sample);

/// What was left out or guessed is a warning; docs/guide/materials_and_light.md has the rules.
/// @param memory  what the file and the samples take is taken from it, what the file took is given
///                back.
/// @throws Error naming the file, what it holds and what to do, if it is no picture that can be
///         read, is damaged or cut off, has a pixel that is not finite, or is too large.
Raster read_picture(const std::filesystem::path& path, PictureUse use, PictureMemory& memory);

}  // namespace drench::render
