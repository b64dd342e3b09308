#pragma once
// The glint of woven yarns: two families of cylinders, warp along u and weft along v of the cloth,
// each over half of it. Facets of a long cylinder have the normals of an ellipsoid that is drawn
// out along it, which is GGX's distribution (Walter et al. 2007; Heitz 2014, "Understanding the
// Masking-Shadowing Function") with the slope 1 across and, along, the slope alpha by which fibres
// wander from the yarn's direction. Highlights are lines across the yarns, as those of Sadeghi et
// al. 2013, "A Practical Microcylinder Appearance Model for Cloth Rendering"; what goes into the
// fibres is left to the diffuse sheet. What they mirror does not depend on the angle.

#include <array>

#include "render/bsdf/bsdf.h"
#include "render/sampling.h"

namespace drench::render {

/// One family. Directions are local, z the normal, x along the yarn, o above the horizon.
struct YarnFacets {
  float alpha = 0.1f;  // along; across it is 1

  V3f shrunk(const V3f& w) const { return {alpha * w.x, w.y, w.z}; }
  float stretch(const V3f& w) const {
    const V3f s = shrunk(w);
    return std::sqrt(dot(s, s));
  }
  float density(const V3f& h) const {
    const float x = h.x / alpha, r = x * x + h.y * h.y + h.z * h.z;
    return 1 / (pi * alpha * r * r);
  }
  /// Masking over both cosines, as `Ggx::masking`.
  float masking(const V3f& o, const V3f& i) const {
    return 2 / (stretch(o) * i.z + stretch(i) * o.z);
  }
  /// Eto and Tokuyoshi 2023, with the lesser alpha.
  float bound(const V3f& o) const {
    const float s = 1 + std::sqrt(o.x * o.x + o.y * o.y), s2 = s * s, a2 = alpha * alpha;
    return (1 - a2) * s2 / (s2 + a2 * o.z * o.z);
  }

  /// Value x |cos| of facets that mirror all, and the density of `sample`.
  float value(const V3f& o, const V3f& i, float& pdf) const {
    pdf = 0;
    if (!(i.z > 0)) return 0;
    const float normals = density(normalized(o + i));
    pdf = normals / (2 * (bound(o) * o.z + stretch(o)));
    return normals * masking(o, i) * i.z / 4;
  }

  /// May be below the horizon. Dupuy and Benyoub 2023, as `Ggx::sample_normal`.
  V3f sample(const V3f& o, const V2f& u) const {
    const V3f towards = normalized(shrunk(o));
    const float lowest = -bound(o) * towards.z, z = 1 - u.y * (1 - lowest);
    const float sin = std::sqrt(std::max(0.f, 1 - z * z)), phi = 2 * pi * u.x;
    V3f h = V3f(sin * std::cos(phi), sin * std::sin(phi), z) + towards;
    h = normalized(shrunk({h.x, h.y, std::max(h.z, 1e-7f)}));
    return h * (2 * dot(o, h)) - o;
  }
};

/// What one family returns of light from everywhere, by the direction it is seen from; the rest
/// goes on to what lies below. Made when the frame starts, for one alpha.
class YarnTable {
 public:
  explicit YarnTable(float alpha);

  const YarnFacets& facets() const { return facets_; }
  /// @param o  local to the yarn, unit
  float at(const V3f& o) const;
  /// Mean over light from everywhere.
  float mean() const { return mean_; }

 private:
  static constexpr int rows = 48, columns = 16;  // over the root of the cosine, and the angle

  float at(float cos, float angle) const;

  YarnFacets facets_;
  std::array<std::array<float, columns + 1>, rows + 1> albedo_;
  float mean_ = 0;
};

}  // namespace drench::render
