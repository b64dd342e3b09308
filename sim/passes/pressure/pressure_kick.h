#pragma once
// What the pressures of a step do to velocities in a closed domain. They are found at the positions
// that the step ends with; pushed from there, particles follow an implicit Euler step, which takes
// dt^2 |grad p / rho|^2 / 2 out of every unit of mass in a step: of Taylor and Green's vortices at
// 50 to the side 8 % of their rate. Pushed from where neighbours stood half a step before, with the
// same pressures, velocities that are free of divergence at the ends of steps lose nothing (the
// trapezoidal rule). With a free surface the same, a whole step back (Verlet's), keeps more of a
// wave but is not stable (docs/decisions/0005-closed-domain.md).
//
// Back they go by the mean velocity around them: what a neighbourhood does together is kept, what a
// particle does by itself stays damped.

#include "sim/passes/pressure/pressure_rows.h"

namespace drench::sim::DRENCH_BACKEND {

/// Displacement by the mean velocity around a particle in a given time.
struct MeanDisplacement {
  static constexpr int columns = 1;
  const Float4* velocity;  // m/s; w: 1
  Float4* displacement;    // m
  float time;              // s

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<1> inputs() const { return {{velocity}}; }
  template <class Q>
  struct Particle {
    Q velocity;
  };
  template <class Q>
  struct Sum {
    Q velocity;
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return u * u;
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>&, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    sum.velocity = multiply_add(weight, j.velocity, sum.velocity);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 a = sum.velocity, own = velocity[i];
    const float f = time / (a.w + 1.f);
    displacement[i] = {f * (a.x + own.x), f * (a.y + own.y), f * (a.z + own.z), 0.f};
  }
};

/// As PressureAcceleration, with neighbours where they stood before their `displacement`.
template <class Separation>
struct EarlierAcceleration {
  static constexpr int columns = 4;
  const Float4 *place, *displacement, *correction, *correction_cross, *wall;
  Float4* kick;
  float scale;       // of u^3, u = 1 - r/h, kg/m^5
  float inverse_h2;  // 1/m^2
  Separation separation;

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<4> inputs() const {
    return {{place, displacement, correction, correction_cross}};
  }
  template <class Q>
  struct Particle {
    Q place, displacement, diagonal, cross;
  };
  template <class Q>
  struct Sum {
    Q acceleration, gradient;
  };
  /// Below any that counts where no neighbour is.
  template <class T>
  DRENCH_HD T weight(T u) const {
    return select(u > T(0.f), u, T(-1.f));
  }
  /// u = 1 - r/h of the earlier places to first order; what is taken back is less than a quarter of
  /// the distance, so that particles which meet at high speed do not change places.
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q u, Sum<Q>& sum) const {
    const Q r = separation(i.place, j.place), full = i.displacement - j.displacement;
    const Q distance = splat(1.0001f) - u, distance2 = distance * distance;  // over h, not 0
    const Q back = full * (distance2 / multiply_add(splat(4.f * inverse_h2), splat_sum(full * full),
                                                    distance2));
    const Q earlier = positive(u + splat(inverse_h2) * splat_sum(r * back) / distance);
    const Q gradient = earlier * earlier * earlier * (r - back), p = splat_w(j.place) * gradient;
    sum.gradient = sum.gradient + gradient;
    sum.acceleration =
        multiply_add(j.diagonal, p, multiply_add(j.cross, rotate(p), sum.acceleration)) +
        rotate_back(j.cross * p);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const float q = place[i].w;
    const Float4 g = wall[i], p = sum.acceleration;
    const Float4 own = multiply_symmetric(correction[i], correction_cross[i], sum.gradient);
    kick[i] = {scale * (p.x + q * own.x) - q * g.x, scale * (p.y + q * own.y) - q * g.y,
               scale * (p.z + q * own.z) - q * g.z, 0.f};
  }
};

}  // namespace drench::sim::DRENCH_BACKEND
