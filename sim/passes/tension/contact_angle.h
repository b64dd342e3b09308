#pragma once
// Contact angles. Young 1805: where a surface of tension sigma ends on a wall, the wall pulls the
// edge of the fluid along itself, outwards, by sigma cos(theta) a length. The layer along the wall
// gets that as a stress, the same in all directions along the wall:
//   m dv_i/dt = sum_j V^2 (P_i t_i + P_j t_j) (-W'(r) / r),   P(z) = sigma cos(theta) D(z / h) / h,
// V = a^3, t: the vector from j to i without its part along the wall's normal, z: distance. It
// cancels within the layer and sums to the pull at its edge, whatever the edge's shape. D is the
// kernel's integral over the plane; as neighbours end at the wall, the stress over all depths is
// sigma cos(theta) times the integral of D H, H = 1 - WendlandC2::halfspace, which the factor 8 / 3
// makes 1: nothing is fitted. Forces are equal and opposite between particles, and averaged over
// neighbourhoods as in surface_tension.h. What holds a drop at a wall is the mirrors' part of
// surface tension.

#include "sim/passes/tension/surface_tension.h"

namespace drench::sim::DRENCH_BACKEND {

/// Fraction of a wetting stress beside this surface (unit normal; w: s, surface_tension.h): none
/// where the fluid is one layer thick, s = 0.5 along the wall's normal, which no tension holds
/// together.
DRENCH_HD float backed_fraction(const Float4& surface, Vec3<float> wall_normal) {
  const Vec3<float> n{surface.x, surface.y, surface.z};
  return max0(1.f - 2.f * max0(surface.w * dot(n, wall_normal)));
}

/// kick = dt times the sum above over m.
template <class Separation>
struct FaceForce {
  static constexpr int columns = 2;
  const Float4 *position, *face;  // face: unit normal of the wall; w: P h / sigma
  Float4* kick;                   // m/s
  float scale;                    // 1/s, of the sum
  Separation separation;

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<2> inputs() const { return {{position, face}}; }
  template <class Q>
  struct Particle {
    Q position, face;
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
    const Q x = separation(i.position, j.position);
    const Q along_i = x - i.face * splat_sum(i.face * x);
    const Q along_j = x - j.face * splat_sum(j.face * x);
    const Q stress = splat_w(i.face) * along_i + splat_w(j.face) * along_j;
    sum.push = multiply_add(stress, weight, sum.push);
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 s = sum.push;
    kick[i] = {scale * s.x, scale * s.y, scale * s.z, 0.f};
  }
};

/// Adds the step's kicks to the velocities, by the normals of apply_surface_tension. Overwrites
/// PressureState::scratch_a.
void apply_contact_angles(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
