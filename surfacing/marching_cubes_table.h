#pragma once
// The 256 cases of marching cubes, generated from a rule instead of pasted.

#include <array>
#include <cstdint>

namespace drench::surfacing {

/// Corner c of a cube stands at x = c & 1, y = c >> 1 & 1, z = c >> 2. Edge 4 a + k runs along axis
/// a from the corner whose other coordinates, in order of axes, are k & 1 and k >> 1.
struct CubeEdge {
  int axis;
  int start;  // corner at the lower end
};
CubeEdge cube_edge(int edge);

/// True if a face of the cube holds both edges.
bool share_face(int edge_a, int edge_b);

/// Triangles of one case: edges in counter-clockwise order seen from outside the fluid.
struct CubeCase {
  static constexpr int max_triangles = 5;
  uint8_t triangles = 0;
  std::array<std::array<uint8_t, 3>, max_triangles> edge{};
};

/// Bit c of the index: corner c is inside. The rule:
/// * on a face whose diagonal corners are inside and the other two outside, inside corners are cut
///   apart. The face alone decides, so the two cubes that share it agree and the mesh is closed;
/// * the segments of the six faces form closed loops, and a loop is cut into triangles without a
///   diagonal between two edges of one face: the neighbour may use that line too, and an edge with
///   four triangles would result. Of the cuts left, the one with the largest smallest angle is
///   taken.
const std::array<CubeCase, 256>& marching_cubes_table();

}  // namespace drench::surfacing
