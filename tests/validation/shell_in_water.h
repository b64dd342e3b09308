#pragma once
// Shells that bear water, from shot files, against a closed form and a measurement
// (tests/validation/README.md): tests hold them to tolerances, benches say what the error costs.
// @throws std::runtime_error where a file of validation cannot be read.

namespace drench::validation {

/// Deflection of the middle of Fourey's plate under water, mean of 0.2 to 0.6 s, over that of the
/// closed form. @param across  spacings along the plate
double plate_under_water(int across);

/// What the tip of a gate does in 0.3 s.
struct OpenedGate {
  double x = 0, y = 0;             // RMS error over 46.4 mm, the most that was measured
  double most = 0, most_time = 0;  // m, s: of x
  bool blew_up = false;
};
/// The gate of Antoci, Gallati and Sibilla 2007. @param a  m, spacing
OpenedGate opened_gate(double a);

}  // namespace drench::validation
