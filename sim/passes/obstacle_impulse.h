#pragma once
// What obstacles received of pressure and surface tension in the step that was made, on demand.

#include "sim/passes/sheet_pressure.h"
#include "sim/passes/surface_tension.h"

namespace drench::sim::DRENCH_BACKEND {

struct Impulse {
  double x = 0, y = 0, z = 0;
  DRENCH_HD Impulse operator()(const Impulse& a, const Impulse& b) const {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
};

/// What pressure gave to one obstacle in the step that was made, kg m/s: the reaction to its part
/// of -D^T q (pressure_rows.h). Of particles that are not in the near list.
inline Impulse pressure_impulse(const State& state, int which) {
  const Parameters& p = state.parameters;
  const ObstacleShare law = obstacle_share_of(p);
  const ImageWalls walls = image_walls_of(p);
  const ObstacleViews obstacles = state.obstacles.views();
  const Float4* place = state.pressure.place.data();
  const int* triangle = state.cloth.vertices > 0 ? state.fluid.triangle.data() : nullptr;
  const double factor = double(p.particle_mass) * p.rest_density / state.dt;
  return parallel_reduce(
      "obstacle: impulse", state.fluid.count, Impulse{},
      DRENCH_LAMBDA(int i) {
        const Float4 at = place[i];
        const Vec3<float> x{at.x, at.y, at.z};
        if (triangle && triangle[i] >= 0) return Impulse{};
        const WallShare own = law.of(obstacles.obstacle[which], x);
        if (at.w == 0.f || own.value == 0.f) return Impulse{};
        WallShare others = walls.share(x);
        for (int k = 0; k < obstacles.count; ++k)
          if (k != which) others = law.both(others, law.of(obstacles.obstacle[k], x));
        const double push = factor * at.w * (1.f - others.value);
        return Impulse{push * own.gradient.x, push * own.gradient.y, push * own.gradient.z};
      },
      Impulse{});
}

/// The same of those that are.
inline Impulse pressure_impulse_near_sheets(const State& state, int which) {
  const Parameters& p = state.parameters;
  const ObstacleShare law = obstacle_share_of(p);
  const ImageWalls walls = image_walls_of(p);
  const ObstacleViews obstacles = state.obstacles.views();
  const SheetRows c = sheet_rows(state);
  const VecView normal = state.fluid.normal.view();
  const Float4* place = state.pressure.place.data();
  const double factor = double(p.particle_mass) * p.rest_density / state.dt;
  return parallel_reduce(
      "obstacle: impulse near sheets", c.rows, Impulse{},
      DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        if (i < 0 || place[i].w == 0.f) return Impulse{};
        const Vec3<float> x{place[i].x, place[i].y, place[i].z}, n = normal[i];
        const WallShare own = law.seen(obstacles.obstacle[which], x, n, c.gap[row], walls);
        if (own.value == 0.f) return Impulse{};
        WallShare others = walls.share(x, n, c.gap[row]);
        for (int k = 0; k < obstacles.count; ++k) {
          if (k != which)
            others = law.both(others, law.seen(obstacles.obstacle[k], x, n, c.gap[row], walls));
        }
        const double push = factor * place[i].w * c.open[row] * (1.f - others.value);
        return Impulse{push * own.gradient.x, push * own.gradient.y, push * own.gradient.z};
      },
      Impulse{});
}

/// What surface tension gave to one obstacle in the step that was made, kg m/s.
inline Impulse tension_impulse(const State& state, int which) {
  MirrorImages images = mirror_images_of(state);
  images.sheets.cloth_velocity = state.cloth.next_velocity.view();  // the step has swapped them
  const auto force = tension_force(state, nullptr, Straight{});
  const double factor = double(force.scale) * state.parameters.particle_mass;
  return parallel_reduce(
      "obstacle: tension", state.fluid.count, Impulse{},
      DRENCH_LAMBDA(int i) {
        Impulse impulse;
        const Mirrors mirrors = images.of(i);
        for (int k = 0; k < mirrors.count; ++k) {
          if (mirrors.mirror[k].of != which) continue;
          const Vec3<float> s = images.sum(i, mirrors, force).by[k];
          impulse = {factor * s.x, factor * s.y, factor * s.z};
        }
        return impulse;
      },
      Impulse{});
}

}  // namespace drench::sim::DRENCH_BACKEND
