#pragma once
// Random numbers and surfaces for tests of single lobes.

#include <gtest/gtest.h>

#include <random>

#include "render/sampling.h"
#include "tests/render/chi_square.h"
#include "tests/render/support.h"

namespace drench::render::test {

inline const V3f straight_up(0, 0, 1);

struct Uniform {
  std::mt19937& random;
  float one() { return std::uniform_real_distribution<float>(0, one_minus_epsilon)(random); }
  V2f two() {
    const float x = one();
    return {x, one()};
  }
};

inline V3f leaving(float cos) { return {std::sqrt(1 - cos * cos), 0, cos}; }

/// Numbers for one sample.
struct Draw {
  V2f point;
  float side;
};

inline Draw numbers(Uniform u) {
  const V2f point = u.two();
  return {point, u.one()};
}

/// What uniform light of radiance 1 becomes: the mean weight over a lattice of samples, which errs
/// by 2e-3 at most. (Multiples of powers of the root of
/// x^4 = x + 1 are spread evenly in three dimensions: Roberts 2018.)
/// @param sample  Scatter(Draw)
template <class Sample>
double furnace_of(const Sample& sample) {
  constexpr int points = 1 << 18;
  constexpr double root = 1.2207440846057596;
  const auto part = [](double x) { return std::min(float(x - std::floor(x)), one_minus_epsilon); };
  double sum = 0;
  for (int k = 0; k < points; ++k) {
    const double x = k + 0.5;
    const Draw u{{part(x / root), part(x / root / root)}, part(x / root / root / root)};
    const Scatter s = sample(u);
    if (s.pdf > 0) sum += double(s.weight.x) / points;
  }
  return sum;
}

/// Each of n tests may fail by chance once in 100 runs of all of them. Sidak.
inline double least_p(int n) { return 1 - std::pow(0.99, 1. / n); }

/// A random surface with a bent normal, seen from either side.
struct Tilted {
  std::mt19937 random{11};
  Uniform uniform{random};
  V3f geometric, shading, outgoing;

  void next() {
    const auto direction = [&] { return sample_cone(uniform.two(), 2); };
    geometric = direction();
    shading = normalized(geometric + direction() * 0.5f);
    if (dot(shading, geometric) < 0.05f) shading = geometric;
    outgoing = direction();
  }
};

/// Value and density of what was sampled; a sample's own to the rounding of the facet's normal.
template <class Lobe>
int disagreements(const Lobe& lobe, const Scatter& s) {
  float pdf = 0;
  const V3f value = lobe.value(s.direction, pdf);
  const auto differ = [](float a, float b) { return !(std::abs(a - b) <= 2e-3f * std::abs(a)); };
  return differ(s.pdf, pdf) || differ(s.weight.x * s.pdf, value.x);
}

}  // namespace drench::render::test
