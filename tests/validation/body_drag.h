#pragma once
// Viscous flows along obstacles and sheets with a known answer: see fluid.h.

namespace drench::validation {

struct Dragged {
  double error = 0;       // what the function says
  double scale = 0;       // m/s or what the function says
  double force = 0;       // what the function says
  double iterations = 0;  // of the viscous solve, a step
  double thickness = 0;   // of plane flows: kinetic energy across the plane over all of it
  int particles = 0, steps = 0;
};

/// A closed trough, four times as long as deep, between two planes of which the upper slides: in
/// the middle, where nothing flows through as a whole, u / U = 3 y^2 - 2 y.
/// @return error: L2 over the middle, over U; scale: m/s, largest return speed over U (1/3)
Dragged lid_driven(int across);

enum class Floor { plane, box, sheet };  // the last is pinned at every vertex

/// A film runs down a slope of 30 degrees, nu^2 = 2 g sin(slope) d^3: after 2 d^2 / nu its middle
/// has Nusselt's profile, u = g sin(slope) (d y - y^2 / 2) / nu, and what carries it gets the share
/// of its weight along the slope that does not accelerate it.
/// @return error: L2 over the middle quarter, over the largest speed; scale: mean speed there over
///         the right one; force: of obstacles and acceleration, over the weight's
Dragged film(Floor floor, int layers);

/// Couette flow between walls that slide against each other, with a free sheet at a quarter of its
/// height: the sheet goes with the fluid.
/// @param mass  of the sheet over that of a layer of particles.
/// @return error: of the sheet's mean speed over the fluid's there, 1 is right; scale: L2 of the
///         fluid's over the walls'; force: of how far the sheet has come off its height, spacings
Dragged towed_sheet(int across, double mass);

}  // namespace drench::validation
