#pragma once
// A diffuse surface under a clear coat, as paint, glaze and varnish are: two lobes, each sampled by
// itself. What the coat does not reflect enters, is reflected diffusely, and from within again and
// again by the coat; what comes out leaves as it could have come in. With R the coat's reflectance
// from a direction, <R> its mean outside and k2 its mean inside,
//   base = reflectance' / pi (1 - R(o)) (1 - R(i)) / (1 - <R>)
//   reflectance' = (1 - k2) reflectance / (1 - k2 reflectance),  1 - k2 = (1 - <R>) / eta^2
// the last two being Saunderson's correction and reciprocity (Saunderson 1942; Kelemen and
// Szirmay-Kalos 2001 for the product). A white base returns 1 - R(o), so all with the coat's R(o).
// A sheet that lets light through has the coat on both sides, and what either reflects back goes
// through again: with s the formula above of reflectance + transmittance and d that of reflectance
// - transmittance, its two are (s + d) / 2 and (s - d) / 2.

#include "render/bsdf/albedo_table.h"
#include "render/bsdf/bsdf_cloth.h"
#include "render/bsdf/bsdf_dielectric.h"
#include "render/bsdf/microfacet.h"

namespace drench::render {

/// A lobe's `probability` is that of the loop sampling it, which density and weight hold.
class CoatLobe {
 public:
  CoatLobe(const GgxReflection& facets, float eta, float gain, float probability)
      : facets_(facets), eta_(eta), gain_(gain), probability_(probability) {}

  V3f value(const V3f& incoming, float& pdf) const {
    const GgxReflection::Facet facet = facets_.value(incoming);
    pdf = facet.pdf * probability_;
    return V3f(gain_ * fresnel_reflectance(facet.cos_facet, eta_) * facet.value);
  }

  Scatter sample(const V2f& u) const {
    const GgxReflection::Facet facet = facets_.sample(u);
    const float fresnel = fresnel_reflectance(facet.cos_facet, eta_);
    return {facet.direction, V3f(gain_ * fresnel * facet.value / probability_),
            facet.pdf * probability_};
  }

 private:
  GgxReflection facets_;
  float eta_, gain_, probability_;
};

class CoatedBase {
 public:
  /// @param entering  fraction of `outgoing`'s light that the coat lets in, over 1 - <R>
  CoatedBase(const ClothBsdf& diffuse, const V3f& normal, const AlbedoTable& coat, float entering,
             float probability)
      : diffuse_(diffuse),
        normal_(normal),
        coat_(coat),
        entering_(entering),
        probability_(probability) {}

  V3f value(const V3f& incoming, float& pdf) const {
    const V3f value = diffuse_.value(incoming, pdf);
    pdf *= probability_;
    return value * through(incoming);
  }

  Scatter sample(const V2f& u) const {
    Scatter out = diffuse_.sample(u);
    out.weight *= through(out.direction) / probability_;
    out.pdf *= probability_;
    return out;
  }

  void receive(Irradiance& light, const V3f& incoming, const V3f& power) const {
    diffuse_.receive(light, incoming, power * through(incoming));
  }
  V3f radiance(const Irradiance& light) const { return diffuse_.radiance(light); }

 private:
  float through(const V3f& incoming) const {
    const AlbedoTable::Albedo coat = coat_.at(std::abs(dot(incoming, normal_)));
    return entering_ * (1 - coat.reflected / coat.total);
  }

  ClothBsdf diffuse_;
  V3f normal_;
  const AlbedoTable& coat_;
  float entering_, probability_;
};

class CoatedBsdf {
 public:
  /// @param eta   index of the coat over that of what lies on it
  /// @param coat  of the same alpha and eta
  /// @param transmittance  of the base, a sheet with a coat on either side
  CoatedBsdf(const V3f& outgoing, const V3f& geometric, const V3f& shading, float alpha, float eta,
             const V3f& reflectance, const AlbedoTable& coat, const V3f& transmittance = V3f(0))
      : outgoing_(outgoing),
        geometric_(geometric * (dot(outgoing, geometric) < 0 ? -1.f : 1.f)),
        facets_(outgoing, geometric, shading, alpha),
        eta_(eta),
        coat_(coat) {
    const AlbedoTable::Albedo table = coat.at(facets_.cos());
    gain_ = 1 / table.total;
    const float reflected = table.reflected * gain_;
    const float out = std::min((1 - coat.mean_reflected()) / (eta * eta), 1.f);  // 1 - k2
    entering_ = (1 - reflected) / (1 - coat.mean_reflected());
    const auto leaving = [out](float total) { return total * out / (1 - (1 - out) * total); };
    for (int k = 0; k < 3; ++k) {
      const float sum = leaving(reflectance[k] + transmittance[k]),
                  difference = leaving(reflectance[k] - transmittance[k]);
      base_reflectance_[k] = 0.5f * (sum + difference);
      base_transmittance_[k] = 0.5f * (sum - difference);
    }
    const V3f base = base_reflectance_ + base_transmittance_;
    albedo_ = V3f(reflected) + base * (1 - reflected);
    // A coat reflects little, but what it shows are lamps: it is looked at a quarter of the time.
    const float diffuse = largest(base) * (1 - reflected);
    coat_probability_ = diffuse > 0 ? std::max(reflected / (reflected + diffuse), 0.25f) : 1;
    reflected_ = reflected;
  }

  V3f albedo() const { return albedo_; }
  float coat_probability() const { return coat_probability_; }
  float reflected() const { return reflected_; }  // by the coat
  CoatLobe coat() const { return coat(coat_probability_); }
  CoatedBase base() const { return base(1 - coat_probability_); }
  /// With another probability of the loop sampling the lobe.
  CoatLobe coat(float probability) const { return {facets_, eta_, gain_, probability}; }
  CoatedBase base(float probability) const {
    const ClothBsdf diffuse(outgoing_, geometric_, facets_.normal(), base_reflectance_,
                            base_transmittance_);
    return {diffuse, facets_.normal(), coat_, entering_, probability};
  }

 private:
  V3f outgoing_, geometric_;
  GgxReflection facets_;
  float eta_, gain_ = 1, entering_ = 1, reflected_ = 0, coat_probability_ = 1;
  V3f albedo_, base_reflectance_, base_transmittance_;
  const AlbedoTable& coat_;
};

}  // namespace drench::render
