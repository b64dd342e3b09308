#include "tests/validation/coupled.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/sim/support.h"

namespace drench::validation {

using namespace sim_tests;

namespace {

constexpr double width = 0.3, depth = 0.1, gravity = 9.81, density = 1000;  // m, m, m/s^2, kg/m^3

Shot pool_on_sheet(int across, double areal_density, ClothModel model) {
  const double a = width / across;
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -gravity, 0);
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.spacing = a;
  shot.domain.min = V3d(-width / 2, -0.5, -width / 2);
  shot.domain.max = V3d(width / 2, 0.5, width / 2);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  Cloth& sheet = add_sheet(shot, width, 0, across);
  make_light_cotton(sheet, model, areal_density);
  pin_edges(sheet);
  add_box(shot, V3d(-width / 2, sheet.thickness / 2, -width / 2),
          {across, int(std::lround(depth / a)), across});
  return shot;
}

/// A sheet under its weight and the pressure of water that fills it to a level, in double, brought
/// to rest by kinetic damping. Flat and level at the start, where it has no stress.
class StaticSheet {
 public:
  StaticSheet(const sim::Scene& scene, double volume, ClothModel model)
      : t_(scene.cloth), volume_(volume), thickness_(2 * t_.half_thickness[0]), model_(model) {
    for (int v = 0; v < t_.vertices(); ++v) x_.push_back(at(scene.start.cloth_position, v));
    rest_ = x_, floor_ = x_[0].y;
  }
  /// m, of the deepest vertex under the pins.
  double sag() {
    std::vector<V3d> velocity(x_.size(), V3d(0));
    // N/m, four times the bound of a flat lattice
    const double stiffest = 16 * (adjacent + diagonal);
    double last = 0;
    for (int step = 0; step < 40000; ++step) {
      const std::vector<V3d> f = forces();
      double energy = 0, left = 0;
      for (size_t v = 0; v < x_.size(); ++v) {
        if (t_.inverse_mass[v] == 0) continue;
        velocity[v] += f[v] / stiffest, x_[v] += velocity[v];
        energy += velocity[v].length2(), left = std::max(left, f[v].length());
      }
      if (energy < last) velocity.assign(x_.size(), V3d(0)), energy = 0;
      last = energy;
      if (step > 100 && left < 1e-7) break;
    }
    double lowest = floor_;
    for (const V3d& x : x_) lowest = std::min(lowest, x.y);
    return floor_ - lowest;
  }

 private:
  std::vector<V3d> forces() const {
    std::vector<V3d> f(x_.size(), V3d(0));
    for (size_t v = 0; v < x_.size(); ++v) f[v].y -= t_.mass[v] * gravity;
    model_ == ClothModel::shell ? add_stress(f) : add_springs(f);
    // The water stands between the sheet's upper side and the level, which its volume gives.
    double area = 0, below = 0;
    for (int t = 0; t < t_.triangles(); ++t) {
      const V3d n = normal(t);
      area += std::abs(n.y), below += std::abs(n.y) * height(t);
    }
    const double level = (volume_ + below) / area;
    for (int t = 0; t < t_.triangles(); ++t) {
      const V3d n = normal(t), push = n * (n.y > 0 ? -1. : 1.) * density * gravity / 3;
      for (int k = 0; k < 3; ++k) f[t_.corner[3 * t + k]] += push * (level - height(t));
    }
    return f;
  }
  void add_springs(std::vector<V3d>& f) const {
    for (size_t v = 0; v < x_.size(); ++v) {
      for (int k = t_.spring_start[v]; k < t_.spring_start[v + 1]; ++k) {
        const V3d d = x_[t_.spring_end[k]] - x_[v];
        f[v] += d * (t_.stiffness[k] * (1 - t_.rest_length[k] / d.length()));
      }
    }
  }
  /// Linear triangles whose second Piola-Kirchhoff stress is linear in Green's strain.
  void add_stress(std::vector<V3d>& f) const {
    for (int t = 0; t < t_.triangles(); ++t) {
      const int* c = &t_.corner[3 * t];
      const V3d r1 = rest_[c[1]] - rest_[c[0]], r2 = rest_[c[2]] - rest_[c[0]];
      const V3d e1 = x_[c[1]] - x_[c[0]], e2 = x_[c[2]] - x_[c[0]];
      const double twice = r1.x * r2.z - r2.x * r1.z;  // m^2, of its area, with a sign
      // of the barycentric coordinates of corners 1 and 2
      const double x1 = r2.z / twice, z1 = -r2.x / twice, x2 = -r1.z / twice, z2 = r1.x / twice;
      const V3d p = e1 * x1 + e2 * x2, q = e1 * z1 + e2 * z2;  // d place / dx, dz
      const double xx = (p.length2() - 1) / 2, zz = (q.length2() - 1) / 2, xz = p.dot(q) / 2;
      const double c11 = young / (1 - poisson * poisson), c12 = poisson * c11;
      const double sx = c11 * xx + c12 * zz, sz = c12 * xx + c11 * zz, sxz = (c11 - c12) * xz;
      const V3d along_x = p * sx + q * sxz, along_z = p * sxz + q * sz;
      const V3d f1 = (along_x * x1 + along_z * z1) * (std::abs(twice) / 2);
      const V3d f2 = (along_x * x2 + along_z * z2) * (std::abs(twice) / 2);
      f[c[0]] += f1 + f2, f[c[1]] -= f1, f[c[2]] -= f2;
    }
  }
  V3d corner(int t, int k) const { return x_[t_.corner[3 * t + k]]; }
  V3d normal(int t) const {  // m^2
    return (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)) * 0.5;
  }
  double height(int t) const {  // m, of the upper side
    return (corner(t, 0).y + corner(t, 1).y + corner(t, 2).y) / 3 + thickness_ / 2;
  }

