#pragma once
// Air drag on sheets. A triangle of area A in air that passes it with velocity u, normal n:
//   F = 1/2 rho A (C_n |u . n| (u . n) n + C_t |u| (u - (u . n) n)),
// the cross-flow principle of Taylor (1952): the normal force follows the normal velocity. With the
// magnitudes of the start of the (sub)step held, F is linear in the vertices' own velocities,
// F_i = B_i (u_air - v_i) with a third of every triangle around vertex i, times what makes it the
// area that the vertex's mass stands for (corners of grids: else they would fall ahead of the
// rest): symmetric, positive, and implicit in the step's end, so that the lightest cloth is stable.
// At rest and at terminal speed nothing of it is approximate; no lift at small angles, no wake, no
// shelter behind other sheets.

#include "sim/passes/coupling/polygon_grid.h"

namespace drench::sim::DRENCH_BACKEND {

/// The wind at a position, m/s.
DRENCH_HD Vec3<float> wind_at(const WindNow& wind, Vec3<float> x) {
  Vec3<float> u{wind.velocity[0], wind.velocity[1], wind.velocity[2]};
  for (int k = 0; k < wind.modes; ++k) {
    const float* wave = wind.wave[k];
    const float* amplitude = wind.amplitude[k];
    const float s = sinf(wave[0] * x.x + wave[1] * x.y + wave[2] * x.z + wind.phase[k]);
    u = u + Vec3<float>{amplitude[0], amplitude[1], amplitude[2]} * s;
  }
  return u;
}

/// B of a vertex, kg/s, and what it makes of a vector.
struct AirDrag {
  ConstVecView diagonal, cross;  // xx yy zz, xy yz zx
  bool on;

  template <class Index, class T>
  DRENCH_HD Vec3<T> times(Index i, Vec3<T> v) const {
    const Vec3<T> d = diagonal.at(i), c = cross.at(i);
    return {d.x * v.x + c.x * v.y + c.z * v.z, c.x * v.x + d.y * v.y + c.y * v.z,
            c.z * v.x + c.y * v.y + d.z * v.z};
  }
  /// (1 + s B)^-1 r, by Cramer's rule: the matrix is symmetric and no eigenvalue is below 1.
  template <class Index, class T>
  DRENCH_HD Vec3<T> settle(Index i, T s, Vec3<T> r) const {
    const Vec3<T> d = diagonal.at(i) * s, c = cross.at(i) * s;
    const T xx = T(1.f) + d.x, yy = T(1.f) + d.y, zz = T(1.f) + d.z;
    const T a = yy * zz - c.y * c.y, b = c.y * c.z - c.x * zz, e = c.x * c.y - yy * c.z;
    const T f = xx * zz - c.z * c.z, g = c.x * c.z - xx * c.y, h = xx * yy - c.x * c.x;
    const T inverse = T(1.f) / (xx * a + c.x * b + c.z * e);
    return Vec3<T>{a * r.x + b * r.y + e * r.z, b * r.x + f * r.y + g * r.z,
                   e * r.x + g * r.y + h * r.z} *
           inverse;
  }
};

inline AirDrag air_drag_of(const State& state) {
  const ClothState& c = state.cloth;
  return {c.air_diagonal.view(), c.air_cross.view(), state.parameters.air_density > 0.f};
}

/// B of every vertex and what the air pushes it with at its velocity, N.
void blow_at_cloth(State& state, const ConstVecView& position, const ConstVecView& velocity);

/// blow_at_cloth at the start of the step, into ClothState::air_diagonal, air_cross and air_push.
void wind_on_cloth(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
