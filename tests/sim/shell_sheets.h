#pragma once
// Flat rectangular sheets of several kinds of triangles, for the tests of shells.

#include "sim/setup/shell_rest.h"

namespace drench::sim_tests {

using Imath::V2d;
using Imath::V3d;

/// Right triangles whose long sides are all parallel, or alternate; equilateral ones; and Delaunay
/// triangles of points up to 0.3 of a cell off a square lattice, rows at x <= 0 and at the ends
/// apart.
enum class SheetMesh { diagonal, union_jack, equilateral, unstructured };

struct SheetSize {
  double length, width;  // m, along x and y; the sheet spans y from 0 to width
  int cells;             // along x from 0 to length; as many of that size as fit across
  int behind = 0;        // columns of cells more at x < 0, for clamps
  int seed = 1;          // of the unstructured points
};

sim::ShellSurface flat_sheet(SheetMesh mesh, const SheetSize& size);

/// Fills surface.neighbour.
void find_neighbours(sim::ShellSurface& surface);

/// m, of all nodes at rest.
std::vector<V3d> rest_places(const sim::ShellSurface& surface);

}  // namespace drench::sim_tests
