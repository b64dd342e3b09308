#pragma once
// Particles -> closed triangle mesh with velocities.

#include "pipeline/contract/frames.h"
#include "pipeline/contract/shot.h"

namespace drench {

/// Reconstructs the fluid surface of one frame.
///
/// @param particles  n >= 0 particles. Not modified. Densities, when present, are used, never recomputed.
/// @param settings   voxel and support in spacings.
/// @return closed manifold mesh, outward orientation, velocity in m/s interpolated from the particles,
///         unit normals; the lattice is locked to the world origin; the same bits for any thread count.
///         Empty mesh if there are no particles.
/// @throws drench::Error if a position or velocity is not finite (with its index), or the blocks would
///         need more than settings.memory_gib.
TriangleMesh surface_frame(const ParticleFrame& particles, const SurfaceSettings& settings);

}  // namespace drench
