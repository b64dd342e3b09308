#pragma once
// Gravity over time, as the domain sees it, and how the domain turns.

#include "pipeline/contract/shot/shot.h"

namespace drench {

/// m/s^2 at a film frame, which may be fractional: that of the world, turned back by the angle that
/// the domain has turned by.
V3d gravity_at(const Shot& shot, double frame);

/// How the domain lies in the world at a film frame: turned about an axis, and turning.
struct FrameTurn {
  V3d axis{0, 1, 0}, center{0, 0, 0};  // unit; m
  double angle = 0, rate = 0;          // rad, rad/s

  V3d position_in_world(const V3d& position) const;
  V3d velocity_in_world(const V3d& position, const V3d& velocity) const;
  V3d position_from_world(const V3d& position) const;
  /// @param position  as the domain has it.
  V3d velocity_from_world(const V3d& position, const V3d& velocity) const;
  /// -w x (w x r), m/s^2.
  V3d centrifugal(const V3d& position) const;
};

/// The rate is the slope of shot.frame_rotation_deg from the right, 0 before its first key and
/// after the last.
FrameTurn frame_turn_at(const Shot& shot, double frame);

/// m/s^2, of all keys.
double largest_gravity(const Shot& shot);

}  // namespace drench
