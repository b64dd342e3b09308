#pragma once
// Vertices of a mesh that stand for one point of its surface.

#include <cstdint>
#include <utility>
#include <vector>

#include "pipeline/contract/frames.h"

namespace drench {

struct Welded {
  std::vector<uint32_t> first;  // by vertex: the first of those it is joined to, or itself
  size_t count = 0;             // of vertices that are joined to an earlier one
  double widest = 0;            // m, between two that were joined
};

/// Vertices closer than this fraction of the diagonal of a mesh are one where its surface is open:
/// more than the rounding of six digits, less than anything that is modelled.
inline constexpr double weld_fraction = 1e-5;

/// Of the box of all vertices that triangles use, m; 0 without triangles.
double diagonal_of(const TriangleMesh& mesh);

/// By vertex: the vertex that `point` names, where vertices were split, else itself.
std::vector<uint32_t> points_of(const TriangleMesh& mesh);

/// Edges that are passed more often in one direction than in the other, vertices joined as `first`
/// says: the rim of a surface. The smaller index comes first.
std::vector<std::pair<uint32_t, uint32_t>> free_edges(const TriangleMesh& mesh,
                                                      const std::vector<uint32_t>& first);

/// Joins vertices on free edges within a distance of one another, each to the first of them. What
/// `point` joins stays joined whatever the distance.
/// @param distance  m; 0 joins nothing else, not even vertices at one point
Welded weld(const TriangleMesh& mesh, double distance);

}  // namespace drench
