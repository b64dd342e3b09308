#pragma once
// Viscous friction between neighbours, along the line that joins them (Monaghan 1992; as Weiler et
// al. 2018 solve it):
//   dv_i/dt = -sum_j c_ij x_ij (x_ij . v_ij),    c_ij = nu (6300 / pi) V w_ij / h^7,
// their 2 (d + 2) nu m/rho (v_ij . x_ij) / r^2 grad W with another weight (ViscousWeight) and the
// volume at rest, so that c_ij = c_ji. Such forces keep momentum and angular momentum, leave rigid
// motion alone (Brookshaw's form, which acts along v_ij, brakes a rotation), and what they take out
// is the energy sum 1/2 c_ij (x_ij . v_ij)^2: the matrix is symmetric and not negative. A free
// surface is free of stress.
//
// A no-slip wall at distance d acts as fluid beyond it whose velocity goes on in the line from the
// wall's to the particle's (Morris, Fox, Zhu 1997): v_i - v = (v_i - v_wall) z / d. Its integral is
// a closed form in d, which stands on the diagonal, and times v_wall on the right-hand side.
// Obstacles and sheets: body_drag.h.

#include "sim/neighbours/periodic.h"
#include "sim/neighbours/sph_kernels.h"
#include "sim/passes/motion/domain_walls.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// What walls, obstacles and cloth add to the matrix of a particle, a symmetric 3 x 3 block.
struct WallDrag {
  Vec3<float> rate, cross;  // xx, yy, zz and xy, yz, zx
  Vec3<float> source;       // the block times the wall's velocity, m/s

  DRENCH_HD Vec3<float> times(Vec3<float> v) const {
    return {rate.x * v.x + (cross.x * v.y + cross.z * v.z),
            rate.y * v.y + (cross.x * v.x + cross.y * v.z),
            rate.z * v.z + (cross.z * v.x + cross.y * v.y)};
  }
};

/// The domain's walls as what brakes the fluid within a step, or all that does (body_drag.h).
struct NoSlipWalls : DomainWalls {
  float velocity[3][2][3] = {};  // m/s
  float inverse_h = 0;           // 1/m
  float least = 0;               // of a distance, over h: a quarter of a spacing
  float strength = 0;            // dt nu / h^2
  /// Of all that brakes; null: walls alone.
  const Float4 *body_rate = nullptr, *body_cross = nullptr, *body_source = nullptr;

  DRENCH_HD void add(float distance, int axis, const float* moving, WallDrag& drag) const {
    const float q = distance * inverse_h;
    if (q >= 1.f) return;
    const float at = q < least ? least : q, along = strength * ViscousWeight::wall_along(at);
    float rate[3] = {along, along, along};
    rate[axis] = strength * ViscousWeight::wall_across(at);
    drag.rate = drag.rate + Vec3<float>{rate[0], rate[1], rate[2]};
    drag.source =
        drag.source + Vec3<float>{rate[0] * moving[0], rate[1] * moving[1], rate[2] * moving[2]};
  }
  DRENCH_HD WallDrag drag(int i, const Float4& place) const {
    if (body_rate) {
      const Float4 r = body_rate[i], c = body_cross[i], s = body_source[i];
      return {{r.x, r.y, r.z}, {c.x, c.y, c.z}, {s.x, s.y, s.z}};
    }
    const float x[3] = {place.x, place.y, place.z};
    WallDrag drag{};
    for (int k = 0; k < 3; ++k) {
      if (!on[k]) continue;
      add(x[k] - low[k], k, velocity[k][0], drag);
      add(high[k] - x[k], k, velocity[k][1], drag);
    }
    return drag;
  }
};

/// What a step does to velocities by viscosity, without dimension: dt times the rates above.
template <class Separation>
struct ViscousPairs {
  const Float4* place;  // m; w: anything finite
  float scale;          // dt nu V (6300 / pi) / h^7, 1/m^2
  NoSlipWalls walls;
  Separation separation;

  template <class T>
  DRENCH_HD T weight(T u) const {
    return ViscousWeight::value(u);
  }
};

/// product = K vector, K = dt times the rates, walls at rest.
template <class Separation>
struct ViscousProduct : ViscousPairs<Separation> {
  using Pairs = ViscousPairs<Separation>;
  using Pairs::place, Pairs::scale, Pairs::walls, Pairs::separation;
  static constexpr int columns = 2;
  const Float4* vector;  // w: 0
  Float4* product;
  const int* done;

