#pragma once
// Domain walls of the incompressible fluid: mirrors. Beyond a wall lies the fluid's own image,
// which comes as near as the particle does: a particle at distance d misses the part of density
// that lies beyond 2 d - a/2, where the image's first layer begins; at d = a/2 that is the
// half-space beyond the wall itself. Its gradient is twice that of a standing half-space, which is
// what balances a uniform pressure on the first layer. With the standing half-space that layer
// gives way until it touches the wall, and a tenth of all particles carry nine tenths of the
// density error (docs/decisions/0006-mirror-walls.md).

#include "sim/backend/vec3.h"
#include "sim/neighbours/sph_kernels.h"
#include "sim/passes/motion/domain_walls.h"

namespace drench::sim::DRENCH_BACKEND {

struct WallDensity {
  float value;           // of the rest density
  Vec3<float> gradient;  // 1/m
};

struct ImageWalls : DomainWalls {
  float scale;      // makes a lattice that ends half a spacing before a wall whole
  float inverse_h;  // 1/m
  float spacing;    // m

  /// Where the image of a wall of an axis at `distance` m begins, over h; at most 1.
  DRENCH_HD float image(float distance, int axis) const {
    return on[axis] ? minimum((2.f * distance - 0.5f * spacing) * inverse_h, 1.f) : 1.f;
  }

  /// 1 where the foot on a wall lies before a sheet, 0 where it lies a fifth of a spacing behind.
  DRENCH_HD float seen(float behind) const {
    return 1.f - minimum(max0(behind) / (0.2f * spacing), 1.f);
  }

  /// Fraction of density that the walls around a point replace: 1 - prod(1 - H), so that edges and
  /// corners are not counted twice; H is the kernel's integral over the image, over h.
  DRENCH_HD WallDensity density(Vec3<float> p) const { return density(p, {0.f, 0.f, 0.f}, 0.f); }

  /// The same beside a sheet at `distance` m against its normal: a wall is not seen through it.
  DRENCH_HD WallDensity density(Vec3<float> p, Vec3<float> normal, float distance) const {
    const float x[3] = {p.x, p.y, p.z}, n[3] = {normal.x, normal.y, normal.z};
    float open[3], slope[3];
    for (int k = 0; k < 3; ++k) {
      const float to_low = x[k] - low[k], to_high = high[k] - x[k];
      const float below = image(to_low, k), above = image(to_high, k);
      const float seen_below = scale * seen(to_low * n[k] - distance),
                  seen_above = scale * seen(-to_high * n[k] - distance);
      open[k] = 1.f - seen_below * WendlandC2::halfspace(below) -
                seen_above * WendlandC2::halfspace(above);
      slope[k] = 2.f * inverse_h *
                 (seen_above * WendlandC2::plane(above) - seen_below * WendlandC2::plane(below));
    }
    return {
        1.f - open[0] * open[1] * open[2],
        {slope[0] * open[1] * open[2], slope[1] * open[2] * open[0], slope[2] * open[0] * open[1]}};
  }
};

inline ImageWalls image_walls_of(const Parameters& p) {
  return {domain_walls(p), p.wall_scale, 1.f / p.support_radius, p.spacing};
}

}  // namespace drench::sim::DRENCH_BACKEND
