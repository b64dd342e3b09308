#pragma once
// Takes the noise of a rendered picture away, guided by what is known without noise or with less:
// albedo, normal and distance; and by the frames before and after it, where they show the same.

#include <vector>

#include "render/film/noisy_picture.h"

namespace drench::render {

/// Frames of the same size before a frame and after it, the nearest first.
struct Neighbours {
  std::vector<NoisyPicture> before, after;
};

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
