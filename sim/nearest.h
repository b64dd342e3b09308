#pragma once
// Nearest triangle of every particle within reach (eq 5 of the seed with the exact distance in place of
// the centroid's). The triangle that was nearest a step ago bounds the search. On a CPU core eight particles
// of a fluid cell walk the polygon grid together, on the GPU every thread its own.

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
  const int* before = f.memory_triangle.data();
  parallel_for("nearest triangle", f.count, DRENCH_LAMBDA(int i) {
    const Vec3<float> p = position[i];
    float best = reach * reach;
    int nearest = -1;
    const auto test = [&](int t) {
      Vec3<float> a, b, c;
      polygons.corners(t, a, b, c);
      const ClosestPoint<float> foot = closest_point(p, a, b, c);
      if (foot.distance2 < best) {
        best = foot.distance2, nearest = t;
        out.weight_b[i] = foot.wb, out.weight_c[i] = foot.wc;
      }
    };
    if (before[i] >= 0) test(before[i]);
    polygons.for_each_near_box(p, p, sqrtf(best), test);
    out.triangle[i] = nearest;
  });
}

#else

/// Nearest triangles of eight particles as they are known so far.
struct NearestOfPack {
  Vec3<Pack> p;
  Pack best, wb{0.f}, wc{0.f};
  LaneIndex which = same_index(-1);

  DRENCH_HD void take(const ClosestPoint<Pack>& foot, LaneIndex triangle, Mask valid) {
    const Mask closer = (foot.distance2 < best) & valid;
    best = select(closer, foot.distance2, best), which = select(closer, triangle, which);
    wb = select(closer, foot.wb, wb), wc = select(closer, foot.wc, wc);
  }
  /// One triangle for all eight.
  DRENCH_HD void test(const PolygonView& polygons, int triangle) {
    Vec3<float> a, b, c;
    polygons.corners(triangle, a, b, c);
    const auto all = [](Vec3<float> v) { return Vec3<Pack>{v.x, v.y, v.z}; };
    take(closest_point<Pack>(p, all(a), all(b), all(c)), same_index(triangle), first_lanes(8));
  }
  /// Each its own triangle, -1 for none.
  DRENCH_HD void test_each(const PolygonView& polygons, LaneIndex triangle) {
    const Mask valid = is_index(triangle);
    const LaneIndex t = select(valid, triangle, same_index(0)), first = t + t + t;
    const auto corner = [&](int c) {
      return polygons.position.at(load(polygons.corner, first + same_index(c)));
    };
    take(closest_point<Pack>(p, corner(0), corner(1), corner(2)), triangle, valid);
  }
  /// Could the triangle in box k be nearer than what any of the eight has?
  DRENCH_HD bool may_improve(const PolygonView& polygons, int k) const {
    const Vec3<float> l = polygons.sorted_low[k], h = polygons.sorted_high[k];
    const Vec3<Pack> gap{max0(maximum(Pack(l.x) - p.x, p.x - Pack(h.x))),
                         max0(maximum(Pack(l.y) - p.y, p.y - Pack(h.y))),
                         max0(maximum(Pack(l.z) - p.z, p.z - Pack(h.z)))};
    return (length2(gap) < best).bits() != 0;
  }
};

/// Particles begin..begin+count-1, at most eight: first against the triangles that were nearest a step ago,
/// then against all whose box comes within the distance that is left. A tie keeps the older triangle.
inline void nearest_of_pack(const PolygonView& polygons, const VecView& position, const int* before, int begin,
                            int count, float reach, const NearestOutput& out) {
  const Mask present = first_lanes(count);
  const Vec3<float> first = position[begin];
  NearestOfPack pack{select(present, position.at(Lanes{begin}), {first.x, first.y, first.z}), Pack(reach * reach)};
  const LaneIndex old = select(present, load(before, Lanes{begin}), same_index(-1));
  if (is_index(old).bits()) pack.test_each(polygons, old);
  const float extra = std::sqrt(largest_lane(pack.best));
  const Vec3<float> low{smallest_lane(pack.p.x), smallest_lane(pack.p.y), smallest_lane(pack.p.z)};
  const Vec3<float> high{largest_lane(pack.p.x), largest_lane(pack.p.y), largest_lane(pack.p.z)};
  polygons.for_each_range(low, high, extra, [&](int from, int to) {
    for (int k = from; k < to; k += 8) {
      int bits = polygons.box_near(Lanes{k}, low, high, extra).bits();
      if (k + 8 > to) bits &= (1 << (to - k)) - 1;
      for (; bits; bits &= bits - 1) {
        const int triangle = k + __builtin_ctz(bits);
        if (pack.may_improve(polygons, triangle)) pack.test(polygons, polygons.order[triangle]);
      }
    }
  });
  store_lanes(out.triangle + begin, present, pack.which);
  store_lanes(out.weight_b + begin, present, pack.wb);
  store_lanes(out.weight_c + begin, present, pack.wc);
}

inline void find_nearest_triangles(State& state, float reach) {
  FluidState& f = state.fluid;
  const PolygonView polygons = polygons_of(state.cloth);
  const VecView position = f.position.view();
  const NearestOutput out{f.triangle.data(), f.weight_b.data(), f.weight_c.data()};
  const int *cell_start = f.cell_start.data(), *before = f.memory_triangle.data();
  const GridShape g = f.grid;
  ::tbb::parallel_for(::tbb::blocked_range<int>(0, g.ny * g.nz, 4), [&](const auto& range) {
    for (int row = range.begin(); row < range.end(); ++row) {
      for (int i = cell_start[row * g.nx], end; i < cell_start[(row + 1) * g.nx]; i = end) {
        // packs end with their cell
        end = std::min(i + 8, cell_start[g.cell(position[i]) + 1]);
        nearest_of_pack(polygons, position, before, i, end - i, reach, out);
      }
    }
  });
}

#endif

}  // namespace drench::sim::DRENCH_BACKEND
