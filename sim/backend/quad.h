#pragma once
// Four floats of a particle, read in one piece, and the arithmetic that passes over neighbour lists
// do with them. On a CPU core a Quad holds the same four numbers of two neighbours side by side; on
// the GPU those of one.

#include "sim/backend/pack.h"

#if !defined(__CUDACC__)
#include <immintrin.h>
#endif

namespace drench::sim::DRENCH_BACKEND {

/// As it lies in memory: three components and a scalar.
struct alignas(16) Float4 {
  float x, y, z, w;
};

/// L v of a symmetric L: its diagonal, and its xy, yz, zx.
DRENCH_HD Float4 multiply_symmetric(const Float4& d, const Float4& c, const Float4& v) {
  return {d.x * v.x + c.x * v.y + c.z * v.z, c.x * v.x + d.y * v.y + c.y * v.z,
          c.z * v.x + c.y * v.y + d.z * v.z, 0.f};
}

#if defined(__CUDACC__)

struct Quad {
  float x = 0.f, y = 0.f, z = 0.f, w = 0.f;
  friend DRENCH_HD Quad operator+(Quad a, Quad b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w};
  }
  friend DRENCH_HD Quad operator-(Quad a, Quad b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w};
  }
  friend DRENCH_HD Quad operator*(Quad a, Quad b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z, a.w * b.w};
  }
  friend DRENCH_HD Quad operator/(Quad a, Quad b) {
    return {a.x / b.x, a.y / b.y, a.z / b.z, a.w / b.w};
  }
};
DRENCH_HD Quad multiply_add(Quad a, Quad b, Quad c) {
  return {fmaf(a.x, b.x, c.x), fmaf(a.y, b.y, c.y), fmaf(a.z, b.z, c.z), fmaf(a.w, b.w, c.w)};
}
/// w, w, w, w.
DRENCH_HD Quad splat_w(Quad a) { return {a.w, a.w, a.w, a.w}; }
/// The sum of all four, four times.
DRENCH_HD Quad splat_sum(Quad a) {
  const float sum = (a.x + a.y) + (a.z + a.w);
  return {sum, sum, sum, sum};
}
/// y, z, x, w.
DRENCH_HD Quad rotate(Quad a) { return {a.y, a.z, a.x, a.w}; }
/// z, x, y, w.
DRENCH_HD Quad rotate_back(Quad a) { return {a.z, a.x, a.y, a.w}; }
DRENCH_HD Quad both(const Float4& a) { return {a.x, a.y, a.z, a.w}; }
DRENCH_HD Quad splat(float a) { return {a, a, a, a}; }
DRENCH_HD Quad positive(Quad a) {
  return {fmaxf(a.x, 0.f), fmaxf(a.y, 0.f), fmaxf(a.z, 0.f), fmaxf(a.w, 0.f)};
}
DRENCH_HD Quad nearest_integer(Quad a) { return {rintf(a.x), rintf(a.y), rintf(a.z), rintf(a.w)}; }

#else

struct Quad {
  using Native = float __attribute__((vector_size(32)));
  Native v;
  Quad() : v(_mm256_setzero_ps()) {}
  DRENCH_HD explicit Quad(Native a) : v(a) {}
  DRENCH_HD explicit Quad(float a) : v(_mm256_set1_ps(a)) {}
  friend DRENCH_HD Quad operator+(Quad a, Quad b) { return Quad(a.v + b.v); }
  friend DRENCH_HD Quad operator-(Quad a, Quad b) { return Quad(a.v - b.v); }
  friend DRENCH_HD Quad operator*(Quad a, Quad b) { return Quad(a.v * b.v); }
  friend DRENCH_HD Quad operator/(Quad a, Quad b) { return Quad(a.v / b.v); }
};
DRENCH_HD Quad multiply_add(Quad a, Quad b, Quad c) {
  return Quad(Quad::Native(_mm256_fmadd_ps(a.v, b.v, c.v)));
}
DRENCH_HD Quad splat_w(Quad a) { return Quad(Quad::Native(_mm256_permute_ps(a.v, 0xff))); }
DRENCH_HD Quad splat_sum(Quad a) {
  const Quad pairs = a + Quad(Quad::Native(_mm256_permute_ps(a.v, 0xb1)));
  return pairs + Quad(Quad::Native(_mm256_permute_ps(pairs.v, 0x4e)));
}
DRENCH_HD Quad rotate(Quad a) { return Quad(Quad::Native(_mm256_permute_ps(a.v, 0xc9))); }
DRENCH_HD Quad rotate_back(Quad a) { return Quad(Quad::Native(_mm256_permute_ps(a.v, 0xd2))); }
DRENCH_HD Quad nearest_integer(Quad a) {
  return Quad(Quad::Native(_mm256_round_ps(a.v, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC)));
}

/// Lanes 2 k and 2 k + 1 of eight, each in all four components of one half.
DRENCH_HD Quad spread_two(Pack a, int k) {
  const __m256i lane =
      _mm256_add_epi32(_mm256_set1_epi32(2 * k), _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1));
  return Quad(Quad::Native(_mm256_permutevar8x32_ps(a.v, lane)));
}
DRENCH_HD Quad both(const Float4& a) {
  return Quad(Quad::Native(_mm256_broadcast_ps(reinterpret_cast<const __m128*>(&a))));
}
DRENCH_HD Quad splat(float a) { return Quad(a); }
DRENCH_HD Quad positive(Quad a) {
  return Quad(Quad::Native(_mm256_max_ps(a.v, _mm256_setzero_ps())));
}
DRENCH_HD Quad side_by_side(const Float4& a, const Float4& b) {
  return Quad(Quad::Native(
      _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(&a.x)), _mm_load_ps(&b.x), 1)));
}
/// The two neighbours of a Quad added up.
DRENCH_HD Float4 add_both(Quad a) {
  Float4 out;
  _mm_store_ps(&out.x, _mm_add_ps(_mm256_castps256_ps128(a.v), _mm256_extractf128_ps(a.v, 1)));
  return out;
}

#endif

}  // namespace drench::sim::DRENCH_BACKEND
