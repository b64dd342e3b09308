#pragma once
// Owen-scrambled Sobol points: the first two Sobol dimensions, padded for every event of a path.
// Hash-based Owen scrambling after Burley 2020, "Practical Hash-based Owen Scrambling".

#include <array>
#include <cstdint>

#include "render/vector.h"

namespace drench::render {

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

/// Second Sobol dimension of an index, bit-reversed (the first is the index itself): the Pascal
/// matrix mod 2, which is a Kronecker power of ((1,1),(0,1)) and so takes five steps.
inline uint32_t sobol_second_reversed(uint32_t x) {
  x ^= (x >> 16) & 0x0000ffffu;
  x ^= (x >> 8) & 0x00ff00ffu;
  x ^= (x >> 4) & 0x0f0f0f0fu;
  x ^= (x >> 2) & 0x33333333u;
  x ^= (x >> 1) & 0x55555555u;
  return x;
}

/// Through a signed number, which packs convert in one instruction.
inline float unit_float(uint32_t bits) { return float(int32_t(bits >> 8)) * 0x1p-24f; }

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
  /// @param slots_log2  samples of a pixel take 2^slots_log2 consecutive points, 32 at most
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

  /// Of a sample of the same pixel, from that of its sample 0.
  Sampler at(uint32_t sample) const {
    Sampler out = *this;
    out.reversed_index_ |= reverse_bits(sample);
    return out;
  }

  /// One number in [0, 1) for a dimension: the first of `two`.
  float one(uint32_t dimension) const {
    const uint32_t key = key_of(dimension);
    return unit_float(coordinate(shuffled_index(key), key, first_seed));
  }

  /// A point in [0, 1)^2 for a dimension: an Owen-scrambled (0, 2)-sequence.
  V2f two(uint32_t dimension) const {
    const uint32_t key = key_of(dimension), index = shuffled_index(key);
    return {unit_float(coordinate(index, key, first_seed)),
            unit_float(coordinate(sobol_second_reversed(index), key, second_seed))};
  }

  /// `two` of four dimensions from `first` on, at little more than the cost of one: eight numbers
  /// are a pack.
  std::array<V2f, 4> four(uint32_t first) const {
    std::array<uint32_t, 8> bits;
    for (uint32_t k = 0; k < 8; ++k) {
      const uint32_t key = key_of(first + k / 2), index = shuffled_index(key);
      bits[k] = coordinate(k % 2 ? sobol_second_reversed(index) : index, key,
                           k % 2 ? second_seed : first_seed);
    }
    std::array<V2f, 4> out;
    for (uint32_t k = 0; k < 8; ++k) out[k / 2][int(k % 2)] = unit_float(bits[k]);
    return out;
  }

  /// `two` of a dimension for eight samples of the pixel from `first` on, from its sample 0.
  std::array<V2f, 8> two_of_eight(uint32_t first, uint32_t dimension) const {
    std::array<uint32_t, 8> x, y;
    const uint32_t key = key_of(dimension);
    for (uint32_t k = 0; k < 8; ++k) {
      const uint32_t index = at(first + k).shuffled_index(key);
      x[k] = coordinate(index, key, first_seed);
      y[k] = coordinate(sobol_second_reversed(index), key, second_seed);
    }
    std::array<V2f, 8> out;
    for (uint32_t k = 0; k < 8; ++k) out[k] = {unit_float(x[k]), unit_float(y[k])};
    return out;
  }

 private:
  static constexpr uint32_t first_seed = 0x68bc21eb,
                            second_seed = 0x02e5be93;  // seeds, any odd numbers

  uint32_t key_of(uint32_t dimension) const { return hash_bits(seed_ + dimension * 0x9e3779b9u); }
  uint32_t shuffled_index(uint32_t key) const {
    return reverse_bits(scramble_reversed(reversed_index_, key));
  }
  /// Scrambles a Sobol value, which is given bit-reversed.
  static uint32_t coordinate(uint32_t reversed, uint32_t key, uint32_t seed) {
    return reverse_bits(scramble_reversed(reversed, key * seed));
  }

  uint32_t reversed_index_ = 0, seed_ = 0;
};

}  // namespace drench::render
