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
/// Bounding spheres lie in the order of the polygon grid, so eight are tested at once.
struct Candidates {
  std::vector<int> triangle;
  std::vector<float> x, y, z, radius;  // padded by eight

  void gather(const PolygonView& polygons, Vec3<float> low, Vec3<float> high, float reach) {
    triangle.clear(), x.clear(), y.clear(), z.clear(), radius.clear();
    polygons.for_each_range(low, high, reach, [&](int begin, int end) {
      for (int k = begin; k < end; k += 8) {
        int bits = polygons.sphere_near(Lanes{k}, low, high, reach).bits();
        if (k + 8 > end) bits &= (1 << (end - k)) - 1;
        for (; bits; bits &= bits - 1) add(polygons, k + __builtin_ctz(bits));
      }
    });
    for (std::vector<float>* column : {&x, &y, &z, &radius}) column->resize(triangle.size() + 8, 1e15f);
  }

 private:
  void add(const PolygonView& polygons, int k) {
    triangle.push_back(polygons.order[k]);
    x.push_back(polygons.sorted_centroid.x[k]), y.push_back(polygons.sorted_centroid.y[k]);
    z.push_back(polygons.sorted_centroid.z[k]), radius.push_back(polygons.sorted_radius[k]);
  }
};

/// Nearest triangles of eight particles as they are known so far.
struct NearestOfPack {
  Vec3<Pack> p;
  Pack best, which{-1.f}, wb{0.f}, wc{0.f};

  DRENCH_HD void test(const PolygonView& polygons, int triangle, int k) {
    Vec3<float> a, b, c;
    polygons.corners(triangle, a, b, c);
    const ClosestPoint<Pack> foot =
        closest_point<Pack>(p, {a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z});
    const Mask closer = foot.distance2 < best;
    best = select(closer, foot.distance2, best), which = select(closer, Pack(float(k)), which);
    wb = select(closer, foot.wb, wb), wc = select(closer, foot.wc, wc);
  }
  /// Could the triangle in this bounding sphere be nearer than what any of the eight has?
  DRENCH_HD bool may_improve(Vec3<float> m, float radius) const {
    const Vec3<Pack> d = p - Vec3<Pack>{m.x, m.y, m.z};
    const Pack away = max0(square_root(length2(d)) - Pack(radius));
    return (away * away < best).bits() != 0;
  }
  float farthest() const {
    alignas(32) float lane[8];
    best.store(lane);
    return std::sqrt(*std::max_element(lane, lane + 8));
  }
};

/// Eight particles (the last repeated) against the candidates: the one whose centroid is nearest first,
/// then those whose bounding sphere could still hold a nearer point for one of the eight.
inline void nearest_of_pack(const PolygonView& polygons, const VecView& position, int begin, int count,
                            float reach, const Candidates& candidates, const NearestOutput& out) {
  alignas(32) float lane[3][8];
  Bounds box;
  for (int k = 0; k < 8; ++k) {
    const Vec3<float> p = position[begin + std::min(k, count - 1)];
    box = JoinBounds{}(box, bounds_of(p));
    lane[0][k] = p.x, lane[1][k] = p.y, lane[2][k] = p.z;
  }
  NearestOfPack pack{{Pack::load(lane[0]), Pack::load(lane[1]), Pack::load(lane[2])}, Pack(reach * reach)};
  const Vec3<float> centre = (box.low + box.high) * 0.5f;
  const float half = 0.5f * length(box.high - box.low);
  const int n = int(candidates.triangle.size());
  static thread_local std::vector<float> bound;  // centroid distance less both radii
  bound.resize(n + 8);
  int first = 0;
  float least = 1e30f;
  for (int k = 0; k < n; k += 8) {
    const Vec3<Pack> d{Pack::load(&candidates.x[k]) - Pack(centre.x), Pack::load(&candidates.y[k]) - Pack(centre.y),
                       Pack::load(&candidates.z[k]) - Pack(centre.z)};
    (square_root(length2(d)) - Pack::load(&candidates.radius[k]) - Pack(half)).store(&bound[k]);
  }
  for (int k = 0; k < n; ++k) {
    if (bound[k] < least) least = bound[k], first = k;
  }
  pack.test(polygons, candidates.triangle[first], first);
  float limit = pack.farthest();
  for (int k = 0; k < n; ++k) {
    if (bound[k] > limit || k == first) continue;
    if (!pack.may_improve({candidates.x[k], candidates.y[k], candidates.z[k]}, candidates.radius[k])) continue;
    pack.test(polygons, candidates.triangle[k], k);
    limit = pack.farthest();
  }
  pack.which.store(lane[0]), pack.wb.store(lane[1]), pack.wc.store(lane[2]);
  for (int k = 0; k < count; ++k) {
    out.triangle[begin + k] = lane[0][k] < 0.f ? -1 : candidates.triangle[size_t(lane[0][k])];
    out.weight_b[begin + k] = lane[1][k], out.weight_c[begin + k] = lane[2][k];
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
    static thread_local Candidates candidates;
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
        candidates.gather(polygons, box.low, box.high, reach);
        if (candidates.triangle.empty()) continue;
        for (int i = begin; i < end; i += 8) {
          nearest_of_pack(polygons, position, i, std::min(8, end - i), reach, candidates, out);
        }
      }
    }
  });
}

#endif

}  // namespace drench::sim::DRENCH_BACKEND
