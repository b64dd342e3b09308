#pragma once
// A picture with its noise, as a denoiser takes it.

#include <vector>

#include "render/film/pixel_sum.h"

namespace drench::render {

/// A picture as two independent halves of its samples. Planes are row-major from the top left,
/// width x height each.
struct NoisyPicture {
  using Plane = std::vector<float>;

  int width = 0, height = 0;
  Plane half[2][3];                     // colours as each half of the samples has them
  Plane variance[3];                    // of a half's mean
  std::vector<Plane> feature;           // guides, about 1 in size
  std::vector<Plane> feature_variance;  // of their means
  std::vector<float> feature_unit;      // what 1 is, of each; empty: as in all other frames
  /// Pixels to the right and down to where what is seen is in the frame before and in the one
  /// after; needed with neighbours only.
  Plane motion[2][2];

  float unit(size_t f) const { return feature_unit.empty() ? 1.f : feature_unit[f]; }
};

/// Halves and variances of a picture; its size and guides are still to be given.
NoisyPicture noisy_picture(const std::vector<PixelSum>& pixels);

}  // namespace drench::render
