#include "tests/validation/curtain.h"

#include <algorithm>
#include <cmath>

#include "tests/sim/support.h"

namespace drench::validation {

using namespace sim_tests;

namespace {

constexpr double length = curtain_pool, width = curtain_pool, height = 0.36;  // m
constexpr double thickness = 1e-3;                                            // m

class StaticCurtain {
 public:
  StaticCurtain(const sim::Scene& scene, double left, double right)
      : cloth_(scene.cloth), floor_(scene.parameters.low[1]), volume_{left, right} {
    for (int v = 0; v < cloth_.vertices(); ++v) x_.push_back(at(scene.start.cloth_position, v));
    plane_ = x_[0].x;
  }
  /// m, of the vertex that is farthest off the plane of the pins.
  double deflection() {
    std::vector<V3d> velocity(x_.size(), V3d(0));
    const double stiffest = 16 * (6000 + 3000);  // N/m, as in coupled.cpp
    double last = 0;
    for (int step = 0; step < 40000; ++step) {
      const std::vector<V3d> f = forces();
      double energy = 0, left = 0;
      for (size_t v = 0; v < x_.size(); ++v) {
        if (cloth_.inverse_mass[v] == 0) continue;
        velocity[v] += f[v] / stiffest, x_[v] += velocity[v];
        energy += velocity[v].length2(), left = std::max(left, f[v].length());
      }
      if (energy < last) velocity.assign(x_.size(), V3d(0)), energy = 0;
      last = energy;
      if (step > 100 && left < 1e-7) break;
    }
    double most = 0;
    for (const V3d& x : x_) most = std::max(most, std::abs(x.x - plane_));
    return most;
  }

 private:
  std::vector<V3d> forces() const {
    std::vector<V3d> f(x_.size(), V3d(0));
    for (size_t v = 0; v < x_.size(); ++v) {
      f[v].y -= cloth_.mass[v] * 9.81;
      for (int k = cloth_.spring_start[v]; k < cloth_.spring_start[v + 1]; ++k) {
        const V3d d = x_[cloth_.spring_end[k]] - x_[v];
        f[v] += d * (cloth_.stiffness[k] * (1 - cloth_.rest_length[k] / d.length()));
      }
    }
    const double left = level(-1, volume_[0]), right = level(1, volume_[1]);
    for (int t = 0; t < cloth_.triangles(); ++t) {
      const V3d n = normal(t);
      const double y = centre(t).y;
      const double push = 9810 * (std::max(left - y, 0.) - std::max(right - y, 0.));
      for (int k = 0; k < 3; ++k)
        f[cloth_.corner[3 * t + k]] += n * ((n.x > 0 ? 1 : -1) * push / 3);
    }
    return f;
  }
  /// Height of the surface of a volume on one side, where all triangles under it are its wall.
  double level(int side, double volume) const {
    double low = floor_, high = floor_ + 2;
    for (int k = 0; k < 50; ++k) {
      const double middle = 0.5 * (low + high);
      double room = length * width * (middle - floor_);
      for (int t = 0; t < cloth_.triangles(); ++t) {
        double bottom = 1e30, top = -1e30;
        for (int c = 0; c < 3; ++c)
          bottom = std::min(bottom, corner(t, c).y), top = std::max(top, corner(t, c).y);
        const double wet = std::clamp((middle - bottom) / (top - bottom), 0., 1.);
        room -= side * std::abs(normal(t).x) * wet * (centre(t).x - plane_);
      }
      (room < volume ? low : high) = middle;
    }
    return low;
  }
  V3d corner(int t, int k) const { return x_[cloth_.corner[3 * t + k]]; }
  V3d centre(int t) const { return (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3; }
  V3d normal(int t) const {  // m^2
    return (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)) * 0.5;
  }

  const sim::ClothTopology& cloth_;
  double floor_, plane_ = 0, volume_[2];
  std::vector<V3d> x_;
};

}  // namespace

Shot curtain_shot(int layers, double right) {
  const double a = length / layers, half = length + thickness / 2;
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = a;
  shot.domain.min = V3d(-half, 0, -width / 2), shot.domain.max = V3d(half, 0.6, width / 2);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  Cloth& sheet = add_sheet(shot, width, 0, layers);
  sheet.areal_density = 0.2, sheet.retardation_time = 0.005;
  sheet.adjacent_stiffness = 6000, sheet.diagonal_stiffness = 3000;
  sheet.corner = V3d(0, 0, -width / 2), sheet.u = V3d(0, 0, width), sheet.v = V3d(0, height, 0);
  sheet.cells = V2i(layers, layers * 3 / 2);
  sheet.thickness = thickness, sheet.damping = 20;  // at rest it makes no difference
  ClothPin rim;
  rim.box = {{V3d(-1, -1, -1), V3d(1, 1e-6, 1)}};
  sheet.pin.push_back(rim);
  rim.box = {{V3d(-1, height - 1e-6, -1), V3d(1, 1, 1)}};
  sheet.pin.push_back(rim);
  rim.box = {{V3d(-1, -1, -1), V3d(1, 1, -width / 2 + 1e-6)}};
  sheet.pin.push_back(rim);
  rim.box = {{V3d(-1, -1, width / 2 - 1e-6), V3d(1, 1, 1)}};
  sheet.pin.push_back(rim);
  add_box(shot, V3d(-half, 0, -width / 2), {layers, layers, layers});
  if (right > 0)
    add_box(shot, V3d(thickness / 2, 0, -width / 2), {layers, int(right * layers), layers});
  return shot;
}

double static_deflection(const sim::Scene& scene, double right) {
  const double whole = length * length * width;
  return StaticCurtain(scene, whole, right * whole).deflection();
}

Deflection deflection_of(const std::vector<float>& x, double plane) {
  Deflection d;
  for (const float at : x) {
    const double off = at - plane;
    d.most = std::max(d.most, std::abs(off)), d.mean += off / double(x.size());
    d.ripple += off * off / double(x.size());
  }
  d.ripple = std::sqrt(d.ripple);
  return d;
}

}  // namespace drench::validation
