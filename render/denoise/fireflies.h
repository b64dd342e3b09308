#pragma once
// What far outshines its surroundings in a noisy picture: luck of a few samples, or glints.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "render/denoise/denoise.h"

namespace drench::render {

/// Calls with the pixels within `reach` of one.
template <class Visit>
void for_each_near(int width, int height, size_t pixel, int reach, const Visit& visit) {
  const int x = int(pixel % size_t(width)), y = int(pixel / size_t(width));
  for (int v = std::max(y - reach, 0); v <= std::min(y + reach, height - 1); ++v)
    for (int u = std::max(x - reach, 0); u <= std::min(x + reach, width - 1); ++u)
      visit(size_t(v) * size_t(width) + size_t(u));
}

/// Calls with each pixel and the pixels within `reach` of it.
template <class Visit>
void for_each_window(int width, int height, int reach, const Visit& visit) {
  std::vector<size_t> window;
  for (size_t p = 0; p < size_t(width) * size_t(height); ++p) {
    window.clear();
    for_each_near(width, height, p, reach, [&](size_t q) { window.push_back(q); });
    visit(p, window);
  }
}

/// Brings pixels that far outshine what is around them down to it: those whose brightness few of
/// their samples found, and glints, a lamp that water or glass shows in a few pixels. Spread over
/// its window either would be a white square.
/// @return what glints lost, the three colours: it belongs where it is, or around it where too few
///         samples of a pixel found it to tell its shape
std::vector<NoisyPicture::Plane> suppress_fireflies(NoisyPicture& picture);

}  // namespace drench::render
