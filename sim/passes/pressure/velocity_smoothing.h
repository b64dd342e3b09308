#pragma once
// XSPH (Monaghan 1989): every step a particle takes on a fraction c of its neighbours' mean
// velocity,
//   v_i += c sum_j m / rho_0 (v_j - v_i) W_ij,
// antisymmetric in i and j: momentum is kept. Walls let slip. Physical viscosity: viscosity_rows.h;
// where it does less than a hundredth of what this does, as water's does at spacings of a
// centimetre, it is added to c.

#include "sim/passes/pressure/pressure_rows.h"

namespace drench::sim::DRENCH_BACKEND {

struct VelocitySmoothing {
  static constexpr int columns = 1;
  const Float4* velocity;
  VecView out;
  float factor;  // of the kernel's value

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<1> inputs() const { return {{velocity}}; }
  template <class Q>
  struct Particle {
    Q velocity;
  };
  template <class Q>
  struct Sum {
    Q change;
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return T(factor) * WendlandC2::value(u);
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    sum.change = multiply_add(j.velocity - i.velocity, weight, sum.change);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 v = velocity[i], c = sum.change;
    out.set(i, {v.x + c.x, v.y + c.y, v.z + c.z});
  }
};

void smooth_velocities(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
