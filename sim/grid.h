#pragma once
// Uniform grid over points: points sorted by cell, x fastest, ties in their order; cell_start only.

#include <cmath>

#include "sim/column.h"
#include "sim/vec3.h"

namespace drench::sim::DRENCH_BACKEND {

/// Where cells are. Points outside fall into the border cells, which is correct and only slower.
struct GridShape {
  Vec3<float> origin;  // m, lower corner
  float inverse_edge;  // 1/m
  int nx, ny, nz;

  DRENCH_HD int cells() const { return nx * ny * nz; }
  DRENCH_HD static int clamp(float v, int n) {
    const int i = int(floorf(v));
    return i < 0 ? 0 : i >= n ? n - 1 : i;
  }
  DRENCH_HD int cell_x(float x) const { return clamp((x - origin.x) * inverse_edge, nx); }
  DRENCH_HD int cell_y(float y) const { return clamp((y - origin.y) * inverse_edge, ny); }
  DRENCH_HD int cell_z(float z) const { return clamp((z - origin.z) * inverse_edge, nz); }
  DRENCH_HD int index(int x, int y, int z) const { return (z * ny + y) * nx + x; }
  DRENCH_HD int cell(Vec3<float> p) const { return index(cell_x(p.x), cell_y(p.y), cell_z(p.z)); }
};

/// A grid over the box [low, high] with cells of at least `edge`; coarser when the box would need
/// more than 2^25 cells. The origin lies on the lattice of cells, so that whole-lattice moves
/// change nothing.
inline GridShape make_grid_shape(Vec3<float> low, Vec3<float> high, float edge) {
  for (;; edge *= 1.5f) {
    const double e = edge;
    const double x0 = std::floor(low.x / e), y0 = std::floor(low.y / e), z0 = std::floor(low.z / e);
    const double nx = std::floor(high.x / e) - x0 + 1, ny = std::floor(high.y / e) - y0 + 1,
                 nz = std::floor(high.z / e) - z0 + 1;
    if (nx * ny * nz > double(1 << 25)) continue;
    return {{float(x0 * e), float(y0 * e), float(z0 * e)}, 1.f / edge, int(nx), int(ny), int(nz)};
  }
}

struct GridView {
  GridShape shape;
  const int* cell_start;  // cells + 1
};

}  // namespace drench::sim::DRENCH_BACKEND
