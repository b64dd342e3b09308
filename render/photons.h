#pragma once
// Caustics of lamps: light that reaches a diffuse surface through or off a dielectric body. Paths
// from the camera hit a small lamp behind water by luck alone, so they leave that light out,
// exactly, and find it in a map of photons (Jensen 1996, "Global Illumination using Photon Maps").
//
// A photon starts at a point of a smooth body's surface that a lamp reaches unhindered, so that
// none misses the body, goes on through it and lies where it first meets a diffuse surface; rough
// bodies and metal end it, and paths keep what they find by way of those. Of N photons the map's
// radius falls as N^(-1/4) and the number within it grows as N^(1/2), so that both its blur, as
// N^(-1/2), and its noise, as N^(-1/4), vanish.

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "render/scene.h"

namespace drench {

struct Photon {
  V3f position;   // m
  V3f direction;  // unit, of flight
  V3f normal;     // unit, of the surface it lies on
  V3f power;      // W; of one that came through water divided by the squared index, as radiance is
};

class PhotonMap {
 public:
  PhotonMap() = default;
  explicit PhotonMap(std::vector<Photon> photons);

  bool empty() const { return photon_.empty(); }
  size_t size() const { return photon_.size(); }
  float radius() const { return radius_; }  // m

  /// Calls f(photon, share) for photons near a point of a surface: the sum of share x power is the
  /// irradiance, W/m^2. Weighed by Epanechnikov's kernel over a disc, which is smaller where
  /// photons crowd: there fewer do, and its blur shows most.
  template <class F>
  void for_each_near(const V3f& point, const V3f& normal, F f) const {
    if (!reach_.intersects(point)) return;
    const uint32_t middle = bucket_of(cell_of(point));
    const uint32_t count = first_[middle + 1] - first_[middle];
    const float share = count > crowd_ ? float(crowd_) / float(count) : 1.f;
    const float r2 = radius_ * radius_ * share, r = std::sqrt(r2), scale = 2 / (kPi * r2);
    const Imath::V3i low = cell_of(point - V3f(r)), high = cell_of(point + V3f(r));
    std::array<uint32_t, 8> seen;  // cells may share a bucket
    size_t buckets = 0;
    Imath::V3i c;
    for (c.z = low.z; c.z <= high.z; ++c.z)
      for (c.y = low.y; c.y <= high.y; ++c.y)
        for (c.x = low.x; c.x <= high.x; ++c.x) {
          const uint32_t bucket = bucket_of(c);
          const auto end = seen.begin() + ptrdiff_t(buckets);
          if (first_[bucket] == first_[bucket + 1] || std::find(seen.begin(), end, bucket) != end)
            continue;
          if (buckets < seen.size()) seen[buckets++] = bucket;
          for_each_in(bucket, point, normal, r2, [&](const Photon& photon, float square) {
            if (std::abs(dot(photon.normal, normal)) >= kSameSurface)
              f(photon, scale * (1 - square / r2));
          });
        }
  }

 private:
  static constexpr float kSameSurface = 0.7f;  // cosine between normals
  static constexpr float kThickness = 0.5f;    // of the disc, radii: curved surfaces count whole
  static constexpr float kCrowd = 4;           // times the photons of the median one's disc
  static constexpr uint32_t kFewest = 400;     // photons of a crowded cell: noise above blur

  Imath::V3i cell_of(const V3f& p) const {
    return {int(std::floor(p.x * inverse_edge_)), int(std::floor(p.y * inverse_edge_)),
            int(std::floor(p.z * inverse_edge_))};
  }
  uint32_t bucket_of(const Imath::V3i& cell) const;

  /// Calls f(photon, distance^2) for the photons of a bucket within the disc.
  template <class F>
  void for_each_in(uint32_t bucket, const V3f& point, const V3f& normal, float radius2, F f) const {
    const __m256 r2 = _mm256_set1_ps(radius2);
    const __m256 thick = _mm256_set1_ps(kThickness * kThickness * radius2);
    const uint32_t last = first_[bucket + 1];
    for (uint32_t k = first_[bucket]; k < last; k += 8) {
      const auto away = [&](int axis) {
        return _mm256_loadu_ps(place_[axis].data() + k) - _mm256_set1_ps(point[axis]);
      };
      const __m256 x = away(0), y = away(1), z = away(2);
      const __m256 square = x * x + y * y + z * z;
      const __m256 off = x * normal.x + y * normal.y + z * normal.z;
      const __m256 near = _mm256_and_ps(_mm256_cmp_ps(square, r2, _CMP_LT_OQ),
                                        _mm256_cmp_ps(off * off, thick, _CMP_LE_OQ));
      unsigned bits = unsigned(_mm256_movemask_ps(near));
      if (last - k < 8) bits &= (1u << (last - k)) - 1;
      alignas(32) float squares[8];
      _mm256_store_ps(squares, square);
      for (; bits != 0; bits &= bits - 1) {
        const unsigned lane = unsigned(std::countr_zero(bits));
        f(photon_[k + lane], squares[lane]);
      }
    }
  }

  Imath::Box3f reach_;  // of the photons and a radius around them; empty without any
  float radius_ = 0, inverse_edge_ = 0;  // cells are two radii wide
  uint32_t mask_ = 0;
  uint32_t crowd_ = 0;                       // photons in a cell beyond which the disc shrinks
  std::vector<uint32_t> first_;              // of each bucket, and the number of photons
  std::vector<Photon> photon_;               // by bucket
  std::array<std::vector<float>, 3> place_;  // of each, and room for a pack to be read
};

/// Whether photons find the light that lamps send through dielectric bodies: there are lamps, none
/// of them in a body.
bool can_trace_photons(const Scene& scene);

/// The same bits for any thread count.
/// @param count  photons that start
/// @param rays   counts rays traced
PhotonMap trace_photons(const Scene& scene, uint32_t seed, uint32_t count, uint64_t& rays);

}  // namespace drench
