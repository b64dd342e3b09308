#include "sim/passes/coupling/polygon_grid.h"

namespace drench::sim::DRENCH_BACKEND {

Bounds bounds_of_points(Queue& queue, const char* name, ConstVecView points, int n) {
  return parallel_reduce(
      queue, name, n, Bounds{}, DRENCH_LAMBDA(int i) { return bounds_of(points[i]); },
      JoinBounds{});
}

namespace {

/// Sorts the images of all triangles that the grid holds. Returns how many.
int sort_images(State& state, const TriangleImages& images) {
  ClothState& c = state.cloth;
  const int items = images.items(), triangles = c.polygons, own = c.triangles;
  const int* open = c.seam_open.data();
  const GridShape grid = c.grid;
  const ConstVecView centroid = c.centroid.view();
  c.cell.resize(items);
  int* cell = c.cell.data();
  parallel_for(
      state.queue, "cloth: cells of images", items, DRENCH_LAMBDA(int k) {
        const Vec3<float> m = centroid[k % triangles], at = m + images.shift(k, m);
        const int t = k % triangles;
        const bool stands = t < own || !open[t - own];
        cell[k] = stands && images.holds(at) ? grid.cell(at) : grid.cells();
      });
  stable_sort_keys(state.queue, c.cell, items, grid.cells(), c.order, c.cell_start);
  const int held = value_at(c.cell_start, grid.cells());
  for (VecColumn* v : {&c.sorted_low, &c.sorted_high, &c.sorted_shift}) v->resize(held + 8);
  c.sorted_triangle.resize(held + 8);
  int* order = c.order.data();
  const VecView shift = c.sorted_shift.view();
  parallel_for(
      state.queue, "cloth: images", items, DRENCH_LAMBDA(int k) {
        const int item = order[k];
        order[k] = item % triangles;
        if (k < held) shift.set(k, images.shift(item, centroid[item % triangles]));
      });
  return held;
}

/// Sorts all polygons but strips of open seams, which come last.
void sort_polygons(State& state) {
  ClothState& c = state.cloth;
  const GridShape grid = c.grid;
  const ConstVecView centroid = c.centroid.view();
  const int *open = c.seam_open.data(), own = c.triangles;
  int* cell = c.cell.data();
  parallel_for(
      state.queue, "cloth: cells", c.polygons, DRENCH_LAMBDA(int t) {
        cell[t] = t < own || !open[t - own] ? grid.cell(centroid[t]) : grid.cells();
      });
  stable_sort_keys(state.queue, c.cell, c.polygons, grid.cells(), c.order, c.cell_start);
}

}  // namespace

void find_open_seams(State& state) {
  ClothState& c = state.cloth;
  const ConstVecView x = c.position.view();
  const int* pair = c.seam_pair.data();
  const float* reach = c.seam_reach.data();
  int* open = c.seam_open.data();
  if (c.polygons == c.triangles) return;
  c.seams_closed = parallel_reduce(
      state.queue, "cloth: open seams", c.polygons - c.triangles, 0,
      DRENCH_LAMBDA(int k) {
        const int *a = pair + 4 * k, was = open[k];
        const float apart2 = maximum(length2(x[a[0]] - x[a[1]]), length2(x[a[2]] - x[a[3]]));
        open[k] = apart2 > reach[k] * reach[k];
        return was && !open[k] ? 1 : 0;
      },
      Plus{});
}

void build_polygon_grid(State& state, float room) {
  ClothState& c = state.cloth;
  const ConstVecView x = c.position.view();
  const VecView centroid = c.centroid.view();
  const Corners corner = corners_of(c);
  const int *open = c.seam_open.data(), own = c.triangles;
  const float largest = parallel_reduce(
      state.queue, "cloth: centroids", c.polygons, 0.f,
      DRENCH_LAMBDA(int t) {
        const Vec3<float> a = corner.at(x, 3 * t), b = corner.at(x, 3 * t + 1),
                          d = corner.at(x, 3 * t + 2);
        const Vec3<float> m = (a + b + d) * (1.f / 3.f);
        centroid.set(t, m);
        if (t >= own && open[t - own]) return 0.f;
        return maximum(length2(a - m), maximum(length2(b - m), length2(d - m)));
      },
      Larger{});
  c.largest_radius = std::sqrt(largest);
  const Bounds bounds = bounds_of_points(state.queue, "cloth: bounds", x, c.vertices);
  c.low = bounds.low, c.high = bounds.high;
  const bool periodic = any_periodic(state.parameters);
  const TriangleImages images = triangle_images_of(state);
  c.grid = make_grid_shape(images.low, images.high, room + c.largest_radius);
  int sorted_count = c.polygons;
  if (periodic) {
    sorted_count = sort_images(state, images);
  } else {
    sort_polygons(state);
  }
  const int* order = c.order.data();
  const ConstVecView shift = c.sorted_shift.view();
  const VecView low = c.sorted_low.view(), high = c.sorted_high.view();
  PreparedTriangle<float>* sorted = c.sorted_triangle.data();
  for_each_lane(
      state.queue, "cloth: sorted triangles", sorted_count, DRENCH_LAMBDA(auto k) {
        const auto t = load(order, k);
        const auto at = [&](int e) {
          auto p = corner.at(x, t + t + t + e);
          if (periodic) p = p + shift.at(k);
          return p;
        };
        const auto a = at(0), b = at(1), d = at(2);
        using Vec = decltype(at(0));
        low.put(k, Vec{minimum(a.x, minimum(b.x, d.x)), minimum(a.y, minimum(b.y, d.y)),
                       minimum(a.z, minimum(b.z, d.z))});
        high.put(k, Vec{maximum(a.x, maximum(b.x, d.x)), maximum(a.y, maximum(b.y, d.y)),
                        maximum(a.z, maximum(b.z, d.z))});
        put_triangle(sorted, k, prepare_triangle(a, b, d));
      });
}

}  // namespace drench::sim::DRENCH_BACKEND
