#pragma once
// Particle caches: OpenVDB point grids that open in Houdini, and level sets. Library drench_vdb.

#include <filesystem>

#include "pipeline/contract/files/files.h"
#include "pipeline/contract/frames.h"

namespace drench {

/// Writes 16-bit positions in voxels of 4 spacings, half velocities and the columns present, Blosc.
/// Equal frames give equal bytes (the header's random UUID becomes a digest of the content), for
/// any thread count. Order of particles is kept only up to `id`.
WrittenFile write_particles(const std::filesystem::path& path, const ParticleFrame& frame);

/// Particles sorted by id when the file has ids. @throws Error if damaged or not such a file.
ParticleFrame read_particles(const std::filesystem::path& path);

/// Grid `surface`: narrow-band level set of a closed mesh, m, band of 3 voxels a side. Grid `v`:
/// on the band's voxels the mesh's velocity at the closest point (beyond a voxel from the mesh one
/// up to a voxel farther), m/s, half floats. Equal meshes give equal bytes, for any thread count.
/// @throws Error naming the vertex if the file cannot hold where it is or how it moves.
WrittenFile write_level_set(const std::filesystem::path& path, const TriangleMesh& mesh,
                            double voxel);

}  // namespace drench
