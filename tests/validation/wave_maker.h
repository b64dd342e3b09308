#pragma once
// A piston that makes waves in a plane tank: the third axis is periodic, and the piston is a keyed
// box that spans it.

namespace drench::validation {

/// Linear waves of k d = 1 on water d = 0.2 m deep, stroke S = 0.2 d, in a tank of 16 depths;
/// measured until waves come back from its end. Far from the piston their height is
///   H / S = 2 (cosh 2kd - 1) / (sinh 2kd + 2kd),
/// the part of the piston's even velocity that goes as cosh k z (Havelock 1929, Biesel 1951), and
/// omega^2 = g k tanh kd.
struct WaveMaker {
  double expected = 0;   // H / S
  double made = 0;       // measured over expected, traced back to the piston by the decay
  double carried = 0;    // the same as gauges 3 to 6 depths away have it
  double decay = 0;      // of the amplitude, 1 / wavelength, between these
  double length = 0;     // wavelength by the phases there over that of linear theory
  double thickness = 0;  // kinetic energy across the plane over all of it, at the end
  int particles = 0, steps = 0;
};
/// @param layers  particles from the floor to the surface.
WaveMaker wave_maker(int layers, double tolerance);

}  // namespace drench::validation
