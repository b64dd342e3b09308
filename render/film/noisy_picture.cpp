#include "render/film/noisy_picture.h"

namespace drench::render {

NoisyPicture noisy_picture(const std::vector<PixelSum>& pixels) {
  NoisyPicture picture;
  for (const PixelSum& pixel : pixels)
    for (int c = 0; c < 3; ++c) {
      for (int h = 0; h < 2; ++h) picture.half[h][c].push_back(pixel.half(h, c));
      picture.variance[c].push_back(2 * pixel.variance(c));
    }
  return picture;
}

}  // namespace drench::render
