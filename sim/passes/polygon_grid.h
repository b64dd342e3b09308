#pragma once
// The second grid of the seed: polygons by centroid (section 5.1).

#include "sim/parallel.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

struct Bounds {
  Vec3<float> low{1e30f, 1e30f, 1e30f}, high{-1e30f, -1e30f, -1e30f};
};

DRENCH_HD Bounds bounds_of(Vec3<float> p) { return {p, p}; }

struct JoinBounds {
  DRENCH_HD Bounds operator()(Bounds a, Bounds b) const {
    return {{minimum(a.low.x, b.low.x), minimum(a.low.y, b.low.y), minimum(a.low.z, b.low.z)},
            {maximum(a.high.x, b.high.x), maximum(a.high.y, b.high.y), maximum(a.high.z, b.high.z)}};
  }
};

struct Larger {
  template <class T>
  DRENCH_HD T operator()(T a, T b) const {
    return a > b ? a : b;
  }
};

/// Bounds of points 0..n-1.
inline Bounds bounds_of_points(const char* name, VecView points, int n) {
  return parallel_reduce(name, n, Bounds{}, DRENCH_LAMBDA(int i) { return bounds_of(points[i]); },
                         JoinBounds{});
}

/// Centroids, radii, bounds and the sorted grid. A cell is at least `reach` plus the largest
/// centroid-to-corner distance, so that 27 cells hold every triangle within `reach` of a point.
inline void build_polygon_grid(State& state, float reach) {
  ClothState& c = state.cloth;
  const VecView x = c.position.view(), centroid = c.centroid.view();
  const int* corner = c.corner.data();
  float* radius2 = c.radius2.data();
  parallel_for("cloth: centroids", c.triangles, DRENCH_LAMBDA(int t) {
    const Vec3<float> a = x[corner[3 * t]], b = x[corner[3 * t + 1]], d = x[corner[3 * t + 2]];
    const Vec3<float> m = (a + b + d) * (1.f / 3.f);
    centroid.set(t, m);
    radius2[t] = maximum(length2(a - m), maximum(length2(b - m), length2(d - m)));
  });
  const float largest = parallel_reduce("cloth: largest triangle", c.triangles, 0.f,
                                        DRENCH_LAMBDA(int t) { return radius2[t]; }, Larger{});
  c.largest_radius = std::sqrt(largest);
  const Bounds bounds = bounds_of_points("cloth: bounds", x, c.vertices);
  c.low = bounds.low, c.high = bounds.high;
  c.grid = make_grid_shape(bounds.low, bounds.high, reach + c.largest_radius);
  const GridShape grid = c.grid;
  int* cell = c.cell.data();
  parallel_for("cloth: cells", c.triangles, DRENCH_LAMBDA(int t) { cell[t] = grid.cell(centroid[t]); });
  stable_sort_keys(c.cell, c.triangles, grid.cells(), c.order, c.cell_start, state.scratch);
  const int* order = c.order.data();
  const VecView sorted = c.sorted_centroid.view();
  float* sorted_radius = c.sorted_radius.data();
  parallel_for("cloth: sorted bounds", c.triangles, DRENCH_LAMBDA(int k) {
    sorted.set(k, centroid[order[k]]);
    sorted_radius[k] = sqrtf(radius2[order[k]]);
  });
}

/// Read-only view for passes that look triangles up.
struct PolygonView {
  GridShape grid;
  const int *cell_start, *order, *corner;
  VecView position, centroid;
  const float* radius2;
  float largest_radius;
  VecView sorted_centroid;     // bounding spheres in the order of the cells
  const float* sorted_radius;

  DRENCH_HD void corners(int t, Vec3<float>& a, Vec3<float>& b, Vec3<float>& c) const {
    a = position[corner[3 * t]], b = position[corner[3 * t + 1]], c = position[corner[3 * t + 2]];
  }
  /// Calls f(begin, end) for ranges of order that hold every triangle within `extra` of the box [low, high].
  template <class F>
  DRENCH_HD void for_each_range(Vec3<float> low, Vec3<float> high, float extra, const F& f) const {
    const float m = largest_radius + extra;
    const int x0 = grid.cell_x(low.x - m), x1 = grid.cell_x(high.x + m);
    const int y0 = grid.cell_y(low.y - m), y1 = grid.cell_y(high.y + m);
    const int z0 = grid.cell_z(low.z - m), z1 = grid.cell_z(high.z + m);
    for (int z = z0; z <= z1; ++z) {
      for (int y = y0; y <= y1; ++y) {
        f(cell_start[grid.index(x0, y, z)], cell_start[grid.index(x1, y, z) + 1]);
      }
    }
  }
  /// Calls f(t) for each of those whose bounding sphere comes within `extra` of the box.
  template <class F>
  DRENCH_HD void for_each_near_box(Vec3<float> low, Vec3<float> high, float extra, const F& f) const {
    for_each_range(low, high, extra, [&](int begin, int end) {
      for (int k = begin; k < end; ++k) {
        if (sphere_near(k, low, high, extra)) f(order[k]);
      }
    });
  }
  template <class Index>
  DRENCH_HD auto sphere_near(Index k, Vec3<float> low, Vec3<float> high, float extra) const {
    using T = decltype(load(sorted_radius, k));
    const Vec3<T> m = sorted_centroid.at(k);
    const Vec3<T> out{max0(maximum(T(low.x) - m.x, m.x - T(high.x))),
                      max0(maximum(T(low.y) - m.y, m.y - T(high.y))),
                      max0(maximum(T(low.z) - m.z, m.z - T(high.z)))};
    const T limit = load(sorted_radius, k) + T(extra);
    return length2(out) <= limit * limit;
  }
};

inline PolygonView polygons_of(const ClothState& c) {
  return {c.grid, c.cell_start.data(), c.order.data(), c.corner.data(), c.position.view(),
          c.centroid.view(), c.radius2.data(), c.largest_radius, c.sorted_centroid.view(), c.sorted_radius.data()};
}

}  // namespace drench::sim::DRENCH_BACKEND
