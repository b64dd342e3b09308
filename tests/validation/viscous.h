#pragma once
// Viscous flows with a known answer, run with the incompressible solver: see fluid.h.

#include "sim/setup/scene.h"

namespace drench::validation {

/// A shot's scene, its particles up to `by` spacings off their places. A lattice is the densest
/// packing that is at rest: another needs room, or its pressures jam it. It has 1 % more along x.
sim::Scene shaken(const Shot& shot, double by);

enum class Flow { couette, poiseuille };  // the upper wall moves; gravity along the walls

/// u over the largest u, of the start from rest between no-slip walls at 0 and 1.
/// @param time  nu t / L^2, > 0. Series of tests/validation/README.md, section 2.
double start_up_velocity(Flow flow, double time, double y);

/// Start from rest at Re = u_max L / nu = 1, periodic along the walls: what flows within nu t / L^2
/// = 1 goes once around or more.
struct Channel {
  double error[3] = {};   // L2 over all particles, of u_x over u_max, at 0.05, 0.2 and 1
  double iterations = 0;  // of the viscous solve, a step
  double strength = 0;    // dt nu / h^2
  double thickness = 0;   // kinetic energy across the plane over all of it, at the end
  int particles = 0, steps = 0;
};
/// @param across  particles from wall to wall; 100 times as many steps.
/// @param shaken  spacings by which particles are off a lattice at the start, at most.
Channel start_up(Flow flow, int across, double shaken);

/// A block of honey, twice as wide as high, spreads on a no-slip floor between periodic planes:
/// Huppert 1982, half of it per width A: x = 1.411 (g A^3 / 3 nu)^(1/5) t^(1/5) once it is shallow.
struct Spreading {
  double front = 0;        // RMS of the front's relative error while 2.5 to 4.5 times the start's
  double exponent = 0;     // of time, fitted there; 1/5
  double energy_gain = 0;  // largest of a step, over that of the start
  double thickness = 0;    // kinetic energy across the plane over all of it, most of all steps
  int particles = 0, steps = 0;
};
/// @param high  particles from the floor to the top of the block.
Spreading huppert(int high);

}  // namespace drench::validation
