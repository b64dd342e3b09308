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

/// Half a ball of water of this radius in spacings on a plane, or a block of about that volume on a
/// wall of the domain or a held sheet, without gravity, with viscosity to come to rest: the angle
/// of the cap that it becomes. The mean over a Rayleigh period after five.
struct Sessile {
  double by_centre = 0, by_height = 0;  // deg: from the volume and the centre of mass, the top
  double speed = 0;                     // RMS, over R omega
  double lost =
      0;  // momentum of the fluid and of the plane (of no other), over the mass times R omega
  int away = 0;  // particles farther than 3 radii off
  int particles = 0;
};
enum class Ground { plane, wall, sheet };
Sessile sessile_drop(double radius, double angle_deg, Ground ground = Ground::plane);

/// A cube of side^3 particles left alone for four periods of its drop: what became of it.
struct Rounding {
  double farthest = 0;  // particle centre from the centre of mass, plus half a spacing, over R
  double spread = 0;    // largest less smallest RMS extent along x, y, z, over their mean
  double start = 0;     // `farthest` of the cube
};
Rounding cube_to_sphere(int side);

}  // namespace drench::validation
