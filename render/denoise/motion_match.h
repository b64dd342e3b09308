#pragma once
// Which pixel of another frame shows what a pixel of this one shows, by the motion of both.

#include <cstdint>
#include <vector>

#include "render/film/noisy_picture.h"

namespace drench::render {

/// By pixel of one frame.
struct PixelMatch {
  std::vector<int32_t> pixel;  // of the other frame: the nearest to where the motion leads
  NoisyPicture::Plane same;    // 1; 0: there it is covered, out of the picture or something else
};

enum class Side { before, after };

/// From a frame to the one before it or after it. What a pixel shows is there, too, if the other
/// pixel's own motion leads back, and if their guides are alike as far as noise lets them be.
PixelMatch match_pixels(const NoisyPicture& from, const NoisyPicture& to, Side side);

/// To a frame farther away, by one in between. @param first  to that one, @param next  from it
PixelMatch chained(const PixelMatch& first, const PixelMatch& next);

}  // namespace drench::render
