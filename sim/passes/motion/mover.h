#pragma once
// Where a particle goes that nothing but the domain's walls stops.

#include "sim/backend/parallel.h"
#include "sim/neighbours/periodic.h"
#include "sim/passes/motion/domain_walls.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// Symplectic Euler inside the walls: velocity first, then position. A particle that still reaches
/// the last tenth of a spacing before a wall stops there (the wall's pressure has failed it). One
/// that leaves through a periodic side comes in at the other.
struct Mover : DomainWalls {
  bool periodic[3];
  float dt;  // s

  template <class T>
  DRENCH_HD Vec3<T> operator()(Vec3<T> x, Vec3<T>& v) const {
    return {along(0, x.x, v.x), along(1, x.y, v.y), along(2, x.z, v.z)};
  }
  template <class T>
  DRENCH_HD T along(int k, T x, T& v) const {
    T p = x + T(dt) * v;
    if (periodic[k]) p = wrap(p, low[k], high[k]);
    if (!on[k]) return p;
    const auto under = p < T(low[k]);
    const auto over = p > T(high[k]);
    v = select(under, max0(v), select(over, -max0(-v), v));
    return select(under, T(low[k]), select(over, T(high[k]), p));
  }
  DRENCH_HD Vec3<float> wrapped(Vec3<float> x) const {
    float p[3] = {x.x, x.y, x.z};
    for (int k = 0; k < 3; ++k)
      if (periodic[k]) p[k] = wrap(p[k], low[k], high[k]);
    return {p[0], p[1], p[2]};
  }
  DRENCH_HD Vec3<float> inside(Vec3<float> x) const {
    float p[3] = {x.x, x.y, x.z};
    for (int k = 0; k < 3; ++k)
      if (on[k]) p[k] = minimum(maximum(p[k], low[k]), high[k]);
    return {p[0], p[1], p[2]};
  }
};

/// @param dt  s
inline Mover mover_of(const Parameters& p, float dt) {
  Mover mover{domain_walls(p), {p.periodic[0], p.periodic[1], p.periodic[2]}, dt};
  for (int k = 0; k < 3; ++k) {
    const float margin = p.periodic[k] ? 0.f : 0.1f * p.spacing;
    mover.low[k] += margin, mover.high[k] -= margin;
  }
  return mover;
}

/// The same without periodic sides, for paths: they go on beyond the seam, where the images of
/// triangles are, and wrap_positions ends them.
inline Mover path_mover_of(const Parameters& p, float dt) {
  Mover mover = mover_of(p, dt);
  for (bool& axis : mover.periodic) axis = false;
  return mover;
}

/// Brings the fluid's positions back into the domain along its periodic axes.
void wrap_positions(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
