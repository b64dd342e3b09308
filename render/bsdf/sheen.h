#pragma once
// The fuzz of fibre ends that stand up from a cloth and shine where it is seen, or lit, along the
// surface. Estevez and Kulla 2017, "Production Friendly Microfacet Sheen BRDF": normals whose
// density grows as a power of the sine,
//   D = (2 + 1/r) sin^(1/r) / (2 pi),
// with the visibility of Neubelt and Pettineo 2013, 1 / (4 (cos o + cos i - cos o cos i)), which
// is symmetric and bounded. What lies below gets what the fuzz leaves (bsdf_fabric.h).

#include <array>

#include "render/sampling.h"

namespace drench::render {

/// Directions are local, z the normal, both in the upper hemisphere.
struct SheenLobe {
  float power = 1;  // 1 / r
  float gain = 1;   // below 1 where some direction would return more than arrives

  /// Value x |cos| over the cosine, without colour.
  float over_cos(const V3f& o, const V3f& i) const {
    const V3f sum = o + i;
    const float square = dot(sum, sum);
    if (!(square > 0)) return 0;
    const float sin2 = std::clamp(1 - sum.z * sum.z / square, 0.f, 1.f);
    const float density = (2 + power) * std::pow(sin2, 0.5f * power) / (2 * pi);
    return gain * density / (4 * std::max(o.z + i.z - o.z * i.z, 1e-6f));
  }

  /// Uniform over the hemisphere: where fuzz is bright the surface is seen along itself, and
  /// weights stay below (2 + 1/r) / 4.
  static V3f sample(const V2f& u) { return sample_cone(u, 1); }
  static constexpr float pdf() { return 1 / (2 * pi); }
};

/// What fuzz returns of light from everywhere, by the angle it is seen at.
class SheenTable {
 public:
  /// @param roughness  r, above 0
  explicit SheenTable(float roughness);

  const SheenLobe& lobe() const { return lobe_; }
  float at(float cos) const;
  float mean() const { return mean_; }  // over light from everywhere

 private:
  static constexpr int nodes = 64;  // over the root of the cosine

  SheenLobe lobe_;
  std::array<float, nodes + 1> albedo_;
  float mean_ = 0;
};

}  // namespace drench::render
