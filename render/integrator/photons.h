#pragma once
// Caustics of lamps: light that reaches a diffuse surface through or off a dielectric body. Paths
// from the camera hit a small lamp behind water by luck alone, so they leave that light out,
// exactly, and find it in a map of photons (Jensen 1996, "Global Illumination using Photon Maps").
//
// A photon starts at a point of a smooth body's surface that a lamp reaches unhindered, so that
// none misses the body, goes on through it and lies where it first meets a diffuse surface; rough
// bodies and metal end it, and paths keep what they find over those. Of N photons the map's
// radius falls as N^(-1/4) and the number within it grows as N^(1/2), so that both its blur, as
// N^(-1/2), and its noise, as N^(-1/4), vanish.
//
// Where a disc holds many, no sample needs to see them all: they are divided among the samples of
// a pixel, each of which looks up one subset, a map of its own with as much light. Together they
// see what each would have seen, at a fraction of the cost. They are divided by their time in the
// shutter, so that a sample of what moves finds those of about its own time (decision 0106).
//
// More photons than fit into memory come in rounds, each a map of its own that lights a part of
// every pixel's samples (photon_rounds.h). Radius and power are those of all rounds together, whose
// light a pixel averages, as one map of all would have it.
//
// Every second photon of a bucket belongs to one half of the map, the others to the other: what the
// halves bring differs by as much as their sum errs, since both are drawn alike.

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "render/bsdf/bsdf_cloth.h"
#include "render/scene/scene.h"

namespace drench::render {

struct Photon {
  V3f position;   // m
  V3f direction;  // unit, of flight
  V3f normal;     // unit, of the surface it lies on
  V3f power;      // W; of one that came through water divided by the squared index, as radiance is
  float time_sample = 0;  // in [0, 1), of which its time in the shutter was drawn
};

/// What photons bring, and by how much one half of them brings more than the other.
struct GatheredLight {
  Irradiance all, split;  // W/m^2
};

/// Eight photons as packs, four lines of the cache in a row.
struct alignas(64) PhotonPack {
  std::array<float, 8> x, y, z;            // m
  std::array<float, 8> red, green, blue;   // of the power
  std::array<uint32_t, 8> normal, flight;  // unit, to a thousandth: see pack_unit
};

/// A unit vector in three times ten bits.
inline uint32_t pack_unit(const V3f& v) {
  const auto bits = [](float c) { return uint32_t(int(std::lrint(c * 511))) & 1023; };
  return bits(v.x) | bits(v.y) << 10 | bits(v.z) << 20;
}
/// Component `axis` of eight vectors, times 511.
template <int axis>
__m256 unpack_unit(const std::array<uint32_t, 8>& packed) {
  const __m256i v = _mm256_load_si256(reinterpret_cast<const __m256i*>(packed.data()));
  return _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(v, 22 - 10 * axis), 22));
}

class PhotonMap {
 public:
  PhotonMap() = default;
  /// @param samples  of a pixel, which may divide the photons
  /// @param rounds   maps of as many photons whose light is averaged
  explicit PhotonMap(const std::vector<Photon>& photons, int samples = 1, int rounds = 1);

  bool empty() const { return size_ == 0; }
  size_t size() const { return size_; }
  float radius() const { return radius_; }  // m
  unsigned subsets() const { return 1u << subsets_log2_; }
  /// The subset of those drawn with it.
  unsigned subset_at(float time_sample) const {
    return std::min(unsigned(time_sample * subsets()), subsets() - 1);
  }

  /// Calls f(direction of flight, power, weight, half) for photons of a subset near a point of a
  /// surface: the sum of weight x power is the irradiance, W/m^2. Weighed by Epanechnikov's kernel
  /// over a disc, which is smaller where photons crowd: there fewer do, and its blur shows most.
  /// The half is 1 or -1.
  template <class F>
  void for_each_near(unsigned subset, const V3f& point, const V3f& normal, const F& f) const {
    for_each_pack_near(subset, point, normal, [&](const PhotonPack& p, __m256 weight) {
      alignas(32) float weights[8], flight[3][8];
      _mm256_store_ps(weights, weight);
      _mm256_store_ps(flight[0], unpack_unit<0>(p.flight) * (1 / 511.f));
      _mm256_store_ps(flight[1], unpack_unit<1>(p.flight) * (1 / 511.f));
      _mm256_store_ps(flight[2], unpack_unit<2>(p.flight) * (1 / 511.f));
      for (unsigned k = 0; k < 8; ++k)
        if (weights[k] > 0)
          f(V3f(flight[0][k], flight[1][k], flight[2][k]), V3f(p.red[k], p.green[k], p.blue[k]),
            weights[k], half_sign[k]);
    });
  }

  /// What they sum up to on the side that `front` points to and on the other.
  GatheredLight irradiance(unsigned subset, const V3f& point, const V3f& normal,
                           const V3f& front) const;

 private:
  static constexpr float same_surface = 0.7f;    // cosine between normals
  static constexpr float disc_thickness = 0.5f;  // of the disc, radii: curved surfaces count whole
  static constexpr float half_sign[8] = {1, -1, 1, -1, 1, -1, 1, -1};  // by index in a pack

