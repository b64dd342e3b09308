#pragma once
// Owen-scrambled Sobol points: the first two Sobol dimensions, padded for every event of a path.
// Hash-based Owen scrambling after Burley 2020, "Practical Hash-based Owen Scrambling".

#include <cstdint>

#include "render/vector.h"

namespace drench {

inline uint32_t reverse_bits(uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

/// A full-avalanche integer hash (the finaliser of MurmurHash3).
inline uint32_t hash_bits(uint32_t x) {
  x ^= x >> 16;
  x *= 0x85ebca6bu;
  x ^= x >> 13;
  x *= 0xc2b2ae35u;
  return x ^ (x >> 16);
}

/// Owen scrambling of bit-reversed numbers: every bit depends only on the bits below it.
/// The Laine-Karras hash with the constants of N. Vegdahl.
inline uint32_t scramble_reversed(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

/// Second Sobol dimension of the index whose bit reversal is `reversed`, itself bit-reversed: the
/// Pascal matrix mod 2, which is a Kronecker power of ((1,1),(0,1)) and so takes five steps.
inline uint32_t sobol_second_reversed(uint32_t reversed) {
  uint32_t x = reverse_bits(reversed);
  x ^= (x >> 16) & 0x0000ffffu;
  x ^= (x >> 8) & 0x00ff00ffu;
  x ^= (x >> 4) & 0x0f0f0f0fu;
  x ^= (x >> 2) & 0x33333333u;
  x ^= (x >> 1) & 0x55555555u;
  return x;
}

inline float unit_float(uint32_t bits) { return float(bits >> 8) * 0x1p-24f; }

/// Interleaves the low 16 bits of x and y: pixels near each other get indices near each other.
inline uint64_t morton(uint32_t x, uint32_t y) {
  const auto spread = [](uint64_t v) {
    v = (v | (v << 16)) & 0x0000ffff0000ffffull;
    v = (v | (v << 8)) & 0x00ff00ff00ff00ffull;
    v = (v | (v << 4)) & 0x0f0f0f0f0f0f0f0full;
    v = (v | (v << 2)) & 0x3333333333333333ull;
    return (v | (v << 1)) & 0x5555555555555555ull;
  };
  return spread(x) | (spread(y) << 1);
}

/// How the samples of neighbouring pixels are related.
enum class PixelOrder {
  morton,    // one sequence along a Morton curve: error of neighbours is anticorrelated
  separate,  // every pixel its own scramble
};

/// Points of one camera sample. A dimension number belongs to an event of the path (lens, third
/// bounce's light, ...), so a skipped event shifts nothing.
class Sampler {
 public:
  /// @param slots_log2  samples of a pixel take 2^slots_log2 consecutive points
  Sampler(PixelOrder order, uint32_t seed, uint32_t x, uint32_t y, uint32_t slots_log2,
          uint32_t sample) {
    const uint64_t pixel = morton(x, y);
    if (order == PixelOrder::morton) {
      const uint64_t index = (pixel << slots_log2) | sample;
      reversed_index_ = reverse_bits(uint32_t(index));
      seed_ = hash_bits(seed ^ hash_bits(uint32_t(index >> 32)));
    } else {
      reversed_index_ = reverse_bits(sample);
      seed_ = hash_bits(seed ^ hash_bits(uint32_t(pixel)) ^ uint32_t(pixel >> 32));
    }
  }

  /// One number in [0, 1) for a dimension.
  float one(uint32_t dimension) const {
    const uint32_t key = hash_bits(seed_ + dimension * 0x9e3779b9u);
    return unit_float(reverse_bits(scramble_reversed(
        reverse_bits(scramble_reversed(reversed_index_, key)), key * 0x68bc21ebu)));
  }

  /// A point in [0, 1)^2 for a dimension: an Owen-scrambled (0, 2)-sequence.
  V2f two(uint32_t dimension) const {
    const uint32_t key = hash_bits(seed_ + dimension * 0x9e3779b9u);
    const uint32_t index = scramble_reversed(reversed_index_, key);  // shuffled, bit-reversed
    const uint32_t first = reverse_bits(index);                      // Sobol values, bit-reversed
    const uint32_t second = sobol_second_reversed(index);
    return {unit_float(reverse_bits(scramble_reversed(first, key * 0x68bc21ebu))),
            unit_float(reverse_bits(scramble_reversed(second, key * 0x02e5be93u)))};
  }

 private:
  uint32_t reversed_index_ = 0, seed_ = 0;
};

}  // namespace drench
