#include "surfacing/marching_cubes_table.h"

#include <Imath/ImathVec.h>

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

namespace drench::surfacing {
namespace {

using Imath::V3d;
using Loop = std::vector<int>;  // edges

int edge_between(int corner_a, int corner_b) {
  for (int edge = 0; edge < 12; ++edge) {
    const CubeEdge e = cube_edge(edge);
    if (std::min(corner_a, corner_b) == e.start && (corner_a ^ corner_b) == 1 << e.axis)
      return edge;
  }
  throw std::logic_error("corners share no edge");
}

/// Corners of a face, counter-clockwise seen from outside the cube.
std::array<int, 4> face_corners(int axis, int side) {
  const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
  if (side == 1) return {base, base | u, base | u | v, base | v};
  return {base, base | v, base | u | v, base | u};
}

/// next[e]: the edge to which the loop goes on from e, or -1. On every face each run of inside
/// corners is cut off by a segment from the edge that enters it to the edge that leaves it; a face
/// with two diagonal inside corners has two runs of one.
std::array<int, 12> segments(int index) {
  std::array<int, 12> next;
  next.fill(-1);
  const auto inside = [&](int corner) { return (index >> corner & 1) != 0; };
  for (int face = 0; face < 6; ++face) {
    const auto corner = face_corners(face / 2, face % 2);
    for (int k = 0; k < 4; ++k) {
      const int before = corner[(k + 3) % 4];
      if (inside(before) || !inside(corner[k])) continue;
      int last = k;
      while (inside(corner[(last + 1) % 4])) ++last;
      next[edge_between(before, corner[k])] =
          edge_between(corner[last % 4], corner[(last + 1) % 4]);
    }
  }
  return next;
}

V3d middle(int edge) {
  const CubeEdge e = cube_edge(edge);
  V3d p(e.start & 1, e.start >> 1 & 1, e.start >> 2);
  p[e.axis] += 0.5;
  return p;
}

/// Largest cosine of a corner, with the cut points in the middle of their edges.
double sharpest(int a, int b, int c) {
  const std::array<V3d, 3> p{middle(a), middle(b), middle(c)};
  double cosine = -1;
  for (int k = 0; k < 3; ++k)
    cosine = std::max(
        cosine, (p[(k + 1) % 3] - p[k]).normalized().dot((p[(k + 2) % 3] - p[k]).normalized()));
  return cosine;
}

constexpr double impossible = 2;  // a cosine that no triangle has

/// Cuts of the part of a loop from corner i to j, and the sharpest corner among them.
struct Cut {
  double cosine = -1;
  int middle = -1;
};

void collect(const Loop& loop, const std::vector<std::vector<Cut>>& cut, int i, int j,
             CubeCase& out) {
  if (j - i < 2) return;
  const int m = cut[i][j].middle;
  collect(loop, cut, i, m, out);
  out.edge.at(out.triangles++) = {static_cast<uint8_t>(loop[i]), static_cast<uint8_t>(loop[m]),
                                  static_cast<uint8_t>(loop[j])};
  collect(loop, cut, m, j, out);
}

void triangulate(const Loop& loop, CubeCase& out) {
  const int n = static_cast<int>(loop.size());
  std::vector<std::vector<Cut>> cut(n, std::vector<Cut>(n));
  for (int length = 2; length < n; ++length)
    for (int i = 0; i + length < n; ++i) {
      const int j = i + length;
      Cut best{impossible, -1};
      for (int m = i + 1; m < j; ++m) {
        const double cosine =
            std::max({cut[i][m].cosine, cut[m][j].cosine, sharpest(loop[i], loop[m], loop[j])});
        if (cosine < best.cosine) best = {cosine, m};
      }
      const bool diagonal = !(i == 0 && j == n - 1);
      if (diagonal && share_face(loop[i], loop[j])) best.cosine = impossible;
      cut[i][j] = best;
    }
  if (cut[0][n - 1].cosine >= impossible)
    throw std::logic_error("a loop of marching cubes cannot be cut without face diagonals");
  collect(loop, cut, 0, n - 1, out);
}

std::array<CubeCase, 256> generate() {
  std::array<CubeCase, 256> table;
  for (int index = 0; index < 256; ++index) {
    auto next = segments(index);
    for (int start = 0; start < 12; ++start) {
      Loop loop;
      for (int e = start; next[e] >= 0;) {
        loop.push_back(e);
        e = std::exchange(next[e], -1);
      }
      if (!loop.empty()) triangulate(loop, table[index]);
    }
  }
  return table;
}

}  // namespace

CubeEdge cube_edge(int edge) {
  const int axis = edge / 4, k = edge % 4;
  const int low = axis == 0 ? 1 : 0, high = axis == 2 ? 1 : 2;
  return {axis, (k & 1) << low | (k >> 1) << high};
}

bool share_face(int edge_a, int edge_b) {
  const CubeEdge a = cube_edge(edge_a), b = cube_edge(edge_b);
  for (int axis = 0; axis < 3; ++axis)
    if (axis != a.axis && axis != b.axis && (a.start >> axis & 1) == (b.start >> axis & 1))
      return true;
  return false;
}

const std::array<CubeCase, 256>& marching_cubes_table() {
  static const std::array<CubeCase, 256> table = generate();
  return table;
}

}  // namespace drench::surfacing