  /// Also false for a point that is not finite.
  bool reaches(const V3f& p) const {
    const V3f &low = reach_.min, &high = reach_.max;
    return p.x >= low.x && p.y >= low.y && p.z >= low.z && p.x <= high.x && p.y <= high.y &&
           p.z <= high.z;
  }
  void choose_radii(const std::vector<Photon>& photons, int rounds);
  /// Sorts them by subset and by bucket.
  void sort_into_buckets(const std::vector<Photon>& photons);
  /// From 0 on within `reach_`.
  Imath::V3i cell_of(const V3f& p) const { return Imath::V3i((p - reach_.min) * inverse_edge_); }
  size_t buckets() const { return radius2_.size(); }
  /// Buckets of the cells along x are a row; rows of neighbours have no bucket in common.
  uint32_t row_of(int y, int z) const {
    return (uint32_t(y) * 0x9e3779b1u + uint32_t(z) * 0x85ebca77u) & mask_;
  }
  uint32_t bucket_of(const Imath::V3i& cell) const {
    return row_of(cell.y, cell.z) + uint32_t(cell.x);
  }

  /// Calls f(pack, weights) with a weight of 0 for photons that are not near.
  template <class F>
  void for_each_pack_near(unsigned subset, const V3f& point, const V3f& normal, const F& f) const {
    if (!reaches(point)) return;
    const float r2 = radius2_[bucket_of(cell_of(point))], r = std::sqrt(r2);
    const uint32_t* const first = first_.data() + size_t{subset} * buckets();
    const Imath::V3i low = cell_of(point - V3f(r)), high = cell_of(point + V3f(r));
    for (int z = low.z; z <= high.z; ++z)
      for (int y = low.y; y <= high.y; ++y) {
        const uint32_t row = row_of(y, z);
        for_each_pack_of(first[row + uint32_t(low.x)], first[row + uint32_t(high.x) + 1], point,
                         normal, r2, f);
      }
  }

  /// Of the photons from `first` to `last`.
  template <class F>
  void for_each_pack_of(uint32_t first, uint32_t last, const V3f& point, const V3f& normal,
                        float radius2, const F& f) const {
    const __m256 one = _mm256_set1_ps(1), inverse_r2 = one / radius2;
    const __m256 scale = _mm256_set1_ps(2 / (pi * radius2));
    const __m256 thick = _mm256_set1_ps(disc_thickness * disc_thickness * radius2);
    const __m256 same = _mm256_set1_ps(511 * same_surface * 511 * same_surface);
    for (uint32_t at = first & ~7u; at < last; at += 8) {
      const PhotonPack& p = pack_[at / 8];
      const __m256 x = _mm256_load_ps(p.x.data()) - point.x;
      const __m256 y = _mm256_load_ps(p.y.data()) - point.y;
      const __m256 z = _mm256_load_ps(p.z.data()) - point.z;
      const __m256 square = (x * x + y * y + z * z) * inverse_r2;
      const __m256 off = x * normal.x + y * normal.y + z * normal.z;
      const __m256 near = _mm256_and_ps(_mm256_cmp_ps(square, one, _CMP_LT_OQ),
                                        _mm256_cmp_ps(off * off, thick, _CMP_LE_OQ));
      const __m256i index = _mm256_add_epi32(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7),
                                             _mm256_set1_epi32(int(at - first)));
      const __m256i here =
          _mm256_andnot_si256(_mm256_srai_epi32(index, 31),
                              _mm256_cmpgt_epi32(_mm256_set1_epi32(int(last - first)), index));
      const __m256 counts = _mm256_and_ps(near, _mm256_castsi256_ps(here));
      if (_mm256_testz_ps(counts, counts)) continue;
      const __m256 cosine = unpack_unit<0>(p.normal) * normal.x +
                            unpack_unit<1>(p.normal) * normal.y +
                            unpack_unit<2>(p.normal) * normal.z;
      const __m256 faces = _mm256_cmp_ps(cosine * cosine, same, _CMP_GE_OQ);
      f(p, _mm256_and_ps(_mm256_and_ps(counts, faces), scale * (one - square)));
    }
  }

  Imath::Box3f reach_;  // of the photons and two radii around them; empty without any
  float radius_ = 0, inverse_edge_ = 0;  // cells are two radii wide
  uint32_t mask_ = 0;
  unsigned subsets_log2_ = 0;
  size_t size_ = 0;               // number of photons
  std::vector<float> radius2_;    // m^2, of discs around points of each bucket
  std::vector<uint32_t> first_;   // of each subset's buckets, and the number of photons
  std::vector<PhotonPack> pack_;  // of all photons by subset and bucket
};

/// Whether photons find the light that lamps send through dielectric bodies: there are lamps, none
/// of them in a body.
bool can_trace_photons(const Scene& scene);

/// One of several maps of as many photons whose light is averaged: each photon of one map and those
/// of its number in the others are drawn as the samples of a pixel are.
struct PhotonRound {
  int index = 0;
  int rounds = 1;           // until the radius is chosen again
  uint32_t slots_log2 = 0;  // of a photon; those of later rounds draw apart
};

/// The light of lamps that comes through bodies: photons, and walks (manifold.h) for what these
/// leave out.
struct Caustics {
  PhotonMap photons;
  ManifoldWalks walks = ManifoldWalks::none;
  float walked = 0;  // fraction of the light that walks find, if they were tried
};

/// The same bits for any thread count.
/// @param count    photons that start
/// @param samples  of a pixel
/// @param walks    which are tried
/// @param rays     counts rays traced
Caustics trace_photons(const Scene& scene, uint32_t seed, uint32_t count, int samples,
                       ManifoldWalks walks, uint64_t& rays, const PhotonRound& round = {});

}  // namespace drench::render