  DRENCH_HD bool idle() const { return *done; }
  DRENCH_HD Columns<2> inputs() const { return {{place, vector}}; }
  template <class Q>
  struct Particle {
    Q place, vector;
  };
  template <class Q>
  struct Sum {
    Q friction;
  };
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    const Q apart = separation(i.place, j.place);
    sum.friction =
        multiply_add(weight * apart, splat_sum(apart * (i.vector - j.vector)), sum.friction);
  }
  DRENCH_HD Vec3<float> result(int i, const Sum<Float4>& sum) const {
    const Float4 v = vector[i], p = sum.friction;
    const Vec3<float> drag = walls.drag(i, place[i]).times({v.x, v.y, v.z});
    return {scale * p.x + drag.x, scale * p.y + drag.y, scale * p.z + drag.z};
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Vec3<float> r = result(i, sum);
    product[i] = {r.x, r.y, r.z, 0.f};
  }
};

/// velocity -= K vector, walls moving: a step so short that it need not be implicit.
template <class Separation>
struct ExplicitViscosity : ViscousProduct<Separation> {
  using Product = ViscousProduct<Separation>;
  using Product::place, Product::walls;
  VecView velocity;

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD void finish(int i, const typename Product::template Sum<Float4>& sum) const {
    velocity.set(i, velocity[i] - this->result(i, sum) + walls.drag(i, place[i]).source);
  }
};

/// Inverses of the 3 x 3 blocks on the diagonal of 1 + K.
template <class Separation>
struct ViscousBlocks : ViscousPairs<Separation> {
  using Pairs = ViscousPairs<Separation>;
  using Pairs::place, Pairs::scale, Pairs::walls, Pairs::separation;
  static constexpr int columns = 1;
  Float4 *diagonal, *cross;  // xx, yy, zz; xy, yz, zx

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<1> inputs() const { return {{place}}; }
  template <class Q>
  struct Particle {
    Q place;
  };
  template <class Q>
  struct Sum {
    Q square, cross;
  };
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    const Q apart = separation(i.place, j.place), weighted = weight * apart;
    sum.square = multiply_add(weighted, apart, sum.square);
    sum.cross = multiply_add(weighted, rotate(apart), sum.cross);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const WallDrag drag = walls.drag(i, place[i]);
    const Float4 s = sum.square, c = sum.cross;
    const float xx = 1.f + scale * s.x + drag.rate.x, yy = 1.f + scale * s.y + drag.rate.y,
                zz = 1.f + scale * s.z + drag.rate.z, xy = scale * c.x + drag.cross.x,
                yz = scale * c.y + drag.cross.y, zx = scale * c.z + drag.cross.z;
    const float a = yy * zz - yz * yz, b = zx * yz - xy * zz, d = xy * yz - zx * yy;
    const float inverse = 1.f / (xx * a + xy * b + zx * d);
    diagonal[i] = {inverse * a, inverse * (xx * zz - zx * zx), inverse * (xx * yy - xy * xy), 0.f};
    cross[i] = {inverse * b, inverse * (xy * zx - xx * yz), inverse * d, 0.f};
  }
};

inline NoSlipWalls no_slip_walls_of(const Parameters& p, float strength) {
  NoSlipWalls walls{domain_walls(p)};
  for (int k = 0; k < 3; ++k) {
    walls.on[k] &= p.no_slip;
    for (int end = 0; end < 2; ++end) {
      for (int c = 0; c < 3; ++c) walls.velocity[k][end][c] = p.wall_velocity[k][end][c];
    }
  }
  walls.inverse_h = 1.f / p.support_radius, walls.strength = strength;
  walls.least = 0.25f * p.spacing * walls.inverse_h;
  return walls;
}

/// With obstacles and sheets, where these hold the fluid and body_drag.h has made their columns.
inline NoSlipWalls no_slip_of(const State& state, float strength) {
  NoSlipWalls walls = no_slip_walls_of(state.parameters, strength);
  const ViscosityState& s = state.viscosity;
  if (s.body_rate.size() > 0) {
    walls.body_rate = s.body_rate.data(), walls.body_cross = s.body_cross.data();
    walls.body_source = s.body_source.data();
  }
  return walls;
}

template <class Separation>
ViscousPairs<Separation> viscous_pairs_of(const State& state, const Separation& separation) {
  const Parameters& p = state.parameters;
  const float h = p.support_radius, strength = viscous_strength(p, state.dt);
  const float volume = p.particle_mass / p.rest_density / (h * h * h);
  return {state.pressure.place.data(), strength * ViscousWeight::factor * volume / (h * h),
          no_slip_of(state, strength), separation};
}

}  // namespace drench::sim::DRENCH_BACKEND
