#pragma once
// The rows of the incompressible solve (as DFSPH: Bender and Koschier 2017, eqs 7 to 9). With D the
// rate of density that velocities make,
//   (D v)_i = sum_j m (v_i - v_j) . grad W_ij + rho_0 grad S_i . v_i,    S: share of the walls,
// pressures p_i = rho_i^2 q_i accelerate particles by -D^T q, so that momentum is kept and D D^T is
// symmetric and not negative. Its diagonal is what DFSPH divides by.

#include "sim/kernels.h"
#include "sim/periodic.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// vector = -D^T q.
template <class Separation>
struct PressureAcceleration {
  static constexpr int columns = 1;
  const Float4 *place, *wall;  // position and q; rho_0 grad S, kg/m^4
  Float4* vector;
  const int* done;
  float scale;  // m / h^5 over the lattice sum, kg/m^5
  Separation separation;

  DRENCH_HD bool idle() const { return *done; }
  DRENCH_HD Columns<1> inputs() const { return {{place}}; }
  template <class Q>
  struct Particle {
    Q place;
  };
  template <class Q>
  struct Sum {
    Q push;
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return WendlandC2::slope(u);
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    sum.push =
        multiply_add(separation(i.place, j.place), weight * splat_w(i.place + j.place), sum.push);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const float q = place[i].w;
    const Float4 g = wall[i], p = sum.push;
    vector[i] = {scale * p.x - q * g.x, scale * p.y - q * g.y, scale * p.z - q * g.z, 0.f};
  }
};

/// rate = D vector.
template <class Separation>
struct DensityRate {
  static constexpr int columns = 2;
  const Float4 *place, *vector, *wall;
  float* rate;
  const int* done;
  float scale;
  Separation separation;

  DRENCH_HD bool idle() const { return *done; }
  DRENCH_HD Columns<2> inputs() const { return {{place, vector}}; }
  template <class Q>
  struct Particle {
    Q place, vector;
  };
  template <class Q>
  struct Sum {
    Q product;
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return WendlandC2::slope(u);
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    sum.product =
        multiply_add(weight * separation(i.place, j.place), i.vector - j.vector, sum.product);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 g = wall[i], v = vector[i], p = sum.product;  // p.w is 0, as all vectors' w
    rate[i] = g.x * v.x + g.y * v.y + g.z * v.z - scale * (p.x + p.y + p.z);
  }
};

/// 1 / (D D^T)_ii; 0 for a particle that nothing pushes.
template <class Separation>
struct InverseDiagonal {
  static constexpr int columns = 1;
  const Float4 *place, *wall;
  float* inverse;
  float scale;
  Separation separation;

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<1> inputs() const { return {{place}}; }
  template <class Q>
  struct Particle {
    Q place;
  };
  template <class Q>
  struct Sum {
    Q gradient, square;
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return WendlandC2::slope(u);
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    const Q gradient = weight * separation(i.place, j.place);
    sum.gradient = sum.gradient + gradient;
    sum.square = multiply_add(gradient, gradient, sum.square);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 g = wall[i], d = sum.gradient, s = sum.square;
    const float x = scale * d.x - g.x, y = scale * d.y - g.y, z = scale * d.z - g.z;
    const float diagonal = x * x + y * y + z * z + scale * scale * (s.x + s.y + s.z);
    inverse[i] = diagonal > 0.f ? 1.f / diagonal : 0.f;
  }
};

/// The factor of the kernel's gradient, kg/m^5: a lattice at rest has rest density.
inline float gradient_scale(const Parameters& p) {
  const float h = p.support_radius;
  return p.particle_mass / p.lattice_sum / (h * h * h * h * h);
}

/// vector = -D^T q with the q beside the positions.
inline void accelerate_by_pressure(State& state) {
  PressureState& s = state.pressure;
  with_separation(state.parameters, [&](auto separation) {
    for_each_neighbour("pressure: acceleration", s.lists, state.fluid.count,
                       PressureAcceleration<decltype(separation)>{
                           s.place.data(), s.wall.data(), s.vector.data(), &s.control.data()->done,
                           gradient_scale(state.parameters), separation});
  });
}

/// product = D vector.
inline void density_rate(State& state) {
  PressureState& s = state.pressure;
  with_separation(state.parameters, [&](auto separation) {
    for_each_neighbour("pressure: density rate", s.lists, state.fluid.count,
                       DensityRate<decltype(separation)>{
                           s.place.data(), s.vector.data(), s.wall.data(), s.product.data(),
                           &s.control.data()->done, gradient_scale(state.parameters), separation});
  });
}

/// Of D D^T.
inline void invert_diagonal(State& state) {
  PressureState& s = state.pressure;
  with_separation(state.parameters, [&](auto separation) {
    for_each_neighbour("neighbours: diagonal", s.lists, state.fluid.count,
                       InverseDiagonal<decltype(separation)>{
                           s.place.data(), s.wall.data(), s.inverse_diagonal.data(),
                           gradient_scale(state.parameters), separation});
  });
}

}  // namespace drench::sim::DRENCH_BACKEND
