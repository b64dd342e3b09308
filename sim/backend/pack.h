#pragma once
// Eight floats in one AVX2 register, with the operations that pass functors use on plain floats
// too. GCC vector operators; square root by intrinsic, which a lane loop would cost 10-40 % more.

#include <cmath>

#include "sim/backend/backend.h"

#if !defined(__CUDACC__)
#include <immintrin.h>
#endif

namespace drench::sim::DRENCH_BACKEND {

DRENCH_HD float max0(float a) { return a > 0.f ? a : 0.f; }
DRENCH_HD float select(bool mask, float a, float b) { return mask ? a : b; }
DRENCH_HD int select(bool mask, int a, int b) { return mask ? a : b; }
DRENCH_HD float minimum(float a, float b) { return a < b ? a : b; }
DRENCH_HD float maximum(float a, float b) { return a > b ? a : b; }
DRENCH_HD float square_root(float a) { return sqrtf(a); }
DRENCH_HD float load(const float* p, int i) { return p[i]; }
DRENCH_HD int load(const int* p, int i) { return p[i]; }
DRENCH_HD void store(float* p, int i, float a) { p[i] = a; }
DRENCH_HD void store(int* p, int i, bool a) { p[i] = a; }
DRENCH_HD float round_down(float a) { return floorf(a); }
DRENCH_HD bool below(int i, int n) { return i < n; }
DRENCH_HD bool is_index(int i) { return i >= 0; }
DRENCH_HD int same_index(int i, int) { return i; }  // the second says of which kind

#if !defined(__CUDACC__)

struct Mask {
  using Native = int __attribute__((vector_size(32)));
  Native v;
  friend DRENCH_HD Mask operator&(Mask a, Mask b) { return {a.v & b.v}; }
  friend DRENCH_HD Mask operator|(Mask a, Mask b) { return {a.v | b.v}; }
  friend DRENCH_HD Mask operator!(Mask a) { return {~a.v}; }
  DRENCH_HD int bits() const {  // bit k is lane k
    return _mm256_movemask_ps(_mm256_castsi256_ps(reinterpret_cast<__m256i>(v)));
  }
};

struct Pack {
  static constexpr int size = 8;
  using Native = float __attribute__((vector_size(32)));
  Native v;

  Pack() = default;
  DRENCH_HD Pack(float a) : v(_mm256_set1_ps(a)) {}
  DRENCH_HD explicit Pack(Native a) : v(a) {}
  static DRENCH_HD Pack load(const float* p) { return Pack(_mm256_loadu_ps(p)); }
  DRENCH_HD void store(float* p) const { _mm256_storeu_ps(p, v); }

