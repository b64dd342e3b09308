#pragma once
// Guides rays under water towards lights above it. Light sampling cannot pass the surface, so only
// surface samples bring a lamp's light to what lies in water; here part of them is aimed as if the
// surface were level, with a spread for what waves do. An aimed ray is weighed by the density of
// the mixture, so the mean is that of unguided sampling whatever the surface looks like.

#include "render/lights.h"

namespace drench {

class RefractedLightGuide {
 public:
  /// @param ior  of the fluid
  RefractedLightGuide(const Lights& lights, float ior) : lights_(lights), ior_(ior) {}

  /// Share of the rays from `point` to aim, by what lamps and sky give there: 0 without lamps.
  float share(const V3f& point) const;
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
  size_t count() const { return lights_.shapes().size() + lights_.suns().size(); }
  Lobe lobe(size_t light, const V3f& point) const;
  float total_importance(const V3f& point) const;

  const Lights& lights_;
  float ior_;
};

}  // namespace drench
