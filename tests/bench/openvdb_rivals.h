#pragma once
// The ways from particles to a mesh that OpenVDB carries, to be timed beside ours.

#include "pipeline/contract/frames.h"

namespace drench::bench {

/// Union of spheres of one spacing (tools::ParticlesToLevelSet), two Gaussian passes of the level
/// set, half a spacing taken off again, tools::volumeToMesh.
/// @param voxel  m
/// @return positions in m and triangles, quads cut in two; neither velocity nor normals.
TriangleMesh openvdb_level_set(const ParticleFrame& particles, double voxel);

/// points::rasterizeSmoothSpheres (Zhu and Bridson 2005) with radius 0.5 and search radius 2
/// spacings, the point grid included, then tools::volumeToMesh.
TriangleMesh openvdb_smooth_spheres(const ParticleFrame& particles, double voxel);

}  // namespace drench::bench
