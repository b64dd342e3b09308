#pragma once
// Counts paths through cloth from stored states alone, in double, by an algorithm of its own.

#include "tests/sim/support.h"

namespace drench::sim_tests {

/// How many pairs of particle and triangle pass through each other between two states one substep
/// apart, all moving on straight lines. The signed volume of the moving tetrahedron is a cubic; its
/// Bernstein coefficients are halved until they have one sign or the interval is 2^-40 long, and
/// the place of each root is then tested against the triangle's outline (1e-9 of its size counts as
/// inside).
/// @param period  m, of periodic axes, 0 for others: paths are those to the nearest images, and
/// triangles stand a period to either side as well.
int count_crossings(const sim::ClothTopology& cloth, const sim::HostState& before,
                    const sim::HostState& after, const V3d& period = V3d(0));

/// Particles under a sheet that is pinned along its square outline at `height`, m local: by the
/// solid angles of the sheet and of the flat square, which differ by 4 pi for a point between the
/// two.
int count_below(const sim::ClothTopology& cloth, const sim::HostState& state,
                const sim::HostVec& flat, double height);

}  // namespace drench::sim_tests
