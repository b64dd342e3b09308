#pragma once
// Pressures of a step as forces: what the solver itself gave to the particles, by the body that
// gave it. Nothing here knows p but through q = p / rho^2, the FluidState::pressure_term that
// pushed the particles.
//
// Walls, obstacles and sheets each replace a fraction of a particle's density and leave the rest to
// the others (image_walls.h, obstacle_density.h, contact_incompressible.h): S = 1 - prod (1 - S_b).
// The part of body b in grad S is grad S_b times what the others leave. The parts sum to the whole,
// so that every push is counted once, on the body that gave it, whatever else touches the fluid
// there.

#include "sim/backend/parallel.h"
#include "sim/neighbours/periodic.h"
#include "sim/neighbours/sph_kernels.h"
#include "sim/passes/coupling/contact_incompressible.h"
#include "sim/passes/wcsph/density.h"
#include "sim/probe_query.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

template <int N>
struct Totals {
  double value[N] = {};
  DRENCH_HD Totals operator+(const Totals& other) const {
    Totals sum;
    for (int k = 0; k < N; ++k) sum.value[k] = value[k] + other.value[k];
    return sum;
  }
};
template <int N>
std::vector<double> to_vector(const Totals<N>& sum) {
  return {sum.value, sum.value + N};
}

/// What pushed the particles in the step just made, of either solver.
struct StepPressure {
  ConstVecView position, velocity, acceleration;  // the last one weakly compressible only
  const float *term, *inverse_density;            // q; 1 / rho, weakly compressible only
  const Float4* predicted;                        // of the incompressible solver's solve, else null
  const Float4 *correction, *correction_cross;
  float dt, h, mass, rest_density, wall_viscosity, pair_scale;
  HalfspaceWalls walls;

  /// Where the particle was when it was pushed, m: the incompressible solver's prediction, or where
  /// the step started. (Not exact near cloth, where a collision may have moved it.)
  DRENCH_HD Vec3<float> at(int i) const {
    if (predicted) return {predicted[i].x, predicted[i].y, predicted[i].z};
    return position[i] - velocity[i] * dt;
  }

  /// rho_0 times the gradient of the walls' fraction of density, kg/m^4: -q of it is the
  /// acceleration that walls give in the weakly compressible fluid. See
  /// PressureViscosity::wall_acceleration.
  DRENCH_HD Vec3<float> wall_gradient(int i) const {
    const Vec3<float> p = at(i);
    const float x[3] = {p.x, p.y, p.z};
    float open[3], slope[3];
    for (int k = 0; k < 3; ++k) {
      const float q = minimum(max0(walls.distance(k, x[k])) / h, 1.f);
      open[k] = 1.f - walls.scale * spiky_halfspace(q);
      slope[k] = -walls.sign(k, x[k]) * rest_density * spiky_plane(q) / h;
    }
    return {slope[0] * open[1] * open[2], slope[1] * open[2] * open[0],
            slope[2] * open[0] * open[1]};
  }

  /// L n, see gradient_correction.h.
  DRENCH_HD Vec3<float> corrected(int i, Vec3<float> n) const {
    if (!predicted) return n;
    const Float4 v = multiply_symmetric(correction[i], correction_cross[i], {n.x, n.y, n.z, 0.f});
    return {v.x, v.y, v.z};
  }

  /// -W'(r) / r times m over rho_0 for a distance r, 1/m^2.
  DRENCH_HD float pair_weight(float r) const {
    const float u = max0(1.f - r / h);
    if (predicted) return pair_scale * WendlandC2::slope(u);
    return r > 0.f ? pair_scale * u * u * h / r : 0.f;
  }
};

/// What a particle sees of the sheet that it is beside, where it was pushed.
struct Beside {
  Vec3<float> x, normal;  // m; unit, or zero: none
  float gap, open;        // m to the sheet's surface; fraction of the density that it leaves
};

/// A body's part in the gradient, kg/m^4, and the displacement from the particle to its surface, m.
struct BodyPart {
  Vec3<float> gradient{0.f, 0.f, 0.f}, to_surface{0.f, 0.f, 0.f};
};

DRENCH_HD float component(Vec3<float> v, int axis) {
  return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}
DRENCH_HD Vec3<float> along_axis(int axis, float v) {
  return {axis == 0 ? v : 0.f, axis == 1 ? v : 0.f, axis == 2 ? v : 0.f};
}

/// The parts of all bodies. Particles in the near list of sheets are asked for by their row, too
/// (sum_by_particle), others with row -1.
struct BodyParts {
  StepPressure step;
  ImageWalls image;
  ObstacleDensity law;
  ObstacleViews obstacles;
  ClothRows rows;
  ConstVecView normal;

