#pragma once
// Whether edges and triangles of sheets meet, by the exact signs of determinants of their places;
// and how near pieces of sheets come, in double. Shares nothing with the solver.

#include <array>
#include <vector>

#include "sim/solver.h"

namespace drench::stress_tests {

using Point = std::array<double, 3>;

/// Sign of (b - a) x (c - a) . (d - a). Exact: products of three doubles are four each, whose sum
/// is an expansion (Shewchuk 1997).
int orientation(const Point& a, const Point& b, const Point& c, const Point& d);

/// Whether a segment and a triangle have a point in common, ends and sides included. A triangle
/// without area has none.
bool meet(const Point& p, const Point& q, const std::array<Point, 3>& triangle);

Point place_of(const sim::HostVec& position, size_t vertex);

/// How many pairs of an edge and a triangle meet that share no vertex and that no seam joins.
int count_meetings(const sim::ClothTopology& cloth, const std::vector<Point>& position);

/// The least distance of two pieces over what they are to keep: vertices and triangles, edges and
/// edges, that share no vertex and that no seam joins. They keep half the thickness of either; in
/// one sheet at most nine tenths of what they are apart at rest. `most` where none is nearer.
double least_distance(const sim::ClothTopology& cloth, const sim::HostVec& position, double most);

}  // namespace drench::stress_tests
