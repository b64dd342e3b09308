#pragma once
// Warps of [0, 1)^2 to discs, hemispheres and cones, and the weight of multiple importance
// sampling.

#include "render/vector.h"

namespace drench {

/// Uniform on the unit disc. Shirley and Chiu 1997, the concentric map.
inline V2f sample_disc(const V2f& u) {
  const float a = 2 * u.x - 1, b = 2 * u.y - 1;
  if (a == 0 && b == 0) return {0, 0};
  const bool wide = std::abs(a) > std::abs(b);
  const float radius = wide ? a : b;
  const float angle = wide ? kPi / 4 * (b / a) : kPi / 2 - kPi / 4 * (a / b);
  return {radius * std::cos(angle), radius * std::sin(angle)};
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
  const float phi = 2 * kPi * u.y;
  return {sin * std::cos(phi), sin * std::sin(phi), 1 - h};
}

/// Power heuristic with exponent 2 (Veach 1997) for the strategy of density `a` against `b`.
inline float power_heuristic(float a, float b) {
  if (std::isinf(a)) return 1;
  const float ratio = b / a;
  return 1 / (1 + ratio * ratio);
}

}  // namespace drench
