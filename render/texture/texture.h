#pragma once
// Pictures on surfaces, held as their files have them and decoded where they are looked up.

#include <filesystem>
#include <vector>

#include "render/color/color.h"
#include "render/texture/picture.h"
#include "render/vector.h"

namespace drench::render {

class Texture {
 public:
  /// colour: linear ACEScg. direction: -1..1 of the codes 0..1, where half the codes (128 of 8
  /// bits, 32768 of 16) are 0.
  enum class Values { colour, direction };

  Texture() = default;
  Texture(Raster picture, Values values);

  int width() const { return picture_.width; }
  int height() const { return picture_.height; }
  size_t texels() const { return picture_.pixels(); }
  /// Row-major from the top left.
  V3f texel(size_t index) const;
  /// Bilinear and repeating; v runs upwards from the picture's bottom.
  V3f at(const V2f& uv) const;

 private:
  using Column = std::array<double, 4>;  // one of a matrix; as wide as a register

  V3f converted(float r, float g, float b) const;

  Raster picture_;
  std::array<std::vector<float>, 3> value_;  // by code, of all samples but f32
  std::vector<V3f> entry_;                   // by code, of u8 of one channel
  std::array<Column, 3> column_{};           // of ColorMatrix
  bool converts_ = false, direction_ = false;
};

/// A picture's colours as light; what is integer is sRGB and what is float linear Rec. 709, unless
/// the file says otherwise. @throws Error as read_picture.
Texture read_texture(const std::filesystem::path& path,
                     PictureMemory& memory = PictureMemory::without_limit());

/// Normals of tangent space, not unit, as they stand in the file, without its colour space.
/// @throws Error as read_picture.
Texture read_normal_map(const std::filesystem::path& path,
                        PictureMemory& memory = PictureMemory::without_limit());

/// A picture of a sky, a warning if it holds no light above 1.
/// @throws Error as read_picture.
Texture read_sky(const std::filesystem::path& path,
                 PictureMemory& memory = PictureMemory::without_limit());

}  // namespace drench::render
