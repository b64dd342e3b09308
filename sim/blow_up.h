#pragma once
// Why a simulation may have blown up, from its last state: what the message names.

#include <string>

#include "sim/setup/scene.h"

namespace drench::sim {

/// The particle or vertex that was found first.
struct Culprit {
  bool particle = true;
  int index = 0;  // in the columns of the state
};

/// What rules, and what to do about it: fluid that sources press into a full domain, obstacles that
/// leave it no room, an obstacle that closes on a wall or another obstacle, a sheet that is
/// stretched far beyond its length, one of its triangles; else the settings of the solver.
/// @param density  of the particles, kg/m^3. @param crowded  of each emitter: it has no room.
/// @param time  s since the first frame, dt  s, of the
/// step.
std::string cause_of_blow_up(const Shot& shot, Scene& scene, const HostState& state,
                             const std::vector<float>& density, const std::vector<bool>& crowded,
                             const Culprit& culprit, double time, double dt);

}  // namespace drench::sim
