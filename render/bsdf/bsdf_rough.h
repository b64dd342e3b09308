#pragma once
// A rough interface between two dielectrics: Walter et al. 2007, "Microfacet Models for Refraction
// through Rough Surfaces", for radiance divided by the squared index, which leaves no squared index
// in what refraction weighs.
//
// The facet is drawn first, of those that are seen, then one of its two directions by its own
// Fresnel factor: so no sample weighs more than 1 before what further facets return. (The bound for
// reflections needs the lobe first; weights would then reach Fresnel's factor over its mean.)

#include "render/bsdf/albedo_table.h"
#include "render/bsdf/bsdf_dielectric.h"
#include "render/bsdf/microfacet.h"

namespace drench::render {

class RoughBsdf {
 public:
  /// @param outgoing  unit, away from the surface
  /// @param eta       index beyond the surface over index on the side of `outgoing`, not 1
  /// @param albedo    of the same alpha and eta
  RoughBsdf(const V3f& outgoing, const V3f& geometric, const V3f& shading, float alpha, float eta,
            const AlbedoTable& albedo)
      : frame_(outgoing, geometric, shading), ggx_{alpha}, eta_(eta), o_(frame_.local(outgoing)) {
    gain_ = 1 / albedo.at(o_.z).total;
  }

  V3f albedo() const { return V3f(1); }
  bool through(const V3f& incoming) const { return dot(incoming, frame_.geometric) < 0; }

  V3f value(const V3f& incoming, float& pdf) const {
    pdf = 0;
    const V3f i = frame_.local(incoming);
    if (i.z == 0 || !frame_.agrees(incoming, i.z)) return V3f(0);
    return V3f(i.z > 0 ? reflected(i, pdf) : refracted(i, pdf));
  }

  /// @param side  in [0, 1), chooses between the facet's two directions
  Scatter sample(const V2f& u, float side) const {
    Scatter out;
    const V3f h = ggx_.sample_normal(o_, u, 1);
    const float cos = std::min(dot(o_, h), 1.f), fresnel = fresnel_reflectance(cos, eta_);
    const bool reflect = side < fresnel;
    const V3f i = reflect ? h * (2 * cos) - o_ : refract_about(o_, h, cos, eta_);
    out.direction = normalized(frame_.basis.world(i));
    if (!(reflect ? i.z > 0 : i.z < 0) || !frame_.agrees(out.direction, i.z)) return out;
    const float density = ggx_.visible_density(o_, h, cos);
    out.pdf = reflect ? fresnel * density / (4 * cos) : (1 - fresnel) * density * spread(i, h, cos);
    out.weight = V3f(gain_ * ggx_.masking(o_, i) * std::abs(i.z) * (o_.z + ggx_.stretch(o_)) / 2);
    return out;
  }

 private:
  /// Solid angle of facets over that of refracted directions.
  float spread(const V3f& i, const V3f& h, float cos) const {
    const float cos_beyond = -dot(i, h), sum = cos - eta_ * cos_beyond;
    return eta_ * eta_ * cos_beyond / (sum * sum);
  }

  float reflected(const V3f& i, float& pdf) const {
    const V3f h = normalized(o_ + i);
    const float cos = std::min(dot(o_, h), 1.f), fresnel = fresnel_reflectance(cos, eta_);
    pdf = fresnel * ggx_.visible_density(o_, h, cos) / (4 * cos);
    return gain_ * fresnel * ggx_.density(h) * ggx_.masking(o_, i) * i.z / 4;
  }

  float refracted(const V3f& i, float& pdf) const {
    V3f h = normalized(o_ + i * eta_);
    if (h.z < 0) h = -h;
    const float cos = std::min(dot(o_, h), 1.f), cos_beyond = std::min(-dot(i, h), 1.f);
    if (!(cos > 0) || !(cos_beyond > 0)) return 0;
    const float transmitted = 1 - fresnel_reflectance(cos, cos_beyond, eta_),
                jacobian = spread(i, h, cos);
    pdf = transmitted * ggx_.visible_density(o_, h, cos) * jacobian;
    return gain_ * transmitted * ggx_.density(h) * ggx_.masking(o_, i) * -i.z * cos * jacobian;
  }

  FacingFrame frame_;
  Ggx ggx_;
  float eta_;
  V3f o_;
  float gain_ = 1;
};

}  // namespace drench::render
