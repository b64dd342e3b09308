#pragma once
// A vector of three in one register, for code that is kept busy by vectors: what is done to all
// three numbers alike costs one instruction, and gives the same bits as one by one.

#include <immintrin.h>

#include "render/vector.h"

namespace drench::render {

struct Packed {
  __m128 lanes;  // the fourth means nothing

  explicit Packed(const __m128& all) : lanes(all) {}
  explicit Packed(const V3f& v) : lanes(_mm_setr_ps(v.x, v.y, v.z, 0)) {}
  /// Of one that lies in memory, and was not written there number by number just now.
  static Packed load(const V3f& v) {
    const __m128 xy = _mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(&v.x));
    return Packed(_mm_movelh_ps(xy, _mm_load_ss(&v.z)));
  }
  void store(V3f& v) const {
    _mm_storel_pi(reinterpret_cast<__m64*>(&v.x), lanes);
    _mm_store_ss(&v.z, _mm_movehl_ps(lanes, lanes));
  }
  V3f unpacked() const { return {lanes[0], lanes[1], lanes[2]}; }

  Packed operator+(const Packed& b) const { return Packed(_mm_add_ps(lanes, b.lanes)); }
  Packed operator-(const Packed& b) const { return Packed(_mm_sub_ps(lanes, b.lanes)); }
  Packed operator*(float s) const { return Packed(_mm_mul_ps(lanes, _mm_set1_ps(s))); }
};

inline float dot(const Packed& a, const Packed& b) {
  const __m128 p = _mm_mul_ps(a.lanes, b.lanes);
  return p[0] + p[1] + p[2];
}
inline Packed cross(const Packed& a, const Packed& b) {
  constexpr int yzx = _MM_SHUFFLE(3, 0, 2, 1);
  const __m128 zxy = _mm_sub_ps(_mm_mul_ps(a.lanes, _mm_shuffle_ps(b.lanes, b.lanes, yzx)),
                                _mm_mul_ps(_mm_shuffle_ps(a.lanes, a.lanes, yzx), b.lanes));
  return Packed(_mm_shuffle_ps(zxy, zxy, yzx));
}
inline Packed normalized(const Packed& a) { return a * (1.f / std::sqrt(dot(a, a))); }
inline Packed absolute(const Packed& a) {
  return Packed(_mm_andnot_ps(_mm_set1_ps(-0.f), a.lanes));
}
inline float largest(const Packed& a) {
  return std::max(a.lanes[0], std::max(a.lanes[1], a.lanes[2]));
}

}  // namespace drench::render
