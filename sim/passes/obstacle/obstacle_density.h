#pragma once
// Obstacles in the density: mirrors, as domain walls are (image_walls.h). Beyond the surface lies
// the fluid's image, which begins at 2 d - a/2 from a particle at distance d: inside the surface
// moved in by d - a/2. Of a sphere that is a concentric one, whose share of the kernel is, with D
// the image's distance and k one over the distance to the centre, both in supports,
//   S = (1 - k D) H(D) - k N(D) / 2,    H = halfspace, N = moment,
// from cutting shells r < 1 by the ball: a share (r - D) (2 / k - D - r) k / (4 r) of each lies in
// it. k is half the divergence of the normal, which is how a level set has it too; a concave
// surface has k < 0. A half-space (k = 0) overrates a sphere of 3 spacings by 29 %
// (docs/benchmarks). A box takes the half-spaces of its three nearest faces, moved in alike, as
// a product, which is exact on faces and, by symmetry, on edges and corners.

#include "sim/passes/obstacle/obstacle_distance.h"
#include "sim/passes/pressure/image_walls.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

struct ObstacleDensity {
  float scale, inverse_h, spacing;  // as ImageWalls

  /// Farthest that a surface counts, m.
  DRENCH_HD float reach() const { return 0.5f / inverse_h + 0.25f * spacing; }

  /// @param normal  unit. @param curvature  half its divergence, 1/m.
  DRENCH_HD WallDensity curved(float distance, Vec3<float> normal, float curvature) const {
    constexpr float sharpest = 2.f;  // edges of level sets; a sphere of half a spacing
    const float D = (2.f * distance - 0.5f * spacing) * inverse_h;
    if (D >= 1.f) return {0.f, {0.f, 0.f, 0.f}};
    const float k = maximum(minimum(curvature / inverse_h, sharpest), -sharpest);
    const float H = WendlandC2::halfspace(D), N = WendlandC2::moment(D);
    const float value = (1.f - k * D) * H - 0.5f * k * N;
    const float slope = k * k * (D * H + 0.5f * N) - 2.f * (1.f - k * D) * WendlandC2::plane(D);
    if (value <= 0.f || slope >= 0.f) return {0.f, {0.f, 0.f, 0.f}};  // an edge, far off
    return {scale * value, normal * (scale * slope * inverse_h)};
  }

  DRENCH_HD WallDensity box(Vec3<float> own, const float (&half)[3]) const {
    const BoxDistance to(own, half);
    const float x[3] = {own.x, own.y, own.z}, n[3] = {to.normal.x, to.normal.y, to.normal.z};
    float H[3], P[3], g[3];
    for (int k = 0; k < 3; ++k) {
      const float q = (to.beyond[k] + to.distance - 0.5f * spacing) * inverse_h;
      H[k] = WendlandC2::halfspace(q);
      P[k] = WendlandC2::plane(q);
    }
    const float by_face[3] = {P[0] * H[1] * H[2], H[0] * P[1] * H[2], H[0] * H[1] * P[2]};
    const float moved = by_face[0] + by_face[1] + by_face[2];
    for (int k = 0; k < 3; ++k)
      g[k] = -scale * inverse_h * (sign_of(x[k]) * by_face[k] + n[k] * moved);
    return {scale * H[0] * H[1] * H[2], {g[0], g[1], g[2]}};
  }

  /// From seven samples of the distance, one voxel apart.
  DRENCH_HD WallDensity field(const ObstacleView& o, Vec3<float> own) const {
    const float mix = o.blend[1], d = o.distance(own, mix), e = o.field[0].voxel;
    if (d >= reach()) return {0.f, {0.f, 0.f, 0.f}};
    const auto [rise, sum] = o.central_differences(own, e, mix);
    const float size = length(rise);
    if (size == 0.f) return {0.f, {0.f, 0.f, 0.f}};
    const float divergence = (sum - 6.f * d) / (e * e);
    return curved(d, rise * (1.f / size), 0.5f * divergence);
  }

  /// Share of density that one obstacle, where it ends the step, replaces at x.
  DRENCH_HD_CALL WallDensity of(const ObstacleView& o, Vec3<float> x) const {
    if (!o.near_path(x, x, reach())) return {0.f, {0.f, 0.f, 0.f}};
    const Vec3<float> own = o.to_own(1, x);
    WallDensity share{};
    if (o.shape == ObstacleShape::plane) share = curved(own.y, {0.f, 1.f, 0.f}, 0.f);
    if (o.shape == ObstacleShape::sphere) {
      const float r = length(own), inverse = r > 0.f ? 1.f / r : 0.f;
      share = curved(r - o.half[0], own * inverse, inverse);
    }
    if (o.shape == ObstacleShape::box) share = box(own, o.half);
    if (o.shape == ObstacleShape::field) share = field(o, own);
    share.gradient = o.turn(1, share.gradient);
    return share;
  }

  /// The same beside a sheet at `distance` m against its normal, as ImageWalls::share: not seen
  /// through it.
  DRENCH_HD WallDensity seen(const ObstacleView& o, Vec3<float> x, Vec3<float> cloth_normal,
                             float distance, const ImageWalls& walls) const {
    const WallDensity share = of(o, x);
    if (share.value == 0.f) return share;
    const Vec3<float> own = o.to_own(1, x), n = o.turn(1, o.normal(own, o.blend[1]));
    const float shown = walls.seen(o.distance(own, o.blend[1]) * dot(n, cloth_normal) - distance);
    return {share.value * shown, share.gradient * shown};
  }

  /// Both replace density: 1 - (1 - S)(1 - S'), as walls among themselves.
  static DRENCH_HD WallDensity both(WallDensity a, WallDensity b) {
    return {1.f - (1.f - a.value) * (1.f - b.value),
            a.gradient * (1.f - b.value) + b.gradient * (1.f - a.value)};
  }
  /// Walls and all obstacles together at x.
  DRENCH_HD WallDensity with(WallDensity walls, const ObstacleViews& obstacles,
                             Vec3<float> x) const {
    for (int k = 0; k < obstacles.count; ++k) {
      const WallDensity share = of(obstacles.obstacle[k], x);
      if (share.value != 0.f) walls = both(walls, share);
    }
    return walls;
  }
};

inline ObstacleDensity obstacle_density_of(const Parameters& p) {
  return {p.wall_scale, 1.f / p.support_radius, p.spacing};
}

/// Adds obstacles to what find_neighbours has of the walls.
void add_obstacle_density(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