  friend DRENCH_HD Pack operator+(Pack a, Pack b) { return Pack(a.v + b.v); }
  friend DRENCH_HD Pack operator-(Pack a, Pack b) { return Pack(a.v - b.v); }
  friend DRENCH_HD Pack operator*(Pack a, Pack b) { return Pack(a.v * b.v); }
  friend DRENCH_HD Pack operator/(Pack a, Pack b) { return Pack(a.v / b.v); }
  friend DRENCH_HD Pack operator-(Pack a) { return Pack(-a.v); }
  friend DRENCH_HD Mask operator<(Pack a, Pack b) { return {a.v < b.v}; }
  friend DRENCH_HD Mask operator<=(Pack a, Pack b) { return {a.v <= b.v}; }
  friend DRENCH_HD Mask operator>(Pack a, Pack b) { return {a.v > b.v}; }
  friend DRENCH_HD Mask operator>=(Pack a, Pack b) { return {a.v >= b.v}; }
};

DRENCH_HD Pack max0(Pack a) { return Pack(_mm256_max_ps(a.v, _mm256_setzero_ps())); }
DRENCH_HD Pack minimum(Pack a, Pack b) { return Pack(_mm256_min_ps(a.v, b.v)); }
DRENCH_HD Pack maximum(Pack a, Pack b) { return Pack(_mm256_max_ps(a.v, b.v)); }
DRENCH_HD Pack round_down(Pack a) { return Pack(_mm256_floor_ps(a.v)); }
DRENCH_HD Pack square_root(Pack a) { return Pack(_mm256_sqrt_ps(a.v)); }
DRENCH_HD Pack select(Mask m, Pack a, Pack b) { return Pack(m.v ? a.v : b.v); }

/// Eight consecutive indices starting at base, and eight arbitrary ones: what an index is on a CPU
/// core in passes that run over packs (for_each_lane). On the GPU both are an int.
struct Lanes {
  int base;
};
struct LaneIndex {
  __m256i v;
};
DRENCH_HD Pack load(const float* p, Lanes i) { return Pack::load(p + i.base); }
DRENCH_HD LaneIndex load(const int* p, Lanes i) {
  return {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p + i.base))};
}
DRENCH_HD LaneIndex load(const int* p, LaneIndex i) { return {_mm256_i32gather_epi32(p, i.v, 4)}; }
DRENCH_HD Pack load(const float* p, LaneIndex i) { return Pack(_mm256_i32gather_ps(p, i.v, 4)); }
DRENCH_HD void store(float* p, Lanes i, Pack a) { a.store(p + i.base); }
DRENCH_HD Lanes operator+(Lanes i, int offset) { return {i.base + offset}; }
DRENCH_HD LaneIndex same_index(int i) { return {_mm256_set1_epi32(i)}; }
DRENCH_HD LaneIndex same_index(int i, LaneIndex) { return same_index(i); }
DRENCH_HD LaneIndex operator+(LaneIndex i, LaneIndex j) { return {_mm256_add_epi32(i.v, j.v)}; }
DRENCH_HD LaneIndex operator+(LaneIndex i, int offset) { return i + same_index(offset); }
DRENCH_HD LaneIndex select(Mask m, LaneIndex a, LaneIndex b) {
  return {_mm256_blendv_epi8(b.v, a.v, reinterpret_cast<__m256i>(m.v))};
}
DRENCH_HD Mask same(LaneIndex i, LaneIndex j) {
  return {reinterpret_cast<Mask::Native>(_mm256_cmpeq_epi32(i.v, j.v))};
}
DRENCH_HD Mask is_index(LaneIndex i) {  // not negative
  return {reinterpret_cast<Mask::Native>(_mm256_cmpgt_epi32(i.v, _mm256_set1_epi32(-1)))};
}

/// Lanes 0..count-1.
DRENCH_HD Mask first_lanes(int count) {
  const Mask::Native index{0, 1, 2, 3, 4, 5, 6, 7};
  return {index < count};
}
DRENCH_HD Mask below(Lanes i, int n) { return first_lanes(n - i.base); }
DRENCH_HD void store(int* p, Lanes i, Mask a) {  // 1 where it is set
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(p + i.base), reinterpret_cast<__m256i>(-a.v));
}
/// Stores the lanes of the mask alone.
DRENCH_HD void store_lanes(float* p, Mask m, Pack a) {
  _mm256_maskstore_ps(p, reinterpret_cast<__m256i>(m.v), a.v);
}
DRENCH_HD void store_lanes(int* p, Mask m, LaneIndex i) {
  _mm256_maskstore_epi32(p, reinterpret_cast<__m256i>(m.v), i.v);
}

DRENCH_HD float smallest_lane(Pack a) {
  const __m128 four = _mm_min_ps(_mm256_castps256_ps128(a.v), _mm256_extractf128_ps(a.v, 1));
  const __m128 two = _mm_min_ps(four, _mm_movehl_ps(four, four));
  return _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps(two, two, 1)));
}
DRENCH_HD float largest_lane(Pack a) { return -smallest_lane(-a); }

/// Sum of the lanes by a fixed tree.
DRENCH_HD float sum_of_lanes(Pack a) {
  const __m128 four = _mm_add_ps(_mm256_castps256_ps128(a.v), _mm256_extractf128_ps(a.v, 1));
  const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
  return _mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps(two, two, 1)));
}

#endif

}  // namespace drench::sim::DRENCH_BACKEND
