#pragma once
// The second grid of Harada et al. 2007: polygons by centroid (section 5.1).
//
// Where an axis is periodic vertices stay in coordinates of their own, however far a sheet drifts,
// and the grid holds every image of a triangle that comes within two supports of the domain: who
// looks through it in the neighbourhood of a particle finds the images that are there. A triangle
// is known by its index, an image by its index in the grid's order. Sheets that are joined to
// themselves across a seam have triangles and springs whose ends stand a period off their vertices.

#include "sim/backend/parallel.h"
#include "sim/neighbours/periodic.h"
#include "sim/passes/coupling/geometry.h"
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
Bounds bounds_of_points(Queue& queue, const char* name, ConstVecView points, int n);

/// Corners of triangles, each triangle in one piece.
struct Corners {
  const int* vertex;   // 3 a triangle
  ConstVecView shift;  // m
  bool joined;         // there are shifts

  /// @param k  3 triangle + corner
  template <class Index>
  DRENCH_HD auto at(const ConstVecView& x, Index k) const {
    auto p = x.at(load(vertex, k));
    if (joined) p = p + shift.at(k);
    return p;
  }
};
inline Corners corners_of(const ClothState& c) {
  return {c.corner.data(), c.corner_shift.view(), c.joined};
}

/// Of every vertex the triangles that meet in it, and the strips of seams.
inline const int* polygon_fan_start(const ClothState& c) {
  return c.polygons > c.triangles ? c.seam_fan_start.data() : c.fan_start.data();
}
inline const int* polygon_fan_entry(const ClothState& c) {
  return c.polygons > c.triangles ? c.seam_fan_entry.data() : c.fan_entry.data();
}

/// The images of every triangle that may come near the domain, and which of them do.
struct TriangleImages {
  Vec3<float> period;      // m; 0 where an axis is not periodic
  Vec3<float> low, high;   // m, what the grid is to hold
  float radius;            // m, of a triangle about its centroid
  int first[3], count[3];  // images along an axis, from that in [low, low + period) on
  int triangles;

  int items() const { return triangles * count[0] * count[1] * count[2]; }
  /// From the triangle to the image that an item is.
  DRENCH_HD Vec3<float> shift(int item, Vec3<float> centroid) const {
    const int which = item / triangles, nx = count[0], ny = count[1];
    const auto along = [](float c, float low, float period, int image) {
      return period > 0.f ? period * (float(image) - floorf((c - low) / period)) : 0.f;
    };
    return {along(centroid.x, low.x, period.x, first[0] + which % nx),
            along(centroid.y, low.y, period.y, first[1] + which / nx % ny),
            along(centroid.z, low.z, period.z, first[2] + which / (nx * ny))};
  }
  DRENCH_HD bool holds(Vec3<float> centroid) const {
    const auto along = [this](float c, float low, float high, float period) {
      return !(period > 0.f) || (c > low - radius && c < high + radius);
    };
    return along(centroid.x, low.x, high.x, period.x) &&
           along(centroid.y, low.y, high.y, period.y) && along(centroid.z, low.z, high.z, period.z);
  }
};

inline TriangleImages triangle_images_of(const State& state) {
  const Parameters& p = state.parameters;
  const ClothState& c = state.cloth;
  const float margin = 2.f * p.support_radius;
  TriangleImages images{.period = periods_of(p),
                        .low = c.low,
                        .high = c.high,
                        .radius = c.largest_radius,
                        .first = {0, 0, 0},
                        .count = {1, 1, 1},
                        .triangles = c.polygons};
  const auto span = [&](int k, float period, float& low, float& high) {
    if (!(period > 0.f)) return;
    low = p.low[k] - margin, high = p.high[k] + margin;
    images.first[k] = -int(std::ceil(c.largest_radius / period));
    images.count[k] = int((high - low + c.largest_radius) / period) + 1 - images.first[k];
  };
  span(0, images.period.x, images.low.x, images.high.x);
  span(1, images.period.y, images.low.y, images.high.y);
  span(2, images.period.z, images.low.z, images.high.z);
  return images;
}

/// Which strips stand for nothing in this step, since their seam is open: wider than that no fluid
/// passes between what it sews (SeamStrips).
void find_open_seams(State& state);

/// Centroids, boxes and the sorted grid, its cells at least as wide as the largest
/// centroid-to-corner distance plus `room`.
void build_polygon_grid(State& state, float room);

/// Read-only view for passes that look triangles up.
struct PolygonView {
  GridShape grid;
  const int *cell_start, *order, *corner;
  ConstVecView position;
  ConstVecView centroid;
  float largest_radius;
  ConstVecView sorted_low, sorted_high;  // bounding boxes in the order of the cells
  const PreparedTriangle<float>* sorted;
  Corners corner_positions;
  ConstVecView sorted_shift;  // m, of the images in that order; where an axis is periodic
  Vec3<float> period;         // m
  bool periodic;

  DRENCH_HD void corners(int t, Vec3<float>& a, Vec3<float>& b, Vec3<float>& c) const {
    a = corner_positions.at(position, 3 * t), b = corner_positions.at(position, 3 * t + 1),
    c = corner_positions.at(position, 3 * t + 2);
  }
  /// The corner of the image at index k of the order, with the vertices at x.
  DRENCH_HD Vec3<float> corner_in(int k, int e, const ConstVecView& x) const {
    const Vec3<float> p = corner_positions.at(x, 3 * order[k] + e);
    return periodic ? p + sorted_shift[k] : p;
  }
  /// The image of p that a triangle is to be seen from. (Not always the nearest to a large one.)
  DRENCH_HD Vec3<float> beside(int t, Vec3<float> p) const {
    return periodic ? image_beside(p, centroid[t], period) : p;
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
  template <class Index>
  DRENCH_HD auto box_near(Index k, Vec3<float> low, Vec3<float> high, float extra) const {
    using T = decltype(load(sorted_low.x, k));
    const Vec3<T> l = sorted_low.at(k), h = sorted_high.at(k);
    const Vec3<T> gap{max0(maximum(T(low.x) - h.x, l.x - T(high.x))),
                      max0(maximum(T(low.y) - h.y, l.y - T(high.y))),
                      max0(maximum(T(low.z) - h.z, l.z - T(high.z)))};
    return length2(gap) <= T(extra * extra);
  }
  /// Calls f(index in order) for each of those whose own box comes within `extra` of the box.
  template <class F>
  DRENCH_HD void for_each_near_box(Vec3<float> low, Vec3<float> high, float extra,
                                   const F& f) const {
    for_each_range(low, high, extra, [&](int begin, int end) {
      for (int k = begin; k < end; ++k) {
        if (box_near(k, low, high, extra)) f(k);
      }
    });
  }
};

inline PolygonView polygons_of(const State& state) {
  const ClothState& c = state.cloth;
  return {.grid = c.grid,
          .cell_start = c.cell_start.data(),
          .order = c.order.data(),
          .corner = c.corner.data(),
          .position = c.position.view(),
          .centroid = c.centroid.view(),
          .largest_radius = c.largest_radius,
          .sorted_low = c.sorted_low.view(),
          .sorted_high = c.sorted_high.view(),
          .sorted = c.sorted_triangle.data(),
          .corner_positions = corners_of(c),
          .sorted_shift = c.sorted_shift.view(),
          .period = periods_of(state.parameters),
          .periodic = any_periodic(state.parameters)};
}

}  // namespace drench::sim::DRENCH_BACKEND
