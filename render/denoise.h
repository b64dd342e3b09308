#pragma once
// Takes the noise of a rendered picture away, guided by what is known without noise or with less:
// albedo, normal and distance.

#include <vector>

#include "render/pixel_sum.h"

namespace drench {

/// A picture as two independent halves of its samples. Planes are row-major from the top left,
/// width x height each.
struct NoisyPicture {
  using Plane = std::vector<float>;

  int width = 0, height = 0;
  Plane half[2][3];                     // colours as each half of the samples has them
  Plane variance[3];                    // of a half's mean
  std::vector<Plane> feature;           // guides, about 1 in size
  std::vector<Plane> feature_variance;  // of their means
};

/// Halves and variances of a picture; its size and guides are still to be given.
NoisyPicture noisy_picture(const std::vector<PixelSum>& pixels);

/// First-order regression on the features, in a window of 15 x 15 pixels around each, with weights
/// by which patches look alike in the other half: Bitterli et al. 2016, "Nonlinearly Weighted
/// First-order Regression for Denoising Monte Carlo Renderings", equations 3 and 8; the distance of
/// patches is that of Rousselle et al. 2012, equation 4. One bandwidth, and features that are noisy
/// weigh less (ridge) in place of being filtered first. A lone pixel that far outshines all around
/// it, by a light that few of its samples found, is brought down to them first: spread over its
/// window it would be a white square. The same bits for any thread count.
/// @return the three colours
std::vector<NoisyPicture::Plane> denoise(NoisyPicture picture);

}  // namespace drench
