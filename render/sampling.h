#pragma once
// Warps of [0, 1)^2 to discs, hemispheres and cones, and the weight of multiple importance
// sampling.

#include "render/vector.h"

namespace drench::render {

/// Sine and cosine of an eighth of a turn at most, to 1e-7: Taylor's sums, without the cases of the
/// general functions.
inline V2f sin_cos_of_eighth(float x) {
  const float z = x * x;
  return {x * (1 + z * (-1.f / 6 + z * (1.f / 120 + z * (-1.f / 5040 + z * (1.f / 362880))))),
          1 + z * (-1.f / 2 + z * (1.f / 24 + z * (-1.f / 720 + z * (1.f / 40320))))};
}

/// Exchanges two numbers without a branch, for conditions that nothing foretells.
inline void swap_if(bool condition, float& a, float& b) {
  const uint32_t x = std::bit_cast<uint32_t>(a), y = std::bit_cast<uint32_t>(b);
  const uint32_t differing = (x ^ y) & -uint32_t(condition);
  a = std::bit_cast<float>(x ^ differing);
  b = std::bit_cast<float>(y ^ differing);
}

/// Uniform on the unit disc. Shirley and Chiu 1997, the concentric map.
inline V2f sample_disc(const V2f& u) {
  float radius = 2 * u.y - 1, other = 2 * u.x - 1;
  const bool wide = std::abs(other) > std::abs(radius);
  swap_if(wide, radius, other);
  if (radius == 0) return {0, 0};
  V2f d = sin_cos_of_eighth(pi / 4 * (other / radius)) * radius;
  swap_if(wide, d.x, d.y);
  return d;
}

/// Cosine-weighted about +z; density cos/pi. Malley's method.
inline V3f sample_cosine(const V2f& u) {
  const V2f d = sample_disc(u);
  return {d.x, d.y, std::sqrt(std::max(0.f, 1 - d.x * d.x - d.y * d.y))};
}

/// Uniform in the cone about +z whose rim has 1 - cos = `one_minus_cos`, which keeps its digits for
/// the sun; density 1 / (2 pi one_minus_cos).
inline V3f sample_cone(const V2f& u, float one_minus_cos) {
  const float h = u.x * one_minus_cos;
  const float sin = std::sqrt(std::max(0.f, h * (2 - h)));
  const float phi = 2 * pi * u.y;
  return {sin * std::cos(phi), sin * std::sin(phi), 1 - h};
}

/// Power heuristic with exponent 2 (Veach 1997) for the strategy of density `a` against `b`.
inline float power_heuristic(float a, float b) {
  if (std::isinf(a)) return 1;
  const float ratio = b / a;
  return 1 / (1 + ratio * ratio);
}

}  // namespace drench::render
