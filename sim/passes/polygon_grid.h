#pragma once
// The second grid of the seed: polygons by centroid (section 5.1).

#include "sim/geometry.h"
#include "sim/parallel.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

struct Bounds {
  Vec3<float> low{1e30f, 1e30f, 1e30f}, high{-1e30f, -1e30f, -1e30f};
};

DRENCH_HD Bounds bounds_of(Vec3<float> p) { return {p, p}; }

struct JoinBounds {
  DRENCH_HD Bounds operator()(Bounds a, Bounds b) const {
    return {
        {minimum(a.low.x, b.low.x), minimum(a.low.y, b.low.y), minimum(a.low.z, b.low.z)},
        {maximum(a.high.x, b.high.x), maximum(a.high.y, b.high.y), maximum(a.high.z, b.high.z)}};
  }
};

struct Larger {
  template <class T>
  DRENCH_HD T operator()(T a, T b) const {
    return a > b ? a : b;
  }
};

/// A float of its own, or eight of them one after the other: how a pass over packs fills an array
/// of structs.
DRENCH_HD void put_triangle(PreparedTriangle<float>* out, int k, const PreparedTriangle<float>& t) {
  out[k] = t;
}
#if !defined(__CUDACC__)
DRENCH_HD void put_triangle(PreparedTriangle<float>* out, Lanes k,
                            const PreparedTriangle<Pack>& t) {
  constexpr int fields = sizeof t / sizeof(Pack);
  const float* lane = reinterpret_cast<const float*>(&t);
  float* to = reinterpret_cast<float*>(out + k.base);
  for (int i = 0; i < 8; ++i) {
    for (int f = 0; f < fields; ++f) to[fields * i + f] = lane[8 * f + i];
  }
}
#endif

/// Bounds of points 0..n-1.
inline Bounds bounds_of_points(const char* name, VecView points, int n) {
  return parallel_reduce(
      name, n, Bounds{}, DRENCH_LAMBDA(int i) { return bounds_of(points[i]); }, JoinBounds{});
}

/// Centroids, boxes and the sorted grid, its cells at least as wide as the largest
/// centroid-to-corner distance plus `room`.
inline void build_polygon_grid(State& state, float room) {
  ClothState& c = state.cloth;
  const VecView x = c.position.view(), centroid = c.centroid.view();
  const int* corner = c.corner.data();
  const float largest = parallel_reduce(
      "cloth: centroids", c.triangles, 0.f,
      DRENCH_LAMBDA(int t) {
        const Vec3<float> a = x[corner[3 * t]], b = x[corner[3 * t + 1]], d = x[corner[3 * t + 2]];
        const Vec3<float> m = (a + b + d) * (1.f / 3.f);
        centroid.set(t, m);
        return maximum(length2(a - m), maximum(length2(b - m), length2(d - m)));
      },
      Larger{});
  c.largest_radius = std::sqrt(largest);
  const Bounds bounds = bounds_of_points("cloth: bounds", x, c.vertices);
  c.low = bounds.low, c.high = bounds.high;
  c.grid = make_grid_shape(bounds.low, bounds.high, room + c.largest_radius);
  const GridShape grid = c.grid;
  int* cell = c.cell.data();
  parallel_for(
      "cloth: cells", c.triangles, DRENCH_LAMBDA(int t) { cell[t] = grid.cell(centroid[t]); });
  stable_sort_keys(c.cell, c.triangles, grid.cells(), c.order, c.cell_start, state.scratch);
  const int* order = c.order.data();
  const VecView low = c.sorted_low.view(), high = c.sorted_high.view();
  PreparedTriangle<float>* sorted = c.sorted_triangle.data();
  for_each_lane(
      "cloth: sorted triangles", c.triangles, DRENCH_LAMBDA(auto k) {
        const auto t = load(order, k);
        const auto at = [&](int e) { return x.at(load(corner, t + t + t + e)); };
        const auto a = at(0), b = at(1), d = at(2);
        using Vec = decltype(at(0));
        low.put(k, Vec{minimum(a.x, minimum(b.x, d.x)), minimum(a.y, minimum(b.y, d.y)),
                       minimum(a.z, minimum(b.z, d.z))});
        high.put(k, Vec{maximum(a.x, maximum(b.x, d.x)), maximum(a.y, maximum(b.y, d.y)),
                        maximum(a.z, maximum(b.z, d.z))});
        put_triangle(sorted, k, prepare_triangle(a, b, d));
      });
}

/// Read-only view for passes that look triangles up.
struct PolygonView {
  GridShape grid;
  const int *cell_start, *order, *corner;
  VecView position, centroid;
  float largest_radius;
  VecView sorted_low, sorted_high;  // bounding boxes in the order of the cells
  const PreparedTriangle<float>* sorted;

  DRENCH_HD void corners(int t, Vec3<float>& a, Vec3<float>& b, Vec3<float>& c) const {
    a = position[corner[3 * t]], b = position[corner[3 * t + 1]], c = position[corner[3 * t + 2]];
  }
  /// Calls f(begin, end) for ranges of order that hold every triangle within `extra` of the box
  /// [low, high].
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
  /// Calls f(place in order) for each of those whose own box comes within `extra` of the box.
  template <class F>
  DRENCH_HD void for_each_near_box(Vec3<float> low, Vec3<float> high, float extra,
                                   const F& f) const {
    for_each_range(low, high, extra, [&](int begin, int end) {
      for (int k = begin; k < end; ++k) {
        if (box_near(k, low, high, extra)) f(k);
      }
    });
  }
  template <class Index>
  DRENCH_HD auto box_near(Index k, Vec3<float> low, Vec3<float> high, float extra) const {
    using T = decltype(load(sorted_low.x, k));
    const Vec3<T> l = sorted_low.at(k), h = sorted_high.at(k);
    const Vec3<T> gap{max0(maximum(T(low.x) - h.x, l.x - T(high.x))),
                      max0(maximum(T(low.y) - h.y, l.y - T(high.y))),
                      max0(maximum(T(low.z) - h.z, l.z - T(high.z)))};
    return length2(gap) <= T(extra * extra);
  }
};

inline PolygonView polygons_of(const ClothState& c) {
  return {c.grid,
          c.cell_start.data(),
          c.order.data(),
          c.corner.data(),
          c.position.view(),
          c.centroid.view(),
          c.largest_radius,
          c.sorted_low.view(),
          c.sorted_high.view(),
          c.sorted_triangle.data()};
}

}  // namespace drench::sim::DRENCH_BACKEND
