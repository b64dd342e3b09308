#pragma once
// Velocities on the vertices of the mesh, for motion blur.

#include <vector>

#include "surfacing/marching_cubes.h"

namespace drench::surfacing {

/// Velocity at every vertex, in the unit of `velocity` (n, by index in the frame): the affine
/// function of position that fits the particles within `reach` voxels best, by moving least
/// squares. Where they do not span a direction (a film, a lone particle) the fit leans to no
/// gradient along it, that is to the weighted mean. A vertex without particles in reach takes the
/// velocity of the nearest one gathered.
/// @param position  of the vertices in voxels from the lattice's origin; may differ from
/// mesh.position
std::vector<V3f> vertex_velocities(const LatticeMesh& mesh, const BinnedParticles& particles,
                                   const std::vector<V3f>& velocity, float reach);

}  // namespace drench::surfacing