  const sim::ClothTopology& t_;
  double volume_, thickness_, floor_ = 0;
  ClothModel model_;
  std::vector<V3d> x_, rest_;
};

/// Volume of water between the sheet and a level that has its centre of mass at `centre` m: with
/// heights s of the sheet, level L and means over the shaft, centre (L - <s>) = (L^2 - <s^2>) / 2.
double volume_above(const sim::Scene& scene, const sim::HostState& state, double centre) {
  double area = 0, sum = 0, square = 0;
  for (int t = 0; t < scene.cloth.triangles(); ++t) {
    V3d x[3];
    for (int k = 0; k < 3; ++k) x[k] = at(state.cloth_position, scene.cloth.corner[3 * t + k]);
    const double n = std::abs((x[1] - x[0]).cross(x[2] - x[0]).y) / 2;
    const double s = (x[0].y + x[1].y + x[2].y) / 3 + scene.cloth.half_thickness[t];
    area += n, sum += n * s, square += n * s * s;
  }
  const double mean = sum / area, root = centre * centre - 2 * centre * mean + square / area;
  const double level = centre + std::sqrt(std::max(root, 0.));
  return area * (level - mean);
}

}  // namespace

void make_light_cotton(Cloth& sheet, ClothModel model, double areal_density) {
  sheet.model = model, sheet.areal_density = areal_density, sheet.thickness = 1e-3;
  sheet.adjacent_stiffness = adjacent, sheet.diagonal_stiffness = diagonal;
  sheet.young_warp = sheet.young_weft = young, sheet.poisson = poisson;
  sheet.shear_modulus = diagonal;
  sheet.damping = 10;  // of its motion: at rest it makes no difference
}

PinnedPool pinned_pool(int across, double seconds, double areal_density, ClothModel model) {
  const Shot shot = pool_on_sheet(across, areal_density, model);
  Stepper run(shot);
  PinnedPool pool;
  pool.particles = int(run.scene.start.id.size());
  const double volume = pool.particles * std::pow(shot.fluid.spacing, 3);
  pool.static_sag = StaticSheet(run.scene, volume, model).sag();
  const double pinned = run.scene.start.cloth_position.y[0];
  double samples = 0;
  sim::HostState state;
  while (run.time < seconds - 1e-9) {
    run.step(std::min(run.stable_dt(), seconds - run.time));
    if (run.limits.bad_particle >= 0 || run.limits.bad_vertex >= 0) return pool;
    pool.iterations += double(run.limits.iterations),
        pool.sweeps += double(run.limits.sheet_sweeps);
    if (run.time < 0.75 * seconds) continue;
    state = run.solver->save();
    const auto& y = state.cloth_position.y;
    pool.sag += pinned - *std::min_element(y.begin(), y.end());
    ++samples;
  }
  pool.sag /= samples;
  pool.steps = run.steps, pool.iterations /= run.steps, pool.sweeps /= run.steps;
  double centre = 0, speed = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    centre += state.position.y[i] / double(state.id.size());
    speed += at(state.velocity, i).length2() / double(state.id.size());
  }
  pool.speed = std::sqrt(speed);
  pool.volume = volume_above(run.scene, state, centre) / volume - 1;
  return pool;
}

CoupledMomentum coupled_momentum(int across, int steps) {
  constexpr double speed = 1, size = 0.08;  // m/s, m
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = size / across;
  add_box(shot, V3d(-0.5 * size, 2 * shot.fluid.spacing, -0.5 * size), {across, across, across},
          V3d(0, -speed, 0));
  Cloth& sheet = add_sheet(shot, 0.2, 0, 2 * across);
  sheet.damping = 0, sheet.areal_density = 0.2;
  Stepper run(shot);
  const V3d before = total_momentum(run.scene, run.scene.start);
  CoupledMomentum result;
  result.particles = run.solver->particles();
  const double longest = 0.25 * shot.fluid.spacing / speed / 10;  // s: nothing leaves the domain
  for (int k = 0; k < steps; ++k) {
    run.step(std::min(run.stable_dt(), longest));
    const sim::HostState state = run.solver->save();
    const double scale = momentum_scale(run.scene, state, speed / std::sqrt(2.));
    result.drift =
        std::max(result.drift, (total_momentum(run.scene, state) - before).length() / scale);
    V3d sheets(0);
    for (size_t v = 0; v < state.cloth_velocity.size(); ++v)
      sheets += at(state.cloth_velocity, v) * double(run.scene.cloth.mass[v]);
    result.given = std::max(result.given, sheets.length());
  }
  return result;
}

}  // namespace drench::validation
