#pragma once
// Surface tension: particles at a surface attract each other along it,
//   m dv_i/dt = -sum_j k sigma a (s_i t_i^2 + s_j t_j^2) w(q) e_ij,   w = (1 - q)^3 (q - a / h),
// e_ij: unit vector from j to i, q = r / h, n: unit normal, t^2 = 1 - (n . e)^2: the square of the
// part of e along the surface, s = h |smoothed gradient of colour|: 0 inside. Forces are equal and
// opposite and along the line between particles: momentum and angular momentum are kept. They
// vanish inside, where forces between all pairs (Tartakovsky and Panchenko 2016; Akinci, Akinci and
// Teschner 2013) make a solid of particles at rest; t^2 leaves the surface nearly free of stress
// along its normal; and w vanishes at the spacing a, where neighbours are. What each particle gets
// is averaged over its neighbourhood, equal and opposite between neighbours, as w does not know how
// these stand: without it a drop at rest stirs 1.2 to 2.1 times as much.
//
// sigma is N/m by one constant k, measured: a drop's period and its inner pressure meet Rayleigh
// and Laplace with the same one at 10 and 15 spacings to the radius; at 7 pressure is 13 % too high
// (docs/theory/surface_tension.md).
// Walls, obstacles and sheets are mirrors: surfaces meet them at a right angle.

#include "sim/passes/pressure/pressure_rows.h"
#include "sim/passes/tension/mirror_images.h"

namespace drench::sim::DRENCH_BACKEND {

/// Minus the gradient of colour, 1/m: a vector outwards.
template <class Separation>
struct ColourGradient {
  static constexpr int columns = 1;
  const Float4* position;
  Float4* gradient;
  float scale;  // 1/m^2, of the sum
  Separation separation;

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<1> inputs() const { return {{position}}; }
  template <class Q>
  struct Particle {
    Q position;
  };
  template <class Q>
  struct Sum {
    Q outwards;
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return WendlandC2::slope(u);
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    sum.outwards = multiply_add(separation(i.position, j.position), weight, sum.outwards);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 s = sum.outwards;
    gradient[i] = {scale * s.x, scale * s.y, scale * s.z, 0.f};
  }
  /// Of an image.
  DRENCH_HD Vec3<float> operator()(int, int, const Image& image) const {
    return image.x * (scale * WendlandC2::slope(image.u));
  }
};

/// Mean of the neighbours' gradients.
struct SmoothNormal {
  static constexpr int columns = 1;
  const Float4* gradient;
  Float4* normal;
  float scale;  // of the sum

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<1> inputs() const { return {{gradient}}; }
  template <class Q>
  struct Particle {
    Q gradient;
  };
  template <class Q>
  struct Sum {
    Q mean;
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return WendlandC2::value(u);
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>&, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    sum.mean = multiply_add(j.gradient, weight, sum.mean);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 s = sum.mean;
    normal[i] = {scale * s.x, scale * s.y, scale * s.z, 0.f};
  }
  DRENCH_HD Vec3<float> operator()(int, int j, const Image& image) const {
    return image.turned(gradient[j]) * (scale * WendlandC2::value(image.u));
  }
};

constexpr float tension_constant = 32.f;  // k

/// kick = -dt times the sum above over m.
template <class Separation>
struct TensionForce {
  static constexpr int columns = 2;
  const Float4 *position, *normal;  // normal: unit; w: s
  Float4* kick;                     // m/s
  float scale;                      // 1/(m^2 s), of the sum
  float spacing;                    // over h
  Separation separation;

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<2> inputs() const { return {{position, normal}}; }
  template <class Q>
  struct Particle {
    Q position, normal;
  };
  template <class Q>
  struct Sum {
    Q pull;
  };
  /// w / q^3, without the pole: e t^2 is (x^2 - (n . x)^2) x / r^3.
  template <class T>
  DRENCH_HD T weight(T u) const {
    const T q = T(1.f) - u;
    return u * u * u * (q - T(spacing)) / (q * q * q + T(1e-6f));
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    const Q x = separation(i.position, j.position), square = splat_sum(x * x);
    const Q a = splat_sum(i.normal * x), b = splat_sum(j.normal * x);
    const Q along = splat_w(i.normal) * (square - a * a) + splat_w(j.normal) * (square - b * b);
    sum.pull = multiply_add(x, weight * along, sum.pull);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 s = sum.pull;
    kick[i] = {-scale * s.x, -scale * s.y, -scale * s.z, 0.f};
  }
  DRENCH_HD Vec3<float> operator()(int i, int j, const Image& image) const {
    const Vec3<float> n{normal[i].x, normal[i].y, normal[i].z}, x = image.x;
    const float a = dot(n, x), b = dot(image.turned(normal[j]), x), square = length2(x);
    const float along = normal[i].w * (square - a * a) + normal[j].w * (square - b * b);
    return x * (weight(image.u) * along);
  }
};

/// velocity += the kicks' mean over the neighbourhood, equal and opposite between neighbours.
struct SmoothKick {
  static constexpr int columns = 1;
  const Float4* kick;
  VecView velocity;
  float scale;  // of the sum

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<1> inputs() const { return {{kick}}; }
  template <class Q>
  struct Particle {
    Q kick;
  };
  template <class Q>
  struct Sum {
    Q change;
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return WendlandC2::value(u);
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    sum.change = multiply_add(j.kick - i.kick, weight, sum.change);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 k = kick[i], c = sum.change;
    velocity.set(
        i, velocity[i] + Vec3<float>{k.x + scale * c.x, k.y + scale * c.y, k.z + scale * c.z});
  }
};

template <class Separation>
TensionForce<Separation> tension_force(const State& state, Float4* kick, Separation separation) {
  const Parameters& p = state.parameters;
  const float a = p.spacing, h = p.support_radius;
  const float strength = float(state.dt) * tension_constant * p.surface_tension;
  return {.position = state.pressure.place.data(),
          .normal = state.tension.normal.data(),
          .kick = kick,
          .scale = strength / (p.rest_density * a * a * h * h * h),
          .spacing = a / h,
          .separation = separation};
}

/// Adds the step's kicks to the velocities; leaves unit normals in TensionState::normal, for
/// contact angles and the impulses of obstacles, and in FluidState::owed what sheets receive.
/// Overwrites PressureState::scratch_a.
void apply_surface_tension(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
