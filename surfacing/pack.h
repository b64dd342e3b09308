#pragma once
// Eight floats side by side: GCC vector type, so + - * / and comparisons are the language's own.

#include <immintrin.h>

#include <cstddef>

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

}  // namespace drench::surfacing
