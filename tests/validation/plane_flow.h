#pragma once
// Plane flows with a closed form: the third axis is periodic and five particles thick. Run with the
// incompressible solver without XSPH, from a settled packing: a lattice resists shear by itself.

namespace drench::validation {

/// A standing wave of length 1 m on water 0.5 m deep, 2 % of the depth high, over five periods. The
/// surface starts flat and as fast as the linear wave: omega^2 = g k tanh(k d).
struct StandingWave {
  double period = 0;     // relative error of the mean period
  double amplitude = 0;  // of the fifth period over that of the first
  double thickness = 0;  // kinetic energy across the plane over all of it, at the end
  int particles = 0;
};
/// @param layers  particles from the floor to the surface.
StandingWave standing_wave(int layers, double tolerance, double periods);

/// A disc of radius R = 1 m with velocity (-x, y) / s and no gravity becomes an ellipse: Monaghan
/// 1994, data/elliptical_drop.csv. Half axes are twice the RMS of the particles' coordinates.
struct EllipticalDrop {
  double axis = 0;       // largest relative error of either axis until the end
  double energy = 0;     // largest relative change of kinetic energy until the end
  double thickness = 0;  // kinetic energy across the plane over all of it, at the end
  int particles = 0;
};
/// @param across  particles to the radius.
EllipticalDrop elliptical_drop(int across, double tolerance, double seconds);

/// Taylor and Green's vortices, Re = U L / nu = 100: velocities decay as exp(-8 pi^2 nu t / L^2).
struct TaylorGreen {
  double rate = 0;       // relative error of the decay rate of the RMS speed, fitted over the time
  double mode = 0;       // the same of the amplitude of the vortices' own mode
  double speed = 0;      // largest relative error of the RMS speed
  double density = 0;    // RMS of density's deviation from its mean, over rest, at the end
  double thickness = 0;  // kinetic energy across the plane over all of it, at the end
  // What friction between pairs takes at the places and velocities that particles have, over what
  // a continuum's does, less 1: mean over the time. The rest of `rate` is other losses.
  double friction = 0;
  int particles = 0, iterations = 0, steps = 0;
};
/// @param across  particles to the side of the square.
/// @param times  L / U.
TaylorGreen taylor_green(int across, double tolerance, double times);

}  // namespace drench::validation
