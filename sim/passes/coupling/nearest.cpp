#include "sim/passes/coupling/nearest.h"

namespace drench::sim::DRENCH_BACKEND {

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

void bring_closed_seams_nearer(State& state) {
  const ClothState& c = state.cloth;
  if (c.seams_closed == 0) return;
  float* beyond_support = state.fluid.beyond_support.data();
  const float nearer = c.widest_seam;
  parallel_for(
      state.queue, "fluid: seams", state.fluid.count,
      DRENCH_LAMBDA(int i) { beyond_support[i] = beyond_support[i] - nearer; });
}

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

}  // namespace drench::sim::DRENCH_BACKEND
