#pragma once
// Uniform grid over points: points sorted by cell, x fastest, ties in their order; cell_start only.

#include <algorithm>
#include <cmath>

#include "sim/backend/column.h"
#include "sim/backend/vec3.h"

namespace drench::sim::DRENCH_BACKEND {

/// Where cells are. Points outside fall into the border cells, which is correct and only slower. On
/// a periodic axis there are none: cells fill [origin, origin + period).
struct GridShape {
  Vec3<float> origin;        // m, lower corner
  Vec3<float> inverse_edge;  // 1/m
  int nx, ny, nz;
  Vec3<float> period{0.f, 0.f, 0.f};  // m; 0 where an axis is not periodic

  DRENCH_HD int cells() const { return nx * ny * nz; }
  DRENCH_HD static int clamp(float v, int n) {
    const int i = int(floorf(v));
    return i < 0 ? 0 : i >= n ? n - 1 : i;
  }
  DRENCH_HD int cell_x(float x) const { return clamp((x - origin.x) * inverse_edge.x, nx); }
  DRENCH_HD int cell_y(float y) const { return clamp((y - origin.y) * inverse_edge.y, ny); }
  DRENCH_HD int cell_z(float z) const { return clamp((z - origin.z) * inverse_edge.z, nz); }
  DRENCH_HD int index(int x, int y, int z) const { return (z * ny + y) * nx + x; }
  DRENCH_HD int cell(Vec3<float> p) const { return index(cell_x(p.x), cell_y(p.y), cell_z(p.z)); }
};

/// Cells along one axis.
struct GridAxis {
  float origin, inverse_edge;
  double count;
};
inline GridAxis make_grid_axis(float low, float high, double edge) {
  // Points that are not finite end the run once the step is done: until then one cell holds all.
  if (!std::isfinite(high - low) || !std::isfinite(edge)) return {0.f, 0.f, 1};
  const double first = std::floor(low / edge);
  return {float(first * edge), 1.f / float(edge), std::floor(high / edge) - first + 1};
}
/// A whole number of cells in the period; one that is an edge and a rounding wide counts.
inline GridAxis make_periodic_axis(float low, float period, double edge) {
  const double count = std::max(2.0, std::floor(period / edge * (1 + 1e-6)));
  return {low, float(count / period), count};
}

/// A grid over the box [low, high] with cells of at least `edge`; coarser when the box would need
/// more than 2^25 cells. The origin lies on the lattice of cells, so that whole-lattice moves
/// change nothing. A periodic axis has cells from `low` to `low + period`.
/// @param period  m, at least two edges; 0 where an axis is not periodic.
inline GridShape make_grid_shape(Vec3<float> low, Vec3<float> high, float edge,
                                 Vec3<float> period = {0.f, 0.f, 0.f}) {
  for (;; edge *= 1.5f) {
    const auto axis = [edge](float from, float to, float around) {
      return around > 0.f ? make_periodic_axis(from, around, edge) : make_grid_axis(from, to, edge);
    };
    const GridAxis x = axis(low.x, high.x, period.x), y = axis(low.y, high.y, period.y),
                   z = axis(low.z, high.z, period.z);
    if (x.count * y.count * z.count > double(1 << 25)) continue;
    return {.origin = {x.origin, y.origin, z.origin},
            .inverse_edge = {x.inverse_edge, y.inverse_edge, z.inverse_edge},
            .nx = int(x.count),
            .ny = int(y.count),
            .nz = int(z.count),
            .period = period};
  }
}

struct GridView {
  GridShape shape;
  const int* cell_start;  // cells + 1
};

/// The cells next to cell c along an axis of n: first and last; -1 and n lie beyond the seam of a
/// periodic axis.
struct Reach {
  int first, last;
};
DRENCH_HD Reach reach_of(int c, int n, float period) {
  if (period > 0.f) return {c - 1, c + 1};
  return {c > 0 ? c - 1 : 0, c + 1 < n ? c + 1 : n - 1};
}
/// -1, 0 or 1: which image of the axis cell c belongs to.
DRENCH_HD int image_of(int c, int n) { return c < 0 ? -1 : c >= n ? 1 : 0; }

/// Calls visit(begin, end, shift) for the runs of points that fill the 27 cells around one. Points
/// from beyond the seam of a periodic axis are seen at their position plus `shift`, m. A cell that
/// is seen from both sides comes twice: with two supports to the period a pair counts once at most.
template <class Visit>
DRENCH_HD void for_each_run(const GridView& grid, int cx, int cy, int cz, const Visit& visit) {
  const GridShape& g = grid.shape;
  const Reach rx = reach_of(cx, g.nx, g.period.x), ry = reach_of(cy, g.ny, g.period.y),
              rz = reach_of(cz, g.nz, g.period.z);
  for (int z = rz.first; z <= rz.last; ++z) {
    const int iz = image_of(z, g.nz);
    for (int y = ry.first; y <= ry.last; ++y) {
      const int iy = image_of(y, g.ny);
      const int* row = grid.cell_start + g.index(0, y - iy * g.ny, z - iz * g.nz);
      const float sy = float(iy) * g.period.y, sz = float(iz) * g.period.z;
      if (rx.first < 0) visit(row[g.nx - 1], row[g.nx], Vec3<float>{-g.period.x, sy, sz});
      visit(row[rx.first < 0 ? 0 : rx.first], row[rx.last < g.nx ? rx.last + 1 : g.nx],
            Vec3<float>{0.f, sy, sz});
      if (rx.last >= g.nx) visit(row[0], row[1], Vec3<float>{g.period.x, sy, sz});
    }
  }
}

}  // namespace drench::sim::DRENCH_BACKEND
