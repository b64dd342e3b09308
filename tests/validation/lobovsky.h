#pragma once
// Impact of a collapsing column on the far wall of its tank: Lobovsky et al. 2014, sensor P1.

namespace drench::validation {

/// In units of the experiment: T = t sqrt(g / H), P = p / (rho g H), 1 ms means.
struct Impact {
  double time = 0;          // relative error of the time at which P first passes 0.5
  double impulse = 0;       // of the mean over half a unit of T from then on
  double peak = 0;          // of the largest P
  double plateau = 0;       // of the mean over T from 3.5 to 5.5
  double wall = 0;          // P of the plateau, of the run
  double frictionless = 0;  // its relative error to the head of Ritter's wave
  double thickness = 0;     // kinetic energy across the plane over all of it, at the end
  int particles = 0;
};
/// @param across  particles over the 0.3 m of the column's height; the tank is plane, 5 wide
Impact lobovsky(int across, double tolerance);

}  // namespace drench::validation