  DRENCH_HD Beside beside(int i, int row) const {
    if (row < 0) return {step.at(i), {0.f, 0.f, 0.f}, 0.f, 1.f};
    return {step.at(i), normal[i], rows.gap[row], rows.open[row]};
  }
  DRENCH_HD float to_wall(const Beside& b, int axis, int side) const {
    const float x = component(b.x, axis);
    return side == 0 ? x - image.low[axis] : image.high[axis] - x;
  }
  DRENCH_HD float wall_seen(const Beside& b, int axis, int side) const {
    const float facing = side == 0 ? component(b.normal, axis) : -component(b.normal, axis);
    return image.scale * image.seen(to_wall(b, axis, side) * facing - b.gap);
  }
  DRENCH_HD float open_axis(const Beside& b, int axis) const {
    float open = 1.f;
    for (int side = 0; side < 2; ++side)
      open -= wall_seen(b, axis, side) *
              WendlandC2::halfspace(image.image(to_wall(b, axis, side), axis));
    return open;
  }
  DRENCH_HD float open_walls(const Beside& b) const {
    return open_axis(b, 0) * open_axis(b, 1) * open_axis(b, 2);
  }
  DRENCH_HD float open_obstacles(const Beside& b, int but) const {
    float open = 1.f;
    for (int k = 0; k < obstacles.count; ++k)
      if (k != but)
        open *= 1.f - law.seen(obstacles.obstacle[k], b.x, b.normal, b.gap, image).value;
    return open;
  }

  /// Of one wall of the domain; what is stopped at a distance below zero counts as on it.
  DRENCH_HD BodyPart wall(int i, const Beside& b, int axis, int side) const {
    if (!image.on[axis]) return {};
    const float distance = to_wall(b, axis, side);
    if (!(distance < step.h)) return {};
    const Vec3<float> to_surface = along_axis(axis, side == 0 ? -max0(distance) : max0(distance));
    if (!step.predicted) {
      const bool near = (step.walls.sign(axis, component(b.x, axis)) > 0.f) == (side == 0);
      if (!near) return {};
      return {along_axis(axis, component(step.wall_gradient(i), axis)), to_surface};
    }
    const float begins = image.image(distance, axis);
    if (!(begins < 1.f)) return {};
    float slope = step.rest_density * 2.f * image.inverse_h * wall_seen(b, axis, side) *
                  WendlandC2::plane(begins) * b.open * open_obstacles(b, -1);
    for (int k = 0; k < 3; ++k)
      if (k != axis) slope *= open_axis(b, k);
    return {along_axis(axis, side == 0 ? -slope : slope), to_surface};
  }

  /// Of one obstacle, or image of it.
  DRENCH_HD BodyPart obstacle(const Beside& b, int which) const {
    const ObstacleView& o = obstacles.obstacle[which];
    const WallDensity own = law.seen(o, b.x, b.normal, b.gap, image);
    if (own.value == 0.f) return {};
    const float others = step.rest_density * b.open * open_walls(b) * open_obstacles(b, which);
    const Vec3<float> inside = o.to_own(1, b.x);
    const float distance = max0(o.distance(inside, o.blend[1]));
    return {own.gradient * others, o.turn(1, o.normal(inside, o.blend[1])) * -distance};
  }

  /// Of the sheet.
  DRENCH_HD BodyPart sheet(const Beside& b, int row) const {
    if (row < 0) return {};
    return {rows.gradient[row], b.normal * -minimum(max0(b.gap), step.h)};
  }
};

template <int N, class F>
struct AwayFromCloth {
  F f;
  const int* triangle;
  DRENCH_HD Totals<N> operator()(int i) const {
    return triangle && triangle[i] >= 0 ? Totals<N>{} : f(i, -1);
  }
};
template <int N, class F>
struct BesideClothOf {
  F f;
  const int* particle;
  DRENCH_HD Totals<N> operator()(int row) const {
    const int i = particle[row];
    return i < 0 ? Totals<N>{} : f(i, row);
  }
};

struct Wall {
  int axis, side;  // 0 the low one, 1 the high one
};

/// Force of a particle on a wall, N: pressure along its normal, viscosity along the wall.
struct WallForce {
  BodyParts parts;
  Wall wall;

  /// Of the weakly compressible fluid; what no-slip walls take from the other is not in it.
  DRENCH_HD float drag(int i) const {
    const StepPressure& step = parts.step;
    if (step.predicted || step.wall_viscosity == 0.f) return 0.f;
    const Vec3<float> p = step.at(i);
    const float x[3] = {p.x, p.y, p.z};
    if ((step.walls.sign(wall.axis, x[wall.axis]) > 0.f) != (wall.side == 0)) return 0.f;
    float layer = step.rest_density;
    for (int k = 0; k < 3; ++k) {
      const float q = minimum(max0(step.walls.distance(k, x[k])) / step.h, 1.f);
      layer *= k == wall.axis ? viscosity_halfspace(q) / (step.h * step.h)
                              : 1.f - step.walls.scale * spiky_halfspace(q);
    }
    const float inverse_rho = step.inverse_density[i];
    return step.mass * step.wall_viscosity * layer * inverse_rho * inverse_rho;
  }
  DRENCH_HD Totals<3> operator()(int i, int row) const {
    const StepPressure& step = parts.step;
    const BodyPart part = parts.wall(i, parts.beside(i, row), wall.axis, wall.side);
    const Vec3<float> push = part.gradient * (step.mass * step.term[i]);
    const float pull = drag(i);
    Vec3<float> v{0.f, 0.f, 0.f};  // that the step started with
    if (pull > 0.f) v = step.velocity[i] - step.acceleration[i] * step.dt;
    return {{wall.axis == 0 ? push.x : pull * v.x, wall.axis == 1 ? push.y : pull * v.y,
             wall.axis == 2 ? push.z : pull * v.z}};
  }
};

}  // namespace drench::sim::DRENCH_BACKEND
