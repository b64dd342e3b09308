#pragma once
// Bumps of the size of a particle are smoothed away on the mesh; shape and volume stay.

#include <array>
#include <cmath>
#include <vector>

#include "surfacing/marching_cubes.h"

namespace drench::surfacing {

/// The neighbours of each vertex of a closed manifold mesh, each once, in the order in which the
/// triangles (v, a, b) around it follow each other: b is the next one's a. The first is the lowest.
struct VertexRings {
  std::vector<uint32_t> first;      // vertices + 1
  std::vector<uint32_t> neighbour;  // grouped by vertex

  /// Calls f(a, b) for the triangles (v, a, b).
  template <class F>
  void for_each_triangle(uint32_t v, F f) const {
    uint32_t before = neighbour[first[v + 1] - 1];
    for (uint32_t k = first[v]; k < first[v + 1]; ++k) {
      f(before, neighbour[k]);
      before = neighbour[k];
    }
  }
};
VertexRings rings_of(const LatticeMesh& mesh);

/// Connected parts of a mesh. A part is named by its index in the order of lowest vertex.
struct Components {
  std::vector<uint32_t> first;   // members of each, and the number of vertices
  std::vector<uint32_t> vertex;  // grouped by part, ascending
  size_t size() const { return first.size() - 1; }
};
Components components_of(const LatticeMesh& mesh);

/// Volume of each part, voxel^3.
std::vector<double> volumes_of(const LatticeMesh& mesh, const VertexRings& rings,
                               const Components& parts);

/// v / |v|, or `none` if v is 0. V3f::normalized is no inline function.
inline V3f unit_or(const V3f& v, const V3f& none) {
  const float square = v.dot(v);
  return square > 0 ? v * (1 / std::sqrt(square)) : none;
}

/// Unit normals, the area-weighted mean of the triangles around each vertex.
std::vector<V3f> normals_of(const LatticeMesh& mesh, const VertexRings& rings);

/// Smooths vertices by `passes` Laplacian passes (factor 1/2, uniform weights), made in fewer by
/// Chebyshev polynomials (Taubin, Zhang, Golub 1996), along the normals: what the passes took away
/// smoothly along them, the shrinkage of round shapes and of threads, comes back after as many
/// passes over it as a number, and bumps stay removed. Across the normals vertices take the first
/// few passes only, which even out the triangles. (As many passes back over the displacement as a
/// vector would let threads one particle wide lose nine tenths of their cross-section, since around
/// a thread it turns once.) Each part then gets back the volume it had: a small one (a drop) by
/// scaling, others by an even shift along the normals of half a voxel at most.
void smooth_mesh(LatticeMesh& mesh, const VertexRings& rings, const Components& parts, int passes);

/// Averages unit normals over the ring, `passes` times (factor 1/2).
void smooth_normals(std::vector<V3f>& normal, const VertexRings& rings, int passes);

}  // namespace drench::surfacing
