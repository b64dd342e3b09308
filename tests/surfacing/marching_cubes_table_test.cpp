// The table is right if any two cubes that share a face agree on it, whatever their other corners.

#include "surfacing/marching_cubes_table.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <utility>

namespace drench::surfacing {
namespace {

using Segment = std::pair<int, int>;  // directed, between edges of a cube

/// How often each directed segment bounds a triangle of the case.
std::map<Segment, int> segments_of(int index) {
  std::map<Segment, int> count;
  const CubeCase& cube = marching_cubes_table()[static_cast<size_t>(index)];
  for (int t = 0; t < cube.triangles; ++t)
    for (int k = 0; k < 3; ++k) ++count[{cube.edge[t][k], cube.edge[t][(k + 1) % 3]}];
  return count;
}

/// The segments without an opposite one inside the cube: they lie in faces, for the neighbour to
/// meet.
std::set<Segment> open_segments(int index) {
  std::set<Segment> open;
  const auto count = segments_of(index);
  for (const auto& [segment, times] : count)
    if (!count.contains({segment.second, segment.first})) open.insert(segment);
  return open;
}

bool on_face(int edge, int axis, int side) {
  const CubeEdge e = cube_edge(edge);
  return e.axis != axis && (e.start >> axis & 1) == side;
}

/// The edge seen from the cube on the other side of the face.
int across(int edge, int axis) {
  const CubeEdge e = cube_edge(edge);
  for (int other = 0; other < 12; ++other)
    if (cube_edge(other).axis == e.axis && cube_edge(other).start == (e.start ^ 1 << axis))
      return other;
  return -1;
}

std::set<Segment> segments_on(int index, int axis, int side) {
  std::set<Segment> on;
  for (const Segment& s : open_segments(index))
    if (on_face(s.first, axis, side) && on_face(s.second, axis, side)) on.insert(s);
  return on;
}

TEST(MarchingCubesTable, CutsExactlyTheEdgesWhoseEndsDiffer) {
  for (int index = 0; index < 256; ++index) {
    std::set<int> used, cut;
    const CubeCase& cube = marching_cubes_table()[static_cast<size_t>(index)];
    for (int t = 0; t < cube.triangles; ++t) used.insert(cube.edge[t].begin(), cube.edge[t].end());
    for (int e = 0; e < 12; ++e) {
      const CubeEdge edge = cube_edge(e);
      const int start = index >> edge.start & 1, end = index >> (edge.start | 1 << edge.axis) & 1;
      if (start != end) cut.insert(e);
    }
    EXPECT_EQ(used, cut) << "case " << index;
  }
}

// Segments used by one triangle only must lie in a face (the cube next door closes them); those
// used by two must not: the cube next door could use the same line and the edge would have four
// triangles.
TEST(MarchingCubesTable, HasNoDiagonalInAFaceAndNoOpenSegmentInside) {
  for (int index = 0; index < 256; ++index)
    for (const auto& [segment, times] : segments_of(index)) {
      EXPECT_EQ(times, 1) << "case " << index;
      const bool open = open_segments(index).contains(segment);
      EXPECT_EQ(open, share_face(segment.first, segment.second)) << "case " << index;
    }
}

TEST(MarchingCubesTable, AgreesWithEveryPossibleNeighbourOnTheSharedFace) {
  int pairs = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int low = 0; low < 256; ++low)
      for (int high = 0; high < 256; ++high) {
        bool match = true;  // the low cube's upper face is the high cube's lower one
        for (int corner = 0; corner < 8; ++corner)
          if ((corner >> axis & 1) == 0)
            match &= (high >> corner & 1) == (low >> (corner | 1 << axis) & 1);
        if (!match) continue;
        ++pairs;
        std::set<Segment> seen;  // from the high cube, turned round
        for (const Segment& s : segments_on(high, axis, 0))
          seen.insert({across(s.second, axis), across(s.first, axis)});
        EXPECT_EQ(segments_on(low, axis, 1), seen) << low << " below " << high << " on " << axis;
      }
  EXPECT_EQ(pairs, 3 * 256 * 16);
}

// A lone inside corner at the origin: the normal of x, y, z cuts in that order points away from it.
TEST(MarchingCubesTable, TurnsTrianglesOutwards) {
  const CubeCase& cube = marching_cubes_table()[1];
  ASSERT_EQ(cube.triangles, 1);
  int first = 0;
  while (cube_edge(cube.edge[0][first]).axis != 0) ++first;
  EXPECT_EQ(cube_edge(cube.edge[0][(first + 1) % 3]).axis, 1);
}

}  // namespace
}  // namespace drench::surfacing
