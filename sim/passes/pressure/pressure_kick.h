#pragma once
// What the pressures of a step do to velocities in a full box. They are found at the positions that
// the step ends with; pushed from there, particles follow an implicit Euler step, which takes
// dt^2 |grad p / rho|^2 / 2 out of every unit of mass in a step: of Taylor and Green's vortices at
// 50 to the side 8 % of their rate. Pushed from where neighbours stood half a step before, with the
// same pressures, velocities that are free of divergence at the ends of steps lose nothing (the
// trapezoidal rule). With a free surface the same, a whole step back (Verlet's), keeps more of a
// wave but is not stable (docs/benchmarks.md).
//
// Back they go by the mean velocity around them: what a neighbourhood does together is kept, what a
// particle does by itself stays damped.

#include "sim/passes/pressure/pressure_rows.h"

namespace drench::sim::DRENCH_BACKEND {

/// Way of the mean velocity around a particle in a given time.
struct MeanWay {
  static constexpr int columns = 1;
  const Float4* velocity;  // m/s; w: 1
  Float4* way;             // m
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
    way[i] = {f * (a.x + own.x), f * (a.y + own.y), f * (a.z + own.z), 0.f};
  }
};

/// As PressureAcceleration, with neighbours where they stood before they went their `way`.
template <class Separation>
struct EarlierAcceleration {
  static constexpr int columns = 4;
  const Float4 *place, *way, *correction, *correction_cross, *wall;
  Float4* kick;
  float scale;       // of the cube of closeness, kg/m^5
  float inverse_h2;  // 1/m^2
  Separation separation;

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<4> inputs() const { return {{place, way, correction, correction_cross}}; }
  template <class Q>
  struct Particle {
    Q place, way, diagonal, cross;
  };
  template <class Q>
  struct Sum {
    Q push, gradient;
  };
  /// Below any that counts where no neighbour is.
  template <class T>
  DRENCH_HD T weight(T u) const {
    return select(u > T(0.f), u, T(-1.f));
  }
  /// Closeness to first order; the way back is less than a quarter of the distance, so that what
  /// meets at high speed is not exchanged.
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q u, Sum<Q>& sum) const {
    const Q r = separation(i.place, j.place), full = i.way - j.way;
    const Q distance = splat(1.0001f) - u, distance2 = distance * distance;  // over h, not 0
    const Q way = full * (distance2 /
                          multiply_add(splat(4.f * inverse_h2), splat_sum(full * full), distance2));
    const Q was = positive(u + splat(inverse_h2) * splat_sum(r * way) / distance);
    const Q gradient = was * was * was * (r - way), p = splat_w(j.place) * gradient;
    sum.gradient = sum.gradient + gradient;
    sum.push = multiply_add(j.diagonal, p, multiply_add(j.cross, rotate(p), sum.push)) +
               rotate_back(j.cross * p);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const float q = place[i].w;
    const Float4 g = wall[i], p = sum.push;
    const Float4 own = multiply_symmetric(correction[i], correction_cross[i], sum.gradient);
    kick[i] = {scale * (p.x + q * own.x) - q * g.x, scale * (p.y + q * own.y) - q * g.y,
               scale * (p.z + q * own.z) - q * g.z, 0.f};
  }
};

}  // namespace drench::sim::DRENCH_BACKEND
