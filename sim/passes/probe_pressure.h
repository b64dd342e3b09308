#pragma once
// Pressures of a step as forces: on walls what the solver itself gave to the particles, inside the
// fluid the pair forces through a plane. Nothing here knows p but through q = p / rho^2, the
// FluidState::pressure_term that pushed the particles.

#include "sim/kernels.h"
#include "sim/parallel.h"
#include "sim/passes/density.h"
#include "sim/passes/pressure_rows.h"
#include "sim/periodic.h"
#include "sim/probe_query.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

template <int N>
struct Totals {
  double value[N] = {};
};
template <int N>
struct AddTotals {
  DRENCH_HD Totals<N> operator()(Totals<N> a, const Totals<N>& b) const {
    for (int k = 0; k < N; ++k) a.value[k] += b.value[k];
    return a;
  }
};
template <int N>
std::vector<double> to_vector(const Totals<N>& sum) {
  return {sum.value, sum.value + N};
}

/// What pushed the particles in the step just made, of either solver.
struct StepPressure {
  VecView position, velocity, acceleration;  // the last one weakly compressible only
  const float *term, *inverse_density;       // q; 1 / rho, weakly compressible only
  const Float4 *place, *wall;                // of the incompressible solver's solve, else null
  const Float4 *correction, *correction_cross;
  float dt, h, mass, rest_density, wall_viscosity, pair_scale;
  Walls walls;

  /// Where the particle was when it was pushed, m: the incompressible solver's prediction, or where
  /// the step started. (Near cloth, whose path test may have moved it, that is not exact.)
  DRENCH_HD Vec3<float> at(int i) const {
    if (place) return {place[i].x, place[i].y, place[i].z};
    return position[i] - velocity[i] * dt;
  }

  /// rho_0 times the gradient of the walls' share of density, kg/m^4: -q of it is the acceleration
  /// that walls give. See image_walls.h and PressureViscosity::wall_acceleration.
  DRENCH_HD Vec3<float> wall_gradient(int i) const {
    if (wall) return {wall[i].x, wall[i].y, wall[i].z};
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
    if (!place) return n;
    const Float4 v = multiply_symmetric(correction[i], correction_cross[i], {n.x, n.y, n.z, 0.f});
    return {v.x, v.y, v.z};
  }

  /// -W'(r) / r times m over rho_0 for a distance r, 1/m^2.
  DRENCH_HD float pair_weight(float r) const {
    const float u = max0(1.f - r / h);
    if (place) return pair_scale * WendlandC2::slope(u);
    return r > 0.f ? pair_scale * u * u * h / r : 0.f;
  }
};

inline StepPressure step_pressure_of(const State& state) {
  const Parameters& p = state.parameters;
  const FluidState& f = state.fluid;
  const bool projected = p.incompressible;
  const float h = p.support_radius, h4 = h * h * h * h;
  StepPressure s{f.position.view(),
                 f.velocity.view(),
                 f.acceleration.view(),
                 f.pressure_term.data(),
                 projected ? nullptr : f.inverse_density.data(),
                 projected ? state.pressure.place.data() : nullptr,
                 projected ? state.pressure.wall.data() : nullptr,
                 projected ? state.pressure.correction.data() : nullptr,
                 projected ? state.pressure.correction_cross.data() : nullptr,
                 float(state.dt),
                 h,
                 p.particle_mass,
                 p.rest_density,
                 p.wall_viscosity,
                 // As in pressure_rows.h; the spiky gradient is 45 / (pi h^6) (h - r)^2.
                 p.particle_mass / p.rest_density *
                     (projected ? 1.f / (p.lattice_sum * h4 * h) : 45.f / (pi * h4 * h)),
                 {}};
  s.walls.scale = p.wall_scale;
  for (int k = 0; k < 3; ++k)
    s.walls.low[k] = p.low[k], s.walls.high[k] = p.high[k], s.walls.on[k] = p.wall[k];
  return s;
}

struct Wall {
  int axis, side;  // 0 the low one, 1 the high one
};

/// Force of a particle on a wall, N: pressure along its normal, viscosity along the wall.
struct WallForce {
  StepPressure step;
  Wall wall;

