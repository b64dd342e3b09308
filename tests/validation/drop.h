#pragma once
// A drop in zero gravity with surface tension against Rayleigh's period and Laplace's pressure.

namespace drench::validation {

struct Drop {
  double period = 0;    // of mode 2, over 2 pi sqrt(rho R^3 / (8 sigma))
  double jump = 0;      // mean pressure inside over a period, over 2 sigma / R
  double current = 0;   // RMS speed of the drop at rest, over R omega
  double momentum = 0;  // largest found at rest, over the mass times R omega
  double kept = 0;      // amplitude after a period over the one before
  int particles = 0;
};
/// @param radius  in spacings; R is that of a ball of the particles' volume.
Drop oscillating_drop(double radius);

/// The same in a plane: a cylinder between ends that its surface meets at a right angle, or without
/// any. Over sqrt(rho R^3 / (6 sigma)) and sigma / R.
enum class Ends { periodic, walls, boxes, sheets };
Drop oscillating_cylinder(double radius, Ends ends);

/// A cube of side^3 particles left alone for four periods of its drop: what became of it.
struct Rounding {
  double farthest = 0;  // particle centre from the centre of mass, plus half a spacing, over R
  double spread = 0;    // largest less smallest RMS extent along x, y, z, over their mean
  double start = 0;     // `farthest` of the cube
};
Rounding cube_to_sphere(int side);

}  // namespace drench::validation
