#pragma once
// Pictures on surfaces: PNG, JPEG or EXR, held as linear ACEScg.

#include <filesystem>
#include <vector>

#include "render/vector.h"

namespace drench {

struct Texture {
  int width = 0, height = 0;
  std::vector<V3f> texel;  // row-major from the top left

  /// Bilinear and repeating; v runs upwards from the picture's bottom.
  V3f at(const V2f& uv) const;
};

/// 8-bit pictures are taken as sRGB; EXRs say their own primaries (Rec. 709 if they do not).
/// @throws Error naming the file and the reason if it cannot be read.
Texture read_texture(const std::filesystem::path& path);

/// Normals of tangent space, not unit: components -1..1 of a picture's 0..1, as they stand in the
/// file, without its colour space. A byte of 128 is 0.
/// @throws Error as above.
Texture read_normal_map(const std::filesystem::path& path);

}  // namespace drench
