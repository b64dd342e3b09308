#pragma once
// Columns of the particles on the vertices of the mesh: source, age, wetness.

#include "surfacing/marching_cubes.h"

namespace drench::surfacing {

/// Fills the columns of `result` that the frame has, by vertex of `mesh`. Age and wetness are means
/// of the particles within `reach` voxels, weighted with (1 - (r / reach)^2)^3: never beyond what
/// the particles have, whatever meets there. The source is that of the nearest particle.
void add_attributes(const LatticeMesh& mesh, const BinnedParticles& particles,
                    const ParticleFrame& frame, float reach, TriangleMesh& result);

}  // namespace drench::surfacing
