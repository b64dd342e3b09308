#pragma once
// The pixel filter, applied by drawing sample positions from it (filter importance sampling), so
// that every sample counts for one pixel with weight one. Ernst, Stamminger, Greiner 2006.

#include <array>

#include "render/vector.h"

namespace drench::render {

/// Blackman-Harris window of 3 pixels.
class PixelFilter {
 public:
  static constexpr float width = 3;  // pixels

  PixelFilter();

  /// Offset from the pixel's centre in pixels, for u in [0, 1)^2.
  V2f offset(const V2f& u) const { return {inverse(u.x), inverse(u.y)}; }

 private:
  static constexpr int table_size = 1024;
  float inverse(float u) const {
    const float x = u * table_size;
    const int k = std::min(int(x), table_size - 1);
    return inverse_[k] + (inverse_[k + 1] - inverse_[k]) * (x - float(k));
  }
  std::array<float, table_size + 1> inverse_;  // quantiles of the window
};

}  // namespace drench::render
