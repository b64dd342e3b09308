#pragma once
// The coupling as published, kept for comparison; what is wrong with it: docs/theory/harada2007.md.

#include "sim/neighbours/sph_kernels.h"
#include "sim/passes/coupling/contact_rows.h"
#include "sim/passes/coupling/polygon_grid.h"

namespace drench::sim::DRENCH_BACKEND {

/// Nearest polygon by centroid among 27 voxels (eq 5) and the distance to its plane (eq 6, divided
/// by twice the area, without which it is no distance). No lateral bound, no memory of the side.
void find_nearest_centroids(State& state);

/// Contact force m (epsilon - d) n / dt^2 (eq 7, epsilon the particle spacing) and wall viscosity
/// (eq 8) added to the accelerations. Eq 8 is taken with its printed sign and with the Laplacian,
/// the only reading that has the units of a force density, and with the physical viscosity: that
/// sign feeds energy to the fluid, and with the numerical one as well it diverges. Only the
/// colliding force is given back (eq 10).
void add_paper_forces(State& state);

/// Reaction (eqs 10, 11): minus the sum of the colliding forces, equal thirds to the vertices.
void gather_paper_reaction(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
