#pragma once
// Eight floats side by side: GCC vector type, so + - * / and comparisons are the language's own.

#include <immintrin.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace drench::surfacing {

using Pack = __m256;
inline constexpr size_t pack_width = 8;

inline Pack pack(float value) { return _mm256_set1_ps(value); }
inline Pack load(const float* source) { return _mm256_loadu_ps(source); }
inline void store(float* target, Pack value) { _mm256_storeu_ps(target, value); }
inline Pack square_root(Pack value) { return _mm256_sqrt_ps(value); }
inline Pack larger(Pack a, Pack b) { return _mm256_max_ps(a, b); }
inline Pack smaller(Pack a, Pack b) { return _mm256_min_ps(a, b); }
inline Pack multiply_add(Pack a, Pack b, Pack c) { return _mm256_fmadd_ps(a, b, c); }  // a b + c
inline Pack subtract_product(Pack c, Pack a, Pack b) {
  return _mm256_fnmadd_ps(a, b, c);
}  // c - a b
inline Pack lanes() { return _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7); }

/// Bit k is set where lane k of a < b.
inline unsigned less_bits(Pack a, Pack b) {
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_LT_OQ)));
}
/// Bit k is set where lane k of a >= b.
inline unsigned not_less_bits(Pack a, Pack b) {
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_GE_OQ)));
}

inline float sum_of(Pack value) {
  float lane[pack_width], sum = 0;
  store(lane, value);
  for (const float one : lane) sum += one;
  return sum;
}

/// Indices of up to eight lanes, in order; those after them are any.
using LaneIndices = __m256i;

/// Of the bits that are set.
inline LaneIndices set_lanes(unsigned bits) {
  static constexpr auto table = [] {
    std::array<uint64_t, 256> lanes{};  // a byte each
    for (unsigned b = 0; b < 256; ++b)
      for (unsigned lane = 8; lane-- > 0;)
        if (b >> lane & 1) lanes[b] = lanes[b] << 8 | lane;
    return lanes;
  }();
  return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(table[bits])));
}
inline Pack picked(Pack value, LaneIndices chosen) {
  return _mm256_permutevar8x32_ps(value, chosen);
}
/// Writes first + each of the indices.
inline void store(uint32_t* target, LaneIndices chosen, uint32_t first) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(target),
                      _mm256_add_epi32(chosen, _mm256_set1_epi32(static_cast<int>(first))));
}

}  // namespace drench::surfacing
