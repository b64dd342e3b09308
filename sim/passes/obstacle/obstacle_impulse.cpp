#include "sim/passes/obstacle/obstacle_impulse.h"

#include "sim/passes/obstacle/obstacle_density.h"

namespace drench::sim::DRENCH_BACKEND {

void add_obstacle_density(State& state) {
  const Parameters& p = state.parameters;
  const ConstVecView x = state.fluid.position.view();
  const ObstacleDensity law = obstacle_density_of(p);
  const ObstacleViews obstacles = state.obstacles.views();
  const float rest = p.rest_density;
  Float4* wall = state.pressure.wall.data();
  parallel_for(
      state.queue, "neighbours: obstacles", state.fluid.count, DRENCH_LAMBDA(int i) {
        for (int k = 0; k < obstacles.count; ++k) {
          const WallDensity share = law.of(obstacles.obstacle[k], x[i]);
          if (share.value == 0.f) continue;
          const Float4 w = wall[i];
          const WallDensity all =
              law.both({w.w / rest, {w.x / rest, w.y / rest, w.z / rest}}, share);
          wall[i] = {rest * all.gradient.x, rest * all.gradient.y, rest * all.gradient.z,
                     rest * all.value};
        }
      });
}

Impulse pressure_impulse(const State& state, int which) {
  const Parameters& p = state.parameters;
  const ObstacleDensity law = obstacle_density_of(p);
  const ImageWalls walls = image_walls_of(p);
  const ObstacleViews obstacles = state.obstacles.views();
  const Float4* place = state.pressure.place.data();
  const int* triangle = state.cloth.vertices > 0 ? state.fluid.triangle.data() : nullptr;
  const double factor = double(p.particle_mass) * p.rest_density / state.dt;
  return parallel_reduce(
      state.queue, "obstacle: impulse", state.fluid.count, Impulse{},
      DRENCH_LAMBDA(int i) {
        const Float4 at = place[i];
        const Vec3<float> x{at.x, at.y, at.z};
        if (triangle && triangle[i] >= 0) return Impulse{};
        Impulse sum;
        for (int image = 0; image < obstacles.count && at.w != 0.f; ++image) {
          if (obstacles.obstacle[image].of != which) continue;
          const WallDensity own = law.of(obstacles.obstacle[image], x);
          if (own.value == 0.f) continue;
          WallDensity others = walls.density(x);
          for (int k = 0; k < obstacles.count; ++k)
            if (k != image) others = law.both(others, law.of(obstacles.obstacle[k], x));
          sum = sum + times(own.gradient, factor * at.w * (1.f - others.value));
        }
        return sum;
      },
      Plus{});
}

Impulse pressure_impulse_near_cloth(const State& state, int which) {
  const Parameters& p = state.parameters;
  const ObstacleDensity law = obstacle_density_of(p);
  const ImageWalls walls = image_walls_of(p);
  const ObstacleViews obstacles = state.obstacles.views();
  const ClothRows c = cloth_rows(state);
  const ConstVecView normal = state.fluid.normal.view();
  const Float4* place = state.pressure.place.data();
  const double factor = double(p.particle_mass) * p.rest_density / state.dt;
  return parallel_reduce(
      state.queue, "obstacle: impulse near sheets", c.rows, Impulse{},
      DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        if (i < 0 || place[i].w == 0.f) return Impulse{};
        const Vec3<float> x{place[i].x, place[i].y, place[i].z}, n = normal[i];
        const float gap = c.gap[row];
        Impulse sum;
        for (int image = 0; image < obstacles.count; ++image) {
          if (obstacles.obstacle[image].of != which) continue;
          const WallDensity own = law.seen(obstacles.obstacle[image], x, n, gap, walls);
          if (own.value == 0.f) continue;
          WallDensity others = walls.density(x, n, gap);
          for (int k = 0; k < obstacles.count; ++k)
            if (k != image)
              others = law.both(others, law.seen(obstacles.obstacle[k], x, n, gap, walls));
          sum = sum + times(own.gradient, factor * place[i].w * c.open[row] * (1.f - others.value));
        }
        return sum;
      },
      Plus{});
}

Impulse tension_impulse(const State& state, int which) {
  MirrorImages images = mirror_images_of(state);
  images.cloth.cloth_velocity = state.cloth.next_velocity.view();  // the step has swapped them
  const auto force = tension_force(state, nullptr, Straight{});
  const double factor = double(force.scale) * state.parameters.particle_mass;
  return parallel_reduce(
      state.queue, "obstacle: tension", state.fluid.count, Impulse{},
      DRENCH_LAMBDA(int i) {
        Impulse impulse;
        const Mirrors mirrors = images.of(i);
        for (int k = 0; k < mirrors.count; ++k) {
          if (mirrors.mirror[k].of != which) continue;
          impulse = impulse + times(images.sum(i, mirrors, force).by[k], factor);
        }
        return impulse;
      },
      Plus{});
}

}  // namespace drench::sim::DRENCH_BACKEND
