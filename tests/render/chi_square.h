#pragma once
// Whether a sampler draws directions with the density it states: Pearson's chi-square over cells of
// the sphere, and the integral of the density.

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "render/bsdf/bsdf.h"

namespace drench::render::test {

struct ChiSquare {
  double p_value = 0;   // chance of a fit as bad as this for a true density
  double integral = 0;  // of the density over the sphere
  double drawn = 0;     // fraction of samples that were directions at all
};

/// Chance that chi-square with so many degrees of freedom exceeds x: Wilson and Hilferty 1931.
inline double chi_square_tail(double x, double degrees) {
  const double v = 2 / (9 * degrees);
  return std::erfc((std::cbrt(x / degrees) - (1 - v)) / std::sqrt(2 * v)) / 2;
}

/// @param draw     Scatter(random): a sample about the axis z
/// @param density  double(direction), per steradian
template <class Draw, class Density>
ChiSquare chi_square(uint32_t seed, const Draw& draw, const Density& density) {
  constexpr int rows = 32, columns = 24, inner = 40, samples = 200000;
  const double pi = std::numbers::pi;
  std::vector<double> expected(rows * columns, 0), seen(rows * columns, 0);
  ChiSquare out;
  for (int r = 0; r < rows * inner; ++r)
    for (int c = 0; c < columns * inner; ++c) {
      const double z = 1 - 2 * (r + 0.5) / (rows * inner);
      const double phi = 2 * pi * (c + 0.5) / (columns * inner), s = std::sqrt(1 - z * z);
      const V3f d(float(s * std::cos(phi)), float(s * std::sin(phi)), float(z));
      const double fraction = density(d) * 4 * pi / (rows * inner) / (columns * inner);
      expected[size_t(r / inner * columns + c / inner)] += fraction * samples;
      out.integral += fraction;
    }
  std::mt19937 random(seed);
  for (int k = 0; k < samples; ++k) {
    const Scatter s = draw(random);
    if (!(s.pdf > 0)) continue;
    out.drawn += 1. / samples;
    const double phi = std::atan2(s.direction.y, s.direction.x);
    const int row = std::min(int((1 - double(s.direction.z)) / 2 * rows), rows - 1);
    const int column = std::min(int((phi < 0 ? phi + 2 * pi : phi) / (2 * pi) * columns), 23);
    ++seen[size_t(row * columns + column)];
  }
  // Cells where fewer than 10 are expected count as one.
  double sum = 0, few_expected = 0, few_seen = 0, cells = 0;
  const auto add = [&](double want, double got) {
    sum += (got - want) * (got - want) / want;
    ++cells;
  };
  for (size_t k = 0; k < expected.size(); ++k)
    if (expected[k] < 10)
      few_expected += expected[k], few_seen += seen[k];
    else
      add(expected[k], seen[k]);
  if (few_expected > 1) add(few_expected, few_seen);
  const double lost = samples * (1 - out.integral);
  if (lost > 10) add(lost, samples * (1 - out.drawn));
  out.p_value = chi_square_tail(sum, std::max(cells - 1, 1.));
  return out;
}

}  // namespace drench::render::test
