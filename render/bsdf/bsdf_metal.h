#pragma once
// Metal: GGX facets that reflect as Schlick's formula with a colour of its own near grazing says.

#include "render/bsdf/albedo_table.h"
#include "render/bsdf/microfacet.h"

namespace drench::render {

/// F82-tint: Schlick's reflectance less a bump whose peak, at a cosine of 1/7 (82 degrees), takes
/// it to `edge` of Schlick's there. Kutz, Hasan, Edmondson 2021, "Novel Aspects of the Adobe
/// Standard Material".
struct MetalFresnel {
  V3f normal;  // reflectance facing it
  V3f bump;

  MetalFresnel(const V3f& facing, const V3f& edge) : normal(facing), bump(0) {
    constexpr float cos = 1.f / 7, c = 6.f / 7, c2 = c * c, peak = cos * c2 * c2 * c2;
    for (int k = 0; k < 3; ++k)
      bump[k] = (normal[k] + (1 - normal[k]) * c2 * c2 * c) * (1 - edge[k]) / peak;
  }

  V3f at(float cos) const {
    const float c = 1 - std::min(cos, 1.f), c2 = c * c, c5 = c2 * c2 * c;
    V3f out;
    for (int k = 0; k < 3; ++k)
      out[k] = std::clamp(normal[k] + (1 - normal[k]) * c5 - bump[k] * cos * c5 * c, 0.f, 1.f);
    return out;
  }

  /// Over 2 cos dcos: 2 cos (1 - cos)^5 has the integral 1/21, 2 cos^2 (1 - cos)^6 has 1/126.
  V3f mean() const {
    V3f out;
    for (int k = 0; k < 3; ++k)
      out[k] = std::clamp(normal[k] + (1 - normal[k]) / 21 - bump[k] / 126, 0.f, 1.f);
    return out;
  }
};

class MetalBsdf {
 public:
  /// @param albedo  `mirrors` of the same alpha
  MetalBsdf(const V3f& outgoing, const V3f& geometric, const V3f& shading, float alpha,
            const MetalFresnel& fresnel, const AlbedoTable& albedo)
      : facets_(outgoing, geometric, shading, alpha), fresnel_(fresnel), gain_(1) {
    // Light that does not get out meets another facet, loses the mean there, and so on; a fraction
    // of `mean_total` leaves each time. Over what one facet sends back.
    const float single = albedo.at(facets_.cos()).total, leaves = albedo.mean_total();
    const V3f mean = fresnel.mean();
    for (int k = 0; k < 3; ++k)
      gain_[k] += (1 - single) / single * mean[k] * leaves / (1 - mean[k] * (1 - leaves));
    albedo_ = fresnel.at(facets_.cos()) * (gain_ * single);
  }

  V3f albedo() const { return albedo_; }

  V3f value(const V3f& incoming, float& pdf) const {
    const GgxReflection::Facet facet = facets_.value(incoming);
    pdf = facet.pdf;
    return fresnel_.at(facet.cos_facet) * gain_ * facet.value;
  }

  Scatter sample(const V2f& u) const {
    const GgxReflection::Facet facet = facets_.sample(u);
    return {facet.direction, fresnel_.at(facet.cos_facet) * gain_ * facet.value, facet.pdf};
  }

 private:
  GgxReflection facets_;
  MetalFresnel fresnel_;
  V3f gain_, albedo_;
};

}  // namespace drench::render
