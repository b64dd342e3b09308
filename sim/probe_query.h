#pragma once
// What a probe asks of the state that a step ended with: places in the local frame, numbers worked
// out once. Host and device, both builds. What is measured: sim/passes/probe/probe.h.

namespace drench::sim {

enum class ProbeKind {
  height,          // m local
  wall_pressure,   // Pa
  inner_pressure,  // Pa, of an obstacle or sheet where the disc lies on one
  wall_force,      // N, x y z
  cloth_force,     // N, x y z
  obstacle_force,  // N, x y z
  vertex,          // m local, x y z
  energy,          // J: kinetic, potential, of the springs
  velocity,        // m/s, x y z; NaN without fluid
  front,           // m local, along the normal; NaN without fluid
  volume,          // particles; m local, their mean place x y z; mean of max(rho / rho_0 - 1, 0)
};

struct ProbeQuery {
  ProbeKind kind = ProbeKind::height;
  float place[3] = {0, 0, 0};   // m: the line, the disc's centre, where potential energy is zero
  float normal[3] = {0, 1, 0};  // of the disc, or where the front is looked for; unit
  float radius = 0,
        rim = 0;           // m: of the disc or ball, and half the width over which its weight falls
  float extent = 1;        // m^2 on a wall, m^3 inside: the weights' integral over the domain
  int axis = 0, side = 0;  // of the wall; 0 the low one, 1 the high one
  int begin = 0, end = 0;  // vertices; begin: the obstacle
  int on = -1;             // the one obstacle whose surface the disc may lie on; -1: any
};

}  // namespace drench::sim
