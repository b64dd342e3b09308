#pragma once
// Rays that must not leave a closed body.

#include "render/sampler.h"
#include "render/sampling.h"
#include "render/scene/scene.h"

namespace drench::render::test {

/// Whether one of a chain of rays, each from where the last arrived back into the body, is lost: it
/// meets nothing, or a face from without.
inline bool loses_ray(const Scene& scene, const V3f& start, uint32_t chain, int length) {
  const FlushDenormals flush;
  Ray ray{start, {0, 0, 0}, 0};
  V3f side(0);
  for (int k = 0; k < length; ++k) {
    const uint32_t bits = hash_bits(chain * 0x9e3779b9u + uint32_t(k));
    ray.direction = sample_cone({unit_float(bits), unit_float(hash_bits(bits))}, 2);
    if (dot(ray.direction, side) > 0) ray.direction = -ray.direction;
    const Hit hit = scene.intersect(ray, Coherence::incoherent);
    if (hit.kind != Hit::Kind::object) return true;
    const Surface surface = scene.surface(ray, hit);
    if (!(dot(ray.direction, surface.geometric_normal) >= 0)) return true;
    side = surface.geometric_normal;
    ray.origin = surface.leave(-side);
  }
  return false;
}

}  // namespace drench::render::test
