#pragma once
// Shells that the simulator brings to rest or swings, from shot files, and how far what they do is
// from closed forms and converged solutions (tests/validation/README.md): tests hold them to
// tolerances, benches say what the error costs. All are over the exact number, less 1; cells are
// along the sheet. @throws std::runtime_error where a file of validation lacks the row.

#include "tests/sim/shell_run.h"

namespace drench::sim_tests {

/// Elongation of a sheet that hangs by its edge, load = w L / (E h).
double hanging_error(SheetMesh mesh, int cells, double load);

/// Sag of a limp strip whose ends are as far apart as its length over 1.2.
double catenary_error(SheetMesh mesh, int cells);

/// Drop over span of a cantilever under its own weight, gamma = w L^3 / D of 1, 10 or 100,
/// `slenderness` thicknesses long, that is let go where it is straight.
double cantilever_error(SheetMesh mesh, int cells, double gamma, double slenderness);

/// Deflection of the middle of a square under its weight, clamped all around.
double plate_error(SheetMesh mesh, int cells);

/// Period of a cantilever in its first mode, in steps of dt seconds.
double mode_error(SheetMesh mesh, int cells, double dt);

/// Logarithmic decrement of the same at so much of critical damping, in so many steps a period.
double mode_loss_error(SheetMesh mesh, int cells, double ratio, int steps);

/// Period of a stiff sheet that swings about a row of held vertices from 90 degrees.
double pendulum_error(SheetMesh mesh, int cells);

}  // namespace drench::sim_tests
