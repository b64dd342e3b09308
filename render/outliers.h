#pragma once
// What far outshines its surroundings in a noisy picture: luck of a few samples, or glints.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "render/denoise.h"

namespace drench {

/// Calls with each pixel and the pixels within `reach` of it.
template <class Visit>
void for_each_window(int width, int height, int reach, const Visit& visit) {
  std::vector<size_t> window;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      window.clear();
      for (int v = std::max(y - reach, 0); v <= std::min(y + reach, height - 1); ++v)
        for (int u = std::max(x - reach, 0); u <= std::min(x + reach, width - 1); ++u)
          window.push_back(size_t(v) * size_t(width) + size_t(u));
      visit(size_t(y) * size_t(width) + size_t(x), window);
    }
}

/// Brings pixels that far outshine what is around them down to it: those whose brightness few of
/// their samples found, and glints, a lamp that water or glass shows in a few pixels. Spread over
/// its window either would be a white square.
/// @return what glints lost, the three colours: it belongs where it is
std::vector<NoisyPicture::Plane> tame_outliers(NoisyPicture& picture);

}  // namespace drench
