#pragma once
// What a frame that turns about an axis does to velocities, which are relative to it, over a step:
//   du/dt = -dw/dt x r - w x (w x r) - 2 w x u,      r from a point of the axis,
// the forces of Euler, of the centrifuge and of Coriolis (Landau and Lifshitz, Mechanics, section
// 39). Coriolis' turns velocities and does no work: the trapezoidal rule, solved in closed form,
// keeps their length to rounding. It goes before gravity, at the positions that the step starts
// with.

#include "sim/backend/parallel.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

struct TurningFrame {
  Vec3<float> rate, change, centre;  // rad/s, rad/s, m
  float dt;                          // s

  DRENCH_HD Vec3<float> operator()(Vec3<float> x, Vec3<float> u) const {
    const Vec3<float> r = x - centre, half = rate * dt,
                      b = u - cross(change, r) - cross(half, cross(rate, r)) - cross(half, u);
    return (b + half * dot(half, b) - cross(half, b)) * (1.f / (1.f + length2(half)));
  }
};

inline TurningFrame turning_frame_of(const State& state) {
  const FrameNow& now = state.frame;
  return {{now.rate[0], now.rate[1], now.rate[2]},
          {now.change[0], now.change[1], now.change[2]},
          {now.centre[0], now.centre[1], now.centre[2]},
          float(state.dt)};
}

/// What the turning of the domain does to the velocities of fluid and free vertices in a step.
void turn_frame(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
