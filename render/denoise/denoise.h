#pragma once
// Takes the noise of a rendered picture away, guided by what is known without noise or with less:
// albedo, normal and distance; and by the frames before and after it, where they show the same.

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

/// Frames of the same size before a frame and after it, the nearest first.
struct Neighbours {
  std::vector<NoisyPicture> before, after;
};

/// Halves and variances of a picture; its size and guides are still to be given.
NoisyPicture noisy_picture(const std::vector<PixelSum>& pixels);

/// First-order regression on the features, in a window of 15 x 15 pixels around each, with weights
/// by which patches look alike in the other half: Bitterli et al. 2016, "Nonlinearly Weighted
/// First-order Regression for Denoising Monte Carlo Renderings", equations 3 and 8; the distance of
/// patches is that of Rousselle et al. 2012, equation 4. One bandwidth. Features are smoothed
/// first, by a mean over what their own variance cannot tell apart: a sample of water mirrors or
/// refracts, so that their noise is that of the picture. What noise is left weighs them less
/// (ridge). Fireflies are brought down first, and glints put back where they were (fireflies.h).
/// The same bits for any thread count.
///
/// Pixels of neighbours in time join the window, led there by their motion, in a smaller window of
/// 9 x 9 since the same position comes first; a pixel that shows something else there counts
/// nothing. What does not move as its surface does, a refraction say, is told by its patches.
/// Neighbours are taken as they were rendered, so that a frame depends on those alone.
/// @return the three colours
std::vector<NoisyPicture::Plane> denoise(NoisyPicture picture, Neighbours neighbours = {});

}  // namespace drench::render
