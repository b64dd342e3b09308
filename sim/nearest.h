#pragma once
// Nearest triangle of every particle within reach (eq 5 of the seed with the exact distance in place of
// the centroid's). On a CPU core the particles of a fluid cell share their candidate triangles and are
// tested eight at a time; on the GPU every thread walks the polygon grid.

#include "sim/geometry.h"
#include "sim/passes/polygon_grid.h"

namespace drench::sim::DRENCH_BACKEND {

struct NearestOutput {
  int* triangle;  // -1 none
  float *weight_b, *weight_c;
};

#if defined(__CUDACC__)

inline void find_nearest_triangles(State& state, float reach) {
  FluidState& f = state.fluid;
  const PolygonView polygons = polygons_of(state.cloth);
  const VecView position = f.position.view();
  const NearestOutput out{f.triangle.data(), f.weight_b.data(), f.weight_c.data()};
  const Vec3<float> low = state.cloth.low, high = state.cloth.high;
  parallel_for("nearest triangle", f.count, DRENCH_LAMBDA(int i) {
    const Vec3<float> p = position[i];
    out.triangle[i] = -1;
    if (p.x < low.x - reach || p.x > high.x + reach || p.y < low.y - reach || p.y > high.y + reach ||
        p.z < low.z - reach || p.z > high.z + reach) {
      return;
    }
    float best = reach * reach;
    polygons.for_each_near_box(p, p, reach, [&](int t) {
      const float away = length(p - polygons.centroid[t]) - sqrtf(polygons.radius2[t]);
      if (away > 0.f && away * away > best) return;
      Vec3<float> a, b, c;
      polygons.corners(t, a, b, c);
      const ClosestPoint<float> foot = closest_point(p, a, b, c);
      if (foot.distance2 < best) {
        best = foot.distance2;
        out.triangle[i] = t, out.weight_b[i] = foot.wb, out.weight_c[i] = foot.wc;
      }
    });
  });
}

#else

/// Candidate triangles of one fluid cell: those whose bounding sphere comes within reach of the box.
inline void gather_candidates(const PolygonView& polygons, Vec3<float> low, Vec3<float> high, float reach,
                              std::vector<int>& candidates) {
  candidates.clear();
  polygons.for_each_near_box(low, high, reach, [&](int t) {
    const Vec3<float> m = polygons.centroid[t];
    const Vec3<float> out{max0(maximum(low.x - m.x, m.x - high.x)), max0(maximum(low.y - m.y, m.y - high.y)),
                          max0(maximum(low.z - m.z, m.z - high.z))};
    const float limit = reach + std::sqrt(polygons.radius2[t]);
    if (length2(out) <= limit * limit) candidates.push_back(t);
  });
}

/// Eight particles (the last repeated) against all candidates.
inline void nearest_of_pack(const PolygonView& polygons, const VecView& position, int begin, int count,
                            float reach, const std::vector<int>& candidates, const NearestOutput& out) {
  alignas(32) float lane[6][8];
  for (int k = 0; k < 8; ++k) {
    const Vec3<float> p = position[begin + std::min(k, count - 1)];
    lane[0][k] = p.x, lane[1][k] = p.y, lane[2][k] = p.z;
  }
  const Vec3<Pack> p{Pack::load(lane[0]), Pack::load(lane[1]), Pack::load(lane[2])};
  Pack best(reach * reach), which(-1.f), wb(0.f), wc(0.f);
  for (size_t k = 0; k < candidates.size(); ++k) {
    Vec3<float> a, b, c;
    polygons.corners(candidates[k], a, b, c);
    const ClosestPoint<Pack> foot =
        closest_point<Pack>(p, {a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z});
    const Mask closer = foot.distance2 < best;
    best = select(closer, foot.distance2, best), which = select(closer, Pack(float(k)), which);
    wb = select(closer, foot.wb, wb), wc = select(closer, foot.wc, wc);
  }
  which.store(lane[3]), wb.store(lane[4]), wc.store(lane[5]);
  for (int k = 0; k < count; ++k) {
    out.triangle[begin + k] = lane[3][k] < 0.f ? -1 : candidates[size_t(lane[3][k])];
    out.weight_b[begin + k] = lane[4][k], out.weight_c[begin + k] = lane[5][k];
  }
}

inline void find_nearest_triangles(State& state, float reach) {
  FluidState& f = state.fluid;
  const PolygonView polygons = polygons_of(state.cloth);
  const VecView position = f.position.view();
  const NearestOutput out{f.triangle.data(), f.weight_b.data(), f.weight_c.data()};
  const Vec3<float> sheet_low = state.cloth.low, sheet_high = state.cloth.high;
  const int* cell_start = f.cell_start.data();
  std::fill_n(out.triangle, f.count, -1);
  const GridShape g = f.grid;
  ::tbb::parallel_for(::tbb::blocked_range<int>(0, g.ny * g.nz, 4), [&](const auto& range) {
    static thread_local std::vector<int> candidates;
    for (int row = range.begin(); row < range.end(); ++row) {
      for (int cell = row * g.nx; cell < (row + 1) * g.nx; ++cell) {
        const int begin = cell_start[cell], end = cell_start[cell + 1];
        if (begin == end) continue;
        Bounds box;
        for (int i = begin; i < end; ++i) box = JoinBounds{}(box, bounds_of(position[i]));
        if (box.low.x > sheet_high.x + reach || box.high.x < sheet_low.x - reach ||
            box.low.y > sheet_high.y + reach || box.high.y < sheet_low.y - reach ||
            box.low.z > sheet_high.z + reach || box.high.z < sheet_low.z - reach) {
          continue;
        }
        gather_candidates(polygons, box.low, box.high, reach, candidates);
        if (candidates.empty()) continue;
        for (int i = begin; i < end; i += 8) {
          nearest_of_pack(polygons, position, i, std::min(8, end - i), reach, candidates, out);
        }
      }
    }
  });
}

#endif

}  // namespace drench::sim::DRENCH_BACKEND
