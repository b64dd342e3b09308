#pragma once
#include "sim/neighbours/pairs.h"
#include "sim/neighbours/sph_kernels.h"
#include "sim/passes/motion/domain_walls.h"
#include "sim/passes/wcsph/equation_of_state.h"

namespace drench::sim::DRENCH_BACKEND {

/// Domain walls as the weakly compressible fluid sees them: half-spaces of rest density.
struct HalfspaceWalls : DomainWalls {
  float scale;  // Parameters::wall_scale

  /// Distance to the nearer wall of an axis; far when the axis is open.
  DRENCH_HD float distance(int axis, float x) const {
    return on[axis] ? minimum(x - low[axis], high[axis] - x) : 1e30f;
  }
  DRENCH_HD float sign(int axis, float x) const {
    return x - low[axis] < high[axis] - x ? 1.f : -1.f;
  }
};

inline HalfspaceWalls halfspace_walls_of(const Parameters& p) {
  return {domain_walls(p), p.wall_scale};
}

/// Fraction of density that the walls around a particle replace: 1 - prod(1 - H), so that edges and
/// corners are not counted twice. H is the half-space integral of the kernel, scaled so that a
/// lattice that ends half a spacing before a wall has rest density: the kernel is too narrow for
/// the integral itself.
DRENCH_HD float wall_density_fraction(const HalfspaceWalls& walls, Vec3<float> p, float inverse_h) {
  const float x[3] = {p.x, p.y, p.z};
  float open = 1.f;
  for (int k = 0; k < 3; ++k) {
    const float q = max0(walls.distance(k, x[k])) * inverse_h;
    if (q < 1.f) open *= 1.f - walls.scale * spiky_halfspace(q);
  }
  return 1.f - open;
}

// Density by summation and pressure from the equation of state (equation_of_state.h):
//   rho_i = sum_j m W(r_ij, h)            Mueller, Charypar, Gross 2003, section 3.1
// Mueller et al. sum density with poly6 and take the pressure force from spiky. The two do not
// belong to one energy, and a column that should come to rest boils: spiky serves for both
// (docs/decisions/0026-one-kernel-for-density-and-pressure.md), poly6 the paper coupling alone. A
// cubic lattice at rest sums to lattice_sum m / a^3; dividing by it makes the lattice stress-free.
// Walls and cloth add their half-space fraction (eq 9 of Harada et al. 2007 with the layer filled
// up).
template <class Kernel>
struct DensitySum {
  static constexpr int columns = 3;
  static constexpr bool costly = false;
  ConstVecView position;
  const float* cloth_density;  // fraction of density replaced by cloth, or null
  float *density, *pressure_term, *inverse_density;  // kg/m^3, p / rho^2 in m^5/(kg s^2), m^3/kg
  float support_radius;                              // m
  float scale;                                       // m Kernel::factor(h) / lattice_sum
  float rest_density;                                // kg/m^3
  float sound_speed2;                                // m^2/s^2
  HalfspaceWalls walls;

  DRENCH_HD Inputs<3> inputs() const { return {{position.x, position.y, position.z}}; }

  template <class T>
  struct Particle {
    Vec3<T> position;
  };
  template <class T>
  struct Sum {
    T w{0.f};  // of Kernel::shape
  };
  template <class T>
  DRENCH_HD void pair(const Particle<T>& i, const Particle<T>& j, Sum<T>& sum) const {
    sum.w = sum.w + Kernel::shape(length2(i.position - j.position), T(support_radius));
  }
  DRENCH_HD void finish(int i, const Sum<float>& sum) const {
    const float fraction = wall_density_fraction(walls, position[i], 1.f / support_radius) +
                           (cloth_density ? cloth_density[i] : 0.f);
    const float rho = scale * sum.w + rest_density * fraction;
    density[i] = rho;
    inverse_density[i] = 1.f / rho;
    pressure_term[i] = pressure_term_of(rho, rest_density, sound_speed2);
  }
};

}  // namespace drench::sim::DRENCH_BACKEND
