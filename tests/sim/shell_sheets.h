#pragma once
// Flat rectangular sheets of several kinds of triangles, for the tests of shells.

#include "sim/setup/shell_rest.h"

namespace drench::sim_tests {

using Imath::V2d;
using Imath::V3d;

/// Right triangles whose long sides are all parallel, or alternate; equilateral ones; and Delaunay
/// triangles of points up to 0.3 of a cell off a square lattice, but at its outline and x <= 0.
enum class SheetMesh { diagonal, union_jack, equilateral, unstructured };

struct SheetSize {
  double length, width;  // m, along x and y; the sheet spans y from 0 to width
  int cells;             // along x from 0 to length; as many of that size as fit across
  int behind = 0;        // columns of cells more at x < 0, for clamps
  int still = 0;         // cells at the outline that unstructured points leave as they are
  int seed = 1;          // of the unstructured points
};

sim::ShellSurface flat_sheet(SheetMesh mesh, const SheetSize& size);

/// Fills surface.neighbour.
void find_neighbours(sim::ShellSurface& surface);

/// Holds the nodes that `where` is true of.
template <class Where>
void hold(sim::ShellSurface& surface, const Where& where) {
  surface.held.assign(surface.rest.size(), 0);
  for (size_t v = 0; v < surface.rest.size(); ++v) surface.held[v] = where(surface.rest[v]);
}

}  // namespace drench::sim_tests
