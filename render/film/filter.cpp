#include "render/film/filter.h"

namespace drench::render {

PixelFilter::PixelFilter() {
  constexpr int steps = 4096;
  std::array<double, steps + 1> cdf{};
  for (int k = 0; k < steps; ++k) {
    const double t = 2 * std::numbers::pi * (k + 0.5) / steps;
    cdf[k + 1] = cdf[k] + 0.35875 - 0.48829 * std::cos(t) + 0.14128 * std::cos(2 * t) -
                 0.01168 * std::cos(3 * t);
  }
  int k = 0;
  for (int q = 0; q <= table_size; ++q) {
    const double target = cdf[steps] * q / table_size;
    while (k + 1 < steps && cdf[k + 1] < target) ++k;
    const double within = (target - cdf[k]) / (cdf[k + 1] - cdf[k]);
    inverse_[q] = float(((k + std::clamp(within, 0., 1.)) / steps - 0.5) * width);
  }
}

}  // namespace drench::render
