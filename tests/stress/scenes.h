#pragma once
// Scenes of the stress tests: incompressible water and cotton.

#include <vector>

#include "pipeline/contract/frames.h"
#include "tests/sim/support.h"
#include "tests/temporary_folder.h"

namespace drench::stress_tests {

/// Nothing but gravity and a spacing; no walls.
Shot water(double spacing);
/// Cotton: 0.2 kg/m^2, 6000 N/m, damped as by default.
void cotton(Cloth& sheet);
/// Water of 12 x 5 x 12 particles, 20 mm apart, that falls 0.1 m onto a pinned sheet in a shaft of
/// 0.32 m. @param mass_ratio  rho a / sigma; 100 is cotton.
Shot fall_on_sheet(double mass_ratio, int cells = 16);

/// A sheet whose mesh is written to a file of `folder`; every vertex of its rim is pinned.
Cloth& add_mesh(Shot& shot, const TriangleMesh& mesh, const test::TemporaryFolder& folder);
/// A square of `size` m about (0, height, 0) with grid lines at these places in x and in z, 0 to 1.
TriangleMesh square_mesh(double size, double height, const std::vector<double>& line);

}  // namespace drench::stress_tests
