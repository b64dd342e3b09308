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

/// The places of up to eight lanes, in order; those after them are any.
using PackPlaces = __m256i;

/// Places of the bits that are set.
inline PackPlaces set_places(unsigned bits) {
  static constexpr auto table = [] {
    std::array<uint64_t, 256> places{};  // a byte each
    for (unsigned b = 0; b < 256; ++b)
      for (unsigned lane = 8; lane-- > 0;)
        if (b >> lane & 1) places[b] = places[b] << 8 | lane;
    return places;
  }();
  return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(table[bits])));
}
inline Pack picked(Pack value, PackPlaces places) {
  return _mm256_permutevar8x32_ps(value, places);
}
/// Writes first + each of the places.
inline void store(uint32_t* target, PackPlaces places, uint32_t first) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(target),
                      _mm256_add_epi32(places, _mm256_set1_epi32(static_cast<int>(first))));
}

}  // namespace drench::surfacing