  DRENCH_HD bool near(int i) const {
    const Vec3<float> p = step.at(i);
    const float x = wall.axis == 0 ? p.x : wall.axis == 1 ? p.y : p.z;
    return (step.walls.sign(wall.axis, x) > 0.f) == (wall.side == 0);
  }
  DRENCH_HD float normal(int i) const {
    if (!near(i)) return 0.f;
    const Vec3<float> g = step.wall_gradient(i);
    const float along = wall.axis == 0 ? g.x : wall.axis == 1 ? g.y : g.z;
    return step.mass * step.term[i] * along;
  }
  /// Of the weakly compressible fluid; what no-slip walls take from the other is not in it.
  DRENCH_HD float drag(int i) const {
    if (step.wall || step.wall_viscosity == 0.f || !near(i)) return 0.f;
    const Vec3<float> p = step.at(i);
    const float x[3] = {p.x, p.y, p.z};
    float share = step.rest_density;
    for (int k = 0; k < 3; ++k) {
      const float q = minimum(max0(step.walls.distance(k, x[k])) / step.h, 1.f);
      share *= k == wall.axis ? viscosity_halfspace(q) / (step.h * step.h)
                              : 1.f - step.walls.scale * spiky_halfspace(q);
    }
    const float inverse_rho = step.inverse_density[i];
    return step.mass * step.wall_viscosity * share * inverse_rho * inverse_rho;
  }
  DRENCH_HD Totals<3> operator()(int i) const {
    const float push = normal(i), pull = drag(i);
    Vec3<float> v{0.f, 0.f, 0.f};  // that the step started with
    if (pull > 0.f) v = step.velocity[i] - step.acceleration[i] * step.dt;
    return {{wall.axis == 0 ? push : pull * v.x, wall.axis == 1 ? push : pull * v.y,
             wall.axis == 2 ? push : pull * v.z}};
  }
};

/// The weight of a sensor: 1 on its disc, falling to 0 over a rim, because a particle's force is
/// spread over about a spacing.
struct SoftDisc {
  Vec3<float> centre, normal;
  float radius, rim;   // m; the weight falls from radius - rim to radius + rim
  Vec3<float> period;  // m; 0 where an axis is not periodic

  DRENCH_HD float across(Vec3<float> p) const {
    const Vec3<float> d = nearest(p - centre, period);
    const Vec3<float> flat = d - normal * dot(d, normal);
    return minimum(max0((radius + rim - length(flat)) / (2.f * rim)), 1.f);
  }
  DRENCH_HD float along(Vec3<float> p) const {
    return max0(1.f - fabsf(dot(nearest(p - centre, period), normal)) / rim);
  }
};

inline SoftDisc soft_disc_of(const ProbeQuery& q, const Parameters& p) {
  return {{q.place[0], q.place[1], q.place[2]},
          {q.normal[0], q.normal[1], q.normal[2]},
          q.radius,
          q.rim,
          periods_of(p)};
}

struct WallSensor {
  WallForce force;
  SoftDisc disc;
  DRENCH_HD Totals<1> operator()(int i) const {
    const float weight = disc.across(force.step.at(i));
    const float outward = force.wall.side == 0 ? -1.f : 1.f;
    return {{weight > 0.f ? double(weight) * outward * force.normal(i) : 0.}};
  }
};

/// The stress along the disc's normal n, times volumes: by virtual work a pressure p_i gives
/// p_i (m / rho_0) sum_j m / rho_0 (-W'/r) (x_ij . L n) (x_ij . n), what particle i has of the pair
/// forces through planes across n; 1 times p_i V_i in a continuum, 0.91 to 0.98 as packings are.
struct InnerSensor {
  StepPressure step;
  SoftDisc disc;
  GridView grid;

  DRENCH_HD float response(int i) const {
    const Vec3<float> x = step.at(i);
    const Vec3<float> n = disc.normal, corrected = step.corrected(i, n);
    const GridShape& g = grid.shape;
    float sum = 0.f;
    for_each_run(grid, g.cell_x(x.x), g.cell_y(x.y), g.cell_z(x.z),
                 [&](int begin, int end, Vec3<float> shift) {
                   const Vec3<float> seen = x - shift;
                   for (int j = begin; j < end; ++j) {
                     const Vec3<float> d = step.at(j) - seen;
                     sum += step.pair_weight(length(d)) * dot(d, corrected) * dot(d, n);
                   }
                 });
    const Vec3<float> s = step.wall_gradient(i);
    const float slope[3] = {s.x, s.y, s.z}, at[3] = {x.x, x.y, x.z}, e[3] = {n.x, n.y, n.z};
    for (int k = 0; k < 3; ++k) {
      const float distance = step.walls.distance(k, at[k]);
      if (distance < step.h)
        sum -= slope[k] / step.rest_density * e[k] * e[k] * distance * step.walls.sign(k, at[k]);
    }
    return sum;
  }
  DRENCH_HD Totals<1> operator()(int i) const {
    const Vec3<float> x = step.at(i);
    const float weight = disc.across(x) * disc.along(x);
    if (weight == 0.f) return {};
    return {{double(weight) * step.mass * step.rest_density * step.term[i] * response(i)}};
  }
};

}  // namespace drench::sim::DRENCH_BACKEND
