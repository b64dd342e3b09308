#pragma once
// Guides rays under water towards lights above it. Light sampling cannot pass the surface, so only
// surface samples bring a lamp's light to what lies in water; here part of them is aimed as if the
// surface were level, with a spread for what waves do. An aimed ray is weighed by the density of
// the mixture, so the mean is that of unguided sampling whatever the surface looks like.

#include "render/bsdf/bsdf.h"
#include "render/light/lights.h"

namespace drench::render {

class RefractedLightGuide {
 public:
  enum class Aim { all, meshes };  // what photons do not bring is that of meshes alone

  /// @param ior  of the fluid
  RefractedLightGuide(const Lights& lights, float ior, Aim aim = Aim::all)
      : lights_(lights), ior_(ior), first_(aim == Aim::meshes ? lights.lamps() : 0) {}

  /// Fraction of the rays from `point` to aim, by what lamps and sky give there: 0 without lamps.
  float probability(const V3f& point) const;
  /// A direction in the water, with its density; density 0 if the draw leads nowhere.
  DirectionSample sample(const V3f& point, float u_light, const V2f& u) const;
  /// Density of `sample` for a unit direction in the water.
  float pdf(const V3f& point, const V3f& direction) const;

 private:
  struct Lobe {
    V3f axis;        // unit, in air
    float core = 0;  // 1 - cos of the angle that holds half of it
    float importance = 0;
  };
  size_t count() const { return lights_.lamps() + lights_.meshes().size(); }
  Lobe lobe(size_t light, const V3f& point) const;
  Lobe lobe_at(const V3f& to, float reach) const;
  float total_importance(const V3f& point) const;

  const Lights& lights_;
  float ior_;
  size_t first_;  // light to aim at
};

/// A direction drawn from a surface, or with probability `probability` from the guide. Its density
/// is the surface's own in either case, its weight that of the mixture.
template <class Bsdf>
Scatter sample_mixed(const Bsdf& bsdf, const RefractedLightGuide& guide, float probability,
                     const V3f& position, float u, const V2f& uv) {
  Scatter out;
  float guide_pdf = 0;
  if (u < probability) {
    const DirectionSample aimed = guide.sample(position, u / probability, uv);
    if (!(aimed.pdf > 0)) return {};
    out.direction = aimed.direction;
    guide_pdf = aimed.pdf;
  } else {
    out = bsdf.sample(uv);
    if (!(out.pdf > 0)) return {};
    guide_pdf = guide.pdf(position, out.direction);
  }
  const V3f value = bsdf.value(out.direction, out.pdf);
  if (!(out.pdf > 0)) return {};
  out.weight = value * (1 / (probability * guide_pdf + (1 - probability) * out.pdf));
  return out;
}

}  // namespace drench::render
