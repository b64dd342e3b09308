#pragma once
// Gravity over time, as the domain sees it.

#include "pipeline/contract/shot.h"

namespace drench {

/// m/s^2 at a film frame, which may be fractional: that of the world, turned back by the angle that
/// the domain has turned by.
V3d gravity_at(const Shot& shot, double frame);

/// m/s^2, of all keys.
double largest_gravity(const Shot& shot);

}  // namespace drench
