#include "sim/passes/coupling/polygon_grid.h"

#include "sim/passes/coupling/cloth_side.h"
#include "sim/passes/coupling/nearest.h"

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
  const int items = images.items(), triangles = c.triangles;
  const GridShape grid = c.grid;
  const ConstVecView centroid = c.centroid.view();
  c.cell.resize(items);
  int* cell = c.cell.data();
  parallel_for(
      state.queue, "cloth: cells of images", items, DRENCH_LAMBDA(int k) {
        const Vec3<float> m = centroid[k % triangles], at = m + images.shift(k, m);
        cell[k] = images.holds(at) ? grid.cell(at) : grid.cells();
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

}  // namespace

void build_polygon_grid(State& state, float room) {
  ClothState& c = state.cloth;
  const ConstVecView x = c.position.view();
  const VecView centroid = c.centroid.view();
  const Corners corner = corners_of(c);
  const float largest = parallel_reduce(
      state.queue, "cloth: centroids", c.triangles, 0.f,
      DRENCH_LAMBDA(int t) {
        const Vec3<float> a = corner.at(x, 3 * t), b = corner.at(x, 3 * t + 1),
                          d = corner.at(x, 3 * t + 2);
        const Vec3<float> m = (a + b + d) * (1.f / 3.f);
        centroid.set(t, m);
        return maximum(length2(a - m), maximum(length2(b - m), length2(d - m)));
      },
      Larger{});
  c.largest_radius = std::sqrt(largest);
  const Bounds bounds = bounds_of_points(state.queue, "cloth: bounds", x, c.vertices);
  c.low = bounds.low, c.high = bounds.high;
  const bool periodic = any_periodic(state.parameters);
  const TriangleImages images = triangle_images_of(state);
  c.grid = make_grid_shape(images.low, images.high, room + c.largest_radius);
  int sorted_count = c.triangles;
  if (periodic) {
    sorted_count = sort_images(state, images);
  } else {
    const GridShape grid = c.grid;
    int* cell = c.cell.data();
    parallel_for(
        state.queue, "cloth: cells", c.triangles,
        DRENCH_LAMBDA(int t) { cell[t] = grid.cell(centroid[t]); });
    stable_sort_keys(state.queue, c.cell, c.triangles, grid.cells(), c.order, c.cell_start);
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

namespace {

NearestOutput nearest_output(State& state, float reach) {
  FluidState& f = state.fluid;
  return {.triangle = f.triangle.data(),
          .weight_b = f.weight_b.data(),
          .weight_c = f.weight_c.data(),
          .beyond_support = f.beyond_support.data(),
          .reach = reach,
          .search = 1.5f * reach};
}

}  // namespace

#if defined(__CUDACC__)

void find_nearest_triangles(State& state, const ConstVecView& position, float reach) {
  FluidState& f = state.fluid;
  const PolygonView polygons = polygons_of(state);
  const NearestOutput out = nearest_output(state, reach);
  const int* before = f.memory_triangle.data();
  parallel_for(
      state.queue, "nearest triangle", f.count, DRENCH_LAMBDA(int i) {
        out.triangle[i] = -1;
        if (out.beyond_support[i] > 0.f) return;
        Vec3<float> p = position[i];
        float best = out.search * out.search;
        int nearest = -1;
        const auto test = [&](const PreparedTriangle<float>& triangle, int t) {
          const ClosestPoint<float> foot = closest_point(plane_foot(p, triangle), triangle);
          if (foot.distance2 < best) {
            best = foot.distance2, nearest = t;
            out.weight_b[i] = foot.wb, out.weight_c[i] = foot.wc;
          }
        };
        if (before[i] >= 0) {
          Vec3<float> a, b, c;
          polygons.corners(before[i], a, b, c);
          p = polygons.beside(before[i], position[i]);
          test(prepare_triangle(a, b, c), before[i]);
          p = position[i];
        }
        polygons.for_each_near_box(p, p, sqrtf(best),
                                   [&](int k) { test(polygons.sorted[k], polygons.order[k]); });
        const bool found = best < out.reach * out.reach;
        if (found) out.triangle[i] = nearest;
        out.beyond_support[i] = sqrtf(best) - out.reach;
      });
}

#else

void find_nearest_triangles(State& state, const ConstVecView& position, float reach) {
  FluidState& f = state.fluid;
  const PolygonView polygons = polygons_of(state);
  const NearestOutput out = nearest_output(state, reach);
  const int *cell_start = f.cell_start.data(), *before = f.memory_triangle.data();
  const GridShape g = f.grid;
  ::tbb::parallel_for(::tbb::blocked_range<int>(0, g.ny * g.nz, 4), [&](const auto& range) {
    for (int row = range.begin(); row < range.end(); ++row) {
      PackOfNeighbours close(polygons, position, before, out),
          near(polygons, position, before, out), unknown(polygons, position, before, out);
      for (int i = cell_start[row * g.nx]; i < cell_start[(row + 1) * g.nx]; ++i) {
        out.triangle[i] = -1;
        if (before[i] >= 0)  // the farthest of eight says how far to look for all of them
          (out.beyond_support[i] < -0.5f * reach ? close : near).add(i, 2.f * reach);
        else if (out.beyond_support[i] <= 0.f)
          unknown.add(i, 2.f * reach);
      }
    }
  });
}

#endif

void find_cloth_sides(State& state, const ConstVecView& position) {
  FluidState& f = state.fluid;
  const ClothTopology cloth = topology_of(state);
  const VecView normal = f.normal.view();
  int *triangle = f.triangle.data(), *memory_triangle = f.memory_triangle.data(),
      *memory_side = f.memory_side.data(), *shaded = f.shaded.data();
  const float *weight_b = f.weight_b.data(), *weight_c = f.weight_c.data();
  float *distance = f.cloth_distance.data(), *plane = f.plane.data(), *edge = f.edge.data(),
        *cloth_fraction = f.cloth_density.data();
  const float h = state.parameters.support_radius, spacing = state.parameters.spacing,
              scale = state.parameters.wall_scale;
  const float patch = 2.f * h + 2.f * state.cloth.largest_radius;
  // No path crosses a sheet, so that the side is where a particle is seen to be. Layers do go
  // through each other: a particle between two may then have its nearest triangle behind the other
  // layer, on one patch with the last one and with its other side to it. By the memory that is a
  // particle deep in the sheet, which pressure would push through it and collisions hold back, for
  // ever (docs/decisions/0024-side-as-seen.md).
  const bool by_memory = !state.parameters.incompressible;
  parallel_for(
      state.queue, "sheet side", f.count, DRENCH_LAMBDA(int i) {
        const int t = triangle[i];
        normal.set(i, {0.f, 0.f, 0.f});
        distance[i] = 1e30f, edge[i] = 0.f, cloth_fraction[i] = 0.f, shaded[i] = t >= 0;
        plane[i] = t >= 0 ? 1e29f : 1e30f;
        if (t < 0) {
          memory_triangle[i] = -1;
          return;
        }
        const float wb = weight_b[i], wc = weight_c[i], wa = 1.f - wb - wc;
        const FootNormal foot = foot_normal(cloth, t, wa, wb, wc);
        if (foot.free_edge) {
          memory_triangle[i] = -1;
          return;
        }
        Vec3<float> a, b, c;
        cloth.polygons.corners(t, a, b, c);
        Vec3<float> to_particle = position[i] - (a * wa + b * wb + c * wc);
        if (cloth.polygons.periodic) to_particle = nearest(to_particle, cloth.polygons.period);
        const float d = length(to_particle);
        const int seen = dot(to_particle, foot.normal) >= 0.f ? 1 : -1;
        const int old = memory_triangle[i];
        const bool clear = d > 1e-4f * h;  // closer than that the direction is rounding
        const bool remembered =
            (by_memory || !clear) && old >= 0 && cloth.on_one_patch(old, t, patch);
        const int side = remembered ? memory_side[i] : seen;
        memory_triangle[i] = t, memory_side[i] = side;
        const Vec3<float> pseudo =
            foot.normal * (float(side) / maximum(length(foot.normal), 1e-20f));
        const float flip = side == seen ? 1.f : -1.f;
        normal.set(i, clear ? to_particle * (flip / d) : pseudo);
        distance[i] = flip * d;
        plane[i] = distance[i] - dot(normal[i], position[i]);
        edge[i] = edge_weight(cloth, t, wa, wb, wc, spacing);
        cloth_fraction[i] =
            scale * edge[i] *
            spiky_halfspace(minimum(max0(distance[i] - cloth.half_thickness[t]) / h, 1.f));
      });
}

}  // namespace drench::sim::DRENCH_BACKEND
