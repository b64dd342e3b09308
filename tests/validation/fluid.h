#pragma once
// Flows with a known answer, run with the incompressible solver: what the tests gate and the bench
// draws as curves of time against error.

namespace drench::validation {

/// Collapse of a column twice as high as wide onto a dry floor, plane (Martin and Moyce 1952,
/// tables 2 and 6, figure 3 of two widths; n^2 = 2, a = 0.05715 m).
struct Collapse {
  double front = 0;  // RMS of the front's relative error, after the best shift in time
  double shift = 0;  // in T, at most 0.3 either way: the experiment's gate
  // The same of figure 3, the larger of two widths. The experiment's series are 1.2 to 2.7 % from
  // each other by this measure.
  double figures = 0;
  double slope = 0;   // dZ/dT past Z = 2; Ritter's limit is 2
  double height = 0;  // RMS of the error of the height at the back wall over the first, unshifted
  double thickness = 0;  // kinetic energy across the plane over all of it, at the end
  int particles = 0;
};
/// @param across  particles across the width of the column.
Collapse martin_moyce(int across, double tolerance);

/// A column of 0.2 m at rest between walls, `layers` deep, averaged over the last tenth of
/// `seconds`; its volume is that after `until` s.
struct Rest {
  double pressure = 0;  // RMS over the height of the error of the mean pressure, over rho g H
  double density = 0;   // mean of |rho / rho_0 - 1| a support below the surface
  double drift = 0;     // RMS speed after `seconds` over sqrt(g H)
  double volume = 0;    // the centre of mass' height over that of the start, less 1
  int particles = 0;
};
Rest resting_column(int layers, double seconds, double until, double tolerance);

}  // namespace drench::validation
