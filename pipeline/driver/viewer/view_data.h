#pragma once
// What the viewer's page takes of an output folder: the scene as JSON, frames in binary,
// little-endian.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "pipeline/contract/frames.h"
#include "pipeline/driver/job.h"

namespace drench {

/// Frames that are there, domain, cameras, probes, names.
std::string view_scene(const Job& job, const Manifest& manifest);

/// The first `most` particles of an order in which any beginning is spread evenly over all, and in
/// which a particle keeps its place from frame to frame.
///
/// uint32 1, particles in all, particles here; float low[3], size[3], largest speed (m/s), least
/// and largest density (kg/m^3), largest age (s); then for each particle uint16 x, y, z of size,
/// uint8 speed, density, age of these ranges and 0.
std::string view_particles(const ParticleFrame& frame, size_t most);

/// uint32 2, vertices, triangles, values a vertex (2); float position[3] of each vertex; int8
/// normal[4]; float values[2]; uint32 triangle[3]. Values of a sheet are the largest stretch of an
/// edge at the vertex, less 1, and wetness; of fluid the speed, m/s, and 0.
enum class ViewMesh { sheet, fluid };
std::string view_mesh(const TriangleMesh& mesh, ViewMesh kind);

}  // namespace drench
