#pragma once
// What a surface mesh must be, counted from its triangles alone.

#include <cstddef>

#include "pipeline/contract/frames.h"

namespace drench::surfacing_checks {

/// All zero for a closed, oriented 2-manifold.
struct Defects {
  size_t unmatched_edges = 0;  // directed edges not met by exactly one opposite one
  size_t repeated_edges = 0;   // directed edges of more than one triangle
  size_t split_fans = 0;       // vertices whose triangles form more than one ring, or none
  size_t bad_triangles = 0;    // an index twice, or beyond the vertices
  bool operator==(const Defects&) const = default;
};
Defects defects_of(const TriangleMesh& mesh);

struct Topology {
  size_t components = 0;
  long euler = 0;  // V - E + F: 2 for each ball-like part, less 2 for each handle
};
Topology topology_of(const TriangleMesh& mesh);

double volume_of(const TriangleMesh& mesh);  // m^3, by the divergence theorem

/// Against a sphere of `radius` (m) about the origin; lengths in `unit` (m), angles in degrees.
struct SphereError {
  double bias = 0, scatter = 0, max = 0;  // of the vertices' signed distance
  double volume = 0;                      // relative
  double normal_mean = 0, normal_max = 0;
};
SphereError sphere_error(const TriangleMesh& mesh, double radius, double unit);

/// Share of triangles with an angle below `degrees`.
double sliver_share(const TriangleMesh& mesh, double degrees);

/// Pairs of a triangle of the mesh and one of the sheet of which an edge of one passes through the
/// inside of the other, by the signs of volumes in double.
size_t crossings_of(const TriangleMesh& mesh, const TriangleMesh& sheet);

/// From a point to a mesh, m.
double distance_to(const TriangleMesh& mesh, const Imath::V3f& point);

}  // namespace drench::surfacing_checks
