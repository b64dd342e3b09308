#pragma once
// Particles -> closed triangle mesh with velocities.

#include <optional>
#include <span>

#include "pipeline/contract/frames.h"
#include "pipeline/contract/shot/shot.h"

namespace drench {

/// Blocks deep inside the fluid hold no surface. `evaluate` computes them all the same; the mesh
/// must have the same bits (a test holds this), so there is no reason to but that test.
enum class InteriorBlocks { skip, evaluate };

/// What surface_frame did.
struct SurfaceStats {
  size_t particles = 0;
  size_t occupied_blocks = 0, interior_blocks = 0;  // 8^3 lattice points each
  size_t evaluated_blocks = 0, grown_blocks = 0;    // grown: added by the closure
  int closure_rounds = 0;
  size_t components = 0, vertices = 0, triangles = 0;
  size_t contact = 0, crossing = 0;             // triangles on cloth, and through it all the same
  double volume = 0;                            // m^3, enclosed, before slivers are removed
  double bin_s = 0, weight_s = 0, field_s = 0;  // wall seconds of the steps
  double extract_s = 0, smooth_s = 0, velocity_s = 0;
};

/// What the fluid lies on. Meshes in m, world; taken as they are while a frame is made.
struct Surroundings {
  std::span<const TriangleMesh> cloth = {};      // with velocities
  std::span<const TriangleMesh> obstacles = {};  // outward oriented
  std::optional<float> ground = {};              // y of the ground that is drawn
};

/// Reconstructs the fluid surface of one frame.
///
/// @param particles  n >= 0 particles; positions in m, velocities in m/s, n each. Not modified.
///                   Densities are not read: where neighbours are missing is found from positions.
/// @param settings   voxel and support in spacings; iso_value in (0, 1); smoothing passes >= 0.
/// @param around     Fluid is cut apart where cloth goes through it and lies 0.02 spacings before
///                   it; faces between vertices that lie there are `contact` and move with the
///                   cloth. Into obstacles and the ground it goes a little (overlap.h).
/// @return closed manifold mesh, outward orientation, velocity in m/s interpolated from the
///         particles (a uniform or an affine motion comes out as it went in), the columns source,
///         age and wetness where the particles have them, unit normals; the lattice is locked to
///         the world origin; the same bits for any thread count. Empty mesh if there are no
///         particles, or if they are too thin for the field to reach iso_value anywhere.
/// @throws drench::Error if a position or velocity is not finite (with its index), columns differ
///         in length, a setting is impossible, particles are spread beyond 2^24 voxels, or the
///         blocks and the mesh would need more than settings.memory_gib.
TriangleMesh surface_frame(const ParticleFrame& particles, const SurfaceSettings& settings,
                           const Surroundings& around = {},
                           InteriorBlocks interior = InteriorBlocks::skip,
                           SurfaceStats* stats = nullptr);

}  // namespace drench
