#pragma once
// Nearest triangle of every particle within reach (eq 5 of Harada et al. 2007 with the exact
// distance in place of the centroid's). The triangle that was nearest a step ago bounds the search,
// and a particle that was found far off is left out until it or the cloth has moved as far. On a
// CPU core eight neighbours traverse the polygon grid together, on the GPU every thread its own.

#include "sim/passes/coupling/geometry.h"
#include "sim/passes/coupling/polygon_grid.h"

namespace drench::sim::DRENCH_BACKEND {

struct NearestOutput {
  int* triangle;  // -1 none
  float *weight_b, *weight_c;
  float* beyond_support;  // m
  float reach, search;    // m: triangles within reach count, those within search are looked at
};

#if !defined(__CUDACC__)

/// Nearest triangles of eight particles as they are known so far.
struct NearestOfPack {
  Vec3<Pack> p;
  Pack best, wb{0.f}, wc{0.f};
  LaneIndex which = same_index(-1);

  /// Triangle k of the sorted ones for all eight.
  DRENCH_HD void test(const PolygonView& polygons, int k) {
    const PreparedTriangle<float> one = polygons.sorted[k];
    const auto all = [](Vec3<float> v) { return Vec3<Pack>{v.x, v.y, v.z}; };
    const PreparedTriangle<Pack> t{.a = all(one.a),
                                   .ab = all(one.ab),
                                   .ac = all(one.ac),
                                   .d11 = one.d11,
                                   .d12 = one.d12,
                                   .d22 = one.d22,
                                   .inverse_ab = one.inverse_ab,
                                   .inverse_ac = one.inverse_ac,
                                   .inverse_bc = one.inverse_bc,
                                   .inverse = one.inverse};
    const PlaneFoot<Pack> plane = plane_foot(p, t);
    const LaneIndex triangle = same_index(polygons.order[k]);
    Mask may = distance2_bound(plane, t) < best;
    if (!polygons.periodic) may = may & !same(which, triangle);  // else it may be an image of it
    if (may.bits()) take(closest_point(plane, t), triangle, may);
  }
  /// Each its own triangle, -1 for none.
  DRENCH_HD void test_each(const PolygonView& polygons, LaneIndex triangle) {
    const Mask valid = is_index(triangle);
    const LaneIndex t = select(valid, triangle, same_index(0)), first = t + t + t;
    const auto corner = [&](int c) {
      return polygons.corner_positions.at(polygons.position, first + c);
    };
    const Vec3<Pack> from = polygons.periodic ? beside(polygons, t) : p;
    take(closest_point<Pack>(from, corner(0), corner(1), corner(2)), triangle, valid);
  }
  DRENCH_HD Vec3<Pack> beside(const PolygonView& polygons, LaneIndex triangle) const {
    alignas(32) float x[8], y[8], z[8];
    alignas(32) int t[8];
    p.x.store(x), p.y.store(y), p.z.store(z);
    store_lanes(t, first_lanes(8), triangle);
    for (int k = 0; k < 8; ++k) {
      const Vec3<float> q = polygons.beside(t[k], {x[k], y[k], z[k]});
      x[k] = q.x, y[k] = q.y, z[k] = q.z;
    }
    return {Pack::load(x), Pack::load(y), Pack::load(z)};
  }
  DRENCH_HD void take(const ClosestPoint<Pack>& foot, LaneIndex triangle, Mask valid) {
    const Mask closer = (foot.distance2 < best) & valid;
    best = select(closer, foot.distance2, best), which = select(closer, triangle, which);
    wb = select(closer, foot.wb, wb), wc = select(closer, foot.wc, wc);
  }
};

/// Up to eight particles that lie close together. Those of a row of cells are added one by one.
class PackOfNeighbours {
 public:
  PackOfNeighbours(const PolygonView& polygons, const ConstVecView& position, const int* before,
                   const NearestOutput& out)
      : polygons_(polygons), position_(position), before_(before), out_(out) {}
  ~PackOfNeighbours() { flush(); }

  void add(int i, float width) {
    if (count_ == 8 || (count_ > 0 && position_.x[i] - position_.x[member_[0]] > width)) flush();
    member_[count_++] = i;
  }

 private:
  /// First the triangles that were nearest a step ago, then all whose box comes within the distance
  /// that is left. A tie keeps the older triangle.
  void flush() {
    if (count_ == 0) return;
    for (int k = count_; k < 8; ++k) member_[k] = member_[0];
    const LaneIndex member = load(member_, Lanes{0});
    NearestOfPack pack{position_.at(member), Pack(out_.search * out_.search)};
    const LaneIndex old = load(before_, member);
    if (is_index(old).bits()) pack.test_each(polygons_, old);
    const float extra = std::sqrt(largest_lane(pack.best));
    const Vec3<float> low{smallest_lane(pack.p.x), smallest_lane(pack.p.y),
                          smallest_lane(pack.p.z)};
    const Vec3<float> high{largest_lane(pack.p.x), largest_lane(pack.p.y), largest_lane(pack.p.z)};
    polygons_.for_each_range(low, high, extra, [&](int from, int to) {
      for (int k = from; k < to; k += 8) {
        int bits = polygons_.box_near(Lanes{k}, low, high, extra).bits();
        if (k + 8 > to) bits &= (1 << (to - k)) - 1;
        for (; bits; bits &= bits - 1) pack.test(polygons_, k + __builtin_ctz(bits));
      }
    });
    put(pack);
    count_ = 0;
  }

  void put(const NearestOfPack& pack) {
    const Mask found = pack.best < Pack(out_.reach * out_.reach);
    alignas(32) float left[8], wb[8], wc[8];
    alignas(32) int which[8];
    (square_root(pack.best) - Pack(out_.reach)).store(left);
    pack.wb.store(wb), pack.wc.store(wc);
    store_lanes(which, first_lanes(8), select(found, pack.which, same_index(-1)));
    for (int k = 0; k < count_; ++k) {
      const int i = member_[k];
      out_.triangle[i] = which[k], out_.beyond_support[i] = left[k];
      out_.weight_b[i] = wb[k], out_.weight_c[i] = wc[k];
    }
  }

  const PolygonView& polygons_;
  const ConstVecView position_;
  const int* before_;
  const NearestOutput& out_;
  int member_[8], count_ = 0;
};

#endif

/// Before that: strips of seams that have closed may be nearer than anything was.
void bring_closed_seams_nearer(State& state);

/// Into FluidState::triangle, the weights of its foot and beyond_support.
/// @param position  m, of the particles. @param reach  m.
void find_nearest_triangles(State& state, const ConstVecView& position, float reach);

}  // namespace drench::sim::DRENCH_BACKEND
