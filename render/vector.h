#pragma once
// The few vector operations of the renderer, as free functions on Imath's V3f.

#include <Imath/ImathVec.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace drench::render {

using Imath::V2f;
using Imath::V3f;

inline constexpr float pi = std::numbers::pi_v<float>;
/// Largest float below 1: random numbers stay in [0, 1).
inline constexpr float one_minus_epsilon = 0x1.fffffep-1f;

inline float dot(const V3f& a, const V3f& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline V3f cross(const V3f& a, const V3f& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline V3f normalized(const V3f& a) { return a * (1.f / std::sqrt(dot(a, a))); }
inline V3f absolute(const V3f& a) { return {std::abs(a.x), std::abs(a.y), std::abs(a.z)}; }
inline float largest(const V3f& a) { return std::max(a.x, std::max(a.y, a.z)); }
inline bool finite(const V3f& a) {
  return a.x * 0 + a.y * 0 + a.z * 0 == 0;  // else one of them is NaN
}
inline bool is_black(const V3f& a) {
  const auto bits = [](float f) { return std::bit_cast<uint32_t>(f); };
  return (bits(a.x) | bits(a.y) | bits(a.z)) << 1 == 0;  // all but signs
}

/// An orthonormal basis around a unit vector. Duff et al. 2017, "Building an Orthonormal Basis,
/// Revisited".
struct Basis {
  V3f tangent, bitangent, normal;

  explicit Basis(const V3f& n) : normal(n) {
    const float sign = std::copysign(1.f, n.z);
    const float a = -1.f / (sign + n.z);
    const float b = n.x * n.y * a;
    tangent = {1.f + sign * n.x * n.x * a, sign * b, -sign * n.x};
    bitangent = {b, sign + n.y * n.y * a, -n.y};
  }
  V3f world(const V3f& local) const {
    return tangent * local.x + bitangent * local.y + normal * local.z;
  }
};

}  // namespace drench::render
