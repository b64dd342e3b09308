#pragma once
// The rows of the incompressible solve (as DFSPH: Bender and Koschier 2017, eqs 7 to 9). With D the
// rate of density that velocities make,
//   (D v)_i = sum_j m (v_i - v_j) . L_i grad W_ij + rho_0 grad S_i . v_i,   S: fraction that walls
//   fill,
//                                                   L: gradient_correction.h,
// pressures p_i = rho_i^2 q_i accelerate particles by -D^T q, so that momentum is kept and D D^T is
// symmetric and not negative. Its diagonal is what DFSPH divides by.

#include "sim/passes/pressure/gradient_correction.h"

namespace drench::sim::DRENCH_BACKEND {

/// The sum of L_j r over neighbours.
template <class Q>
struct CorrectedSum {
  Q diagonal, ahead, back;  // of d r; c times the next of r; c r, one place on

  DRENCH_HD void add(Q d, Q c, Q r) {
    diagonal = multiply_add(d, r, diagonal);
    ahead = multiply_add(c, rotate(r), ahead);
    back = multiply_add(c, r, back);
  }
};
DRENCH_HD Vec3<float> total(const CorrectedSum<Float4>& sum) {
  const Float4 d = sum.diagonal, a = sum.ahead, b = sum.back;
  return {d.x + a.x + b.z, d.y + a.y + b.x, d.z + a.z + b.y};
}

/// vector = -D^T q.
template <class Separation>
struct PressureAcceleration {
  static constexpr int columns = 3;
  const Float4 *place, *correction, *correction_cross;  // position and q; L
  const Float4* own_acceleration;                       // by q = 1 of the particle itself
  Float4* vector;
  const int* done;
  float scale;  // m / h^5 over the lattice sum, kg/m^5
  Separation separation;

  DRENCH_HD bool idle() const { return *done; }
  DRENCH_HD Columns<3> inputs() const { return {{place, correction, correction_cross}}; }
  template <class Q>
  struct Particle {
    Q place, diagonal, cross;
  };
  template <class Q>
  using Sum = CorrectedSum<Q>;
  template <class T>
  DRENCH_HD T weight(T u) const {
    return WendlandC2::slope(u);
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    sum.add(j.diagonal, j.cross, weight * splat_w(j.place) * separation(i.place, j.place));
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const float q = place[i].w;
    const Float4 own = own_acceleration[i];
    const Vec3<float> all = total(sum);
    vector[i] = {scale * all.x + q * own.x, scale * all.y + q * own.y, scale * all.z + q * own.z,
                 0.f};
  }
};

/// rate = D vector.
template <class Separation>
struct DensityRate {
  static constexpr int columns = 2;
  const Float4 *place, *vector, *correction, *correction_cross, *wall;
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
    Q diagonal, cross, back;  // of the products of separation and velocity
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return WendlandC2::slope(u);
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    const Q r = weight * separation(i.place, j.place), v = i.vector - j.vector;
    sum.diagonal = multiply_add(r, v, sum.diagonal);
    sum.cross = multiply_add(r, rotate(v), sum.cross);
    sum.back = multiply_add(rotate(r), v, sum.back);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 g = wall[i], v = vector[i], d = correction[i], c = correction_cross[i];
    const Float4 p = sum.diagonal, t = sum.cross, b = sum.back;
    const float product = d.x * p.x + d.y * p.y + d.z * p.z + c.x * (t.x + b.x) +
                          c.y * (t.y + b.y) + c.z * (t.z + b.z);
    rate[i] = g.x * v.x + g.y * v.y + g.z * v.z - scale * product;
  }
};

/// 1 / (D D^T)_ii, 0 for a particle without neighbours; and the acceleration that q = 1 of a
/// particle gives to itself.
template <class Separation>
struct InverseDiagonal {
  static constexpr int columns = 1;
  const Float4 *place, *correction, *correction_cross, *wall;
  Float4* own_acceleration;
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
    Q gradient, square, square_cross;
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
    sum.square_cross = multiply_add(gradient, rotate(gradient), sum.square_cross);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 g = wall[i], d = correction[i], c = correction_cross[i];
    const Float4 own = multiply_symmetric(d, c, sum.gradient);
    const Float4 p{scale * own.x - g.x, scale * own.y - g.y, scale * own.z - g.z, 0.f};
    // the sum of |L grad W|^2 is the trace of L S L, S the sum of the products of grad W
    const Float4 s = sum.square, t = sum.square_cross;
    const Float4 x = multiply_symmetric(d, c, {s.x, t.x, t.z, 0.f}),
                 y = multiply_symmetric(d, c, {t.x, s.y, t.y, 0.f}),
                 z = multiply_symmetric(d, c, {t.z, t.y, s.z, 0.f});
    const float square = d.x * x.x + c.x * x.y + c.z * x.z + c.x * y.x + d.y * y.y + c.y * y.z +
                         c.z * z.x + c.y * z.y + d.z * z.z;
    const float diagonal = p.x * p.x + p.y * p.y + p.z * p.z + scale * scale * square;
    own_acceleration[i] = p;
    inverse[i] = diagonal > 0.f ? 1.f / diagonal : 0.f;
  }
};

/// The same, and the energy of one pressure all over, |(D^T 1)_i|^2, for the coarse levels.
template <class Separation>
struct EvenInverseDiagonal : InverseDiagonal<Separation> {
  using Base = InverseDiagonal<Separation>;
  static constexpr int columns = 3;
  float* even;  // m^8/(kg^2 s^4)

  DRENCH_HD Columns<3> inputs() const {
    return {{this->place, this->correction, this->correction_cross}};
  }
  template <class Q>
  struct Particle {
    Q place, diagonal, cross;
  };
  template <class Q>
  struct Sum {
    typename Base::template Sum<Q> own;
    CorrectedSum<Q> others;
  };
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    Base::pair({i.place}, {j.place}, weight, sum.own);
    sum.others.add(j.diagonal, j.cross, weight * this->separation(i.place, j.place));
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    Base::finish(i, sum.own);
    const Float4 own = this->own_acceleration[i];
    const Vec3<float> all = total(sum.others);
    even[i] = length2(Vec3<float>{this->scale * all.x + own.x, this->scale * all.y + own.y,
                                  this->scale * all.z + own.z});
  }
};

/// The factor of the kernel's gradient, kg/m^5: a lattice at rest has rest density.
inline float gradient_scale(const Parameters& p) {
  const float h = p.support_radius;
  return p.particle_mass / p.lattice_sum / (h * h * h * h * h);
}

/// vector = -D^T q with the q beside the positions.
void accelerate_by_pressure(State& state);

/// product = D vector.
void density_rate(State& state);

/// Of D D^T, and InverseDiagonal::own_acceleration in PressureState::scratch_b; where there may be
/// levels EvenInverseDiagonal::even as well, in PressureState::next until an iteration.
void invert_diagonal(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
