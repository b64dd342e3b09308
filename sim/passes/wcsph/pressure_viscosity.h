#pragma once
#include "sim/passes/wcsph/density.h"

namespace drench::sim::DRENCH_BACKEND {

// Pressure and viscosity between particles, and gravity and walls on each (Harada et al. 2007, eq
// 2, without cloth):
//   a_i = -sum_j m (p_i/rho_i^2 + p_j/rho_j^2) grad W_spiky + mu sum_j m (v_j - v_i)/(rho_i rho_j)
//   lap W_vis + g
// Mueller, Charypar, Gross 2003 average the two pressures, which gives half the gradient of a
// smooth field (sum_j V_j grad W = 0). This sum (Monaghan 1992) gives all of it and is the gradient
// of the energy that belongs to the summed density. Both are antisymmetric in i and j. A wall is a
// half-space of rest density; free slip but for mu.
struct PressureViscosity {
  static constexpr int columns = 8;
  static constexpr bool costly = true;
  ConstVecView position, velocity;
  const float *pressure_term, *inverse_density;  // p / rho^2, 1 / rho
  VecView acceleration;
  float support_radius;     // m
  float scale;              // m spiky_gradient_factor(h), m^-1 kg...: see sph_kernels.h
  float dynamic_viscosity;  // Pa s, fluid on fluid
  float wall_viscosity;     // Pa s, fluid on walls
  float rest_density;       // kg/m^3
  Vec3<float> gravity;      // m/s^2
  HalfspaceWalls walls;

  DRENCH_HD Inputs<8> inputs() const {
    return {{position.x, position.y, position.z, velocity.x, velocity.y, velocity.z, pressure_term,
             inverse_density}};
  }
  template <class T>
  struct Particle {
    Vec3<T> position, velocity;
    T pressure_term, inverse_density;
  };
  template <class T>
  struct Sum {
    Vec3<T> force{T(0.f), T(0.f), T(0.f)};
  };
  template <class T>
  DRENCH_HD void pair(const Particle<T>& i, const Particle<T>& j, Sum<T>& sum) const {
    const Vec3<T> x = i.position - j.position;
    const T r = square_root(length2(x));
    const T u = max0(T(support_radius) - r);
    const T push = u * u * (i.pressure_term + j.pressure_term) / maximum(r, T(1e-12f));
    const T drag = u * T(dynamic_viscosity) * (i.inverse_density * j.inverse_density);
    sum.force = sum.force + x * push + (j.velocity - i.velocity) * drag;
  }
  DRENCH_HD void finish(int i, const Sum<float>& sum) const {
    acceleration.set(i, sum.force * scale + wall_acceleration(i) + gravity);
  }

  /// p_i rho_0 / rho_i^2 times the half-space gradient of each wall, fractions as in the density.
  /// Mirrored pressure would double it; but a wall stores no energy of its own, and twice the force
  /// as a particle leaves makes energy (docs/decisions/0027-walls-push-once.md).
  DRENCH_HD Vec3<float> wall_acceleration(int i) const {
    const Vec3<float> p = position[i], v = velocity[i];
    const float x[3] = {p.x, p.y, p.z}, u[3] = {v.x, v.y, v.z};
    const float inverse_h = 1.f / support_radius, inverse_rho = inverse_density[i];
    float open[3], a[3] = {0.f, 0.f, 0.f};
    for (int k = 0; k < 3; ++k) {
      open[k] = 1.f - walls.scale *
                          spiky_halfspace(minimum(max0(walls.distance(k, x[k])) * inverse_h, 1.f));
    }
    for (int k = 0; k < 3; ++k) {
      const float q = max0(walls.distance(k, x[k])) * inverse_h;
      if (q >= 1.f) continue;
      const float fraction = open[(k + 1) % 3] * open[(k + 2) % 3] * rest_density;
      a[k] += pressure_term[i] * fraction * spiky_plane(q) * inverse_h * walls.sign(k, x[k]);
      const float drag = wall_viscosity * fraction * inverse_rho * inverse_rho *
                         viscosity_halfspace(q) * inverse_h * inverse_h;
      for (int m = 0; m < 3; ++m) {
        if (m != k) a[m] -= drag * u[m];
      }
    }
    return {a[0], a[1], a[2]};
  }
};

}  // namespace drench::sim::DRENCH_BACKEND
