#pragma once
// Where emitters can send from, and what of them comes to nothing over a shot.

#include "sim/setup/scene.h"

namespace drench::sim {

/// A place of an inlet at one time. Fluid begins as far ahead of it as it must to be clear of what
/// the inlet stands on or in, but no farther than a spacing.
struct InletPlace {
  enum class Blocked { no, by_obstacle, by_wall, by_open_side };
  double ahead = 0;  // m, along the velocity of what leaves
  Blocked blocked = Blocked::no;
  int obstacle = -1;  // by_obstacle
};

/// @param point  on the inlet, m, world. @param along  unit, the way of what leaves; or 0.
InletPlace inlet_place(const Shot& shot, ObstacleSet& obstacles, const V3d& point, const V3d& along,
                       double time);

/// Of emitter e over the frames of the shot.
/// @throws Error if it can never send a particle, whatever happens.
InletReport report_of_inlet(const Shot& shot, Scene& scene, size_t e);

}  // namespace drench::sim
