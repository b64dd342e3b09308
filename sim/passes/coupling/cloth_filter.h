#pragma once
// Fluid must not feel fluid through a sheet. Each near particle knows the plane of its nearest
// triangle. A pair whose two planes both put the other in front sees each other; a pair whose
// planes both put it behind, with opposed normals, does not; the rest (curved sheets, free edges)
// is decided by testing the segment against the triangles themselves. The density pass tests all
// near particles and notes those from which anything is hidden; the pressure pass tests only these.
// Both ends of a hidden segment are near a sheet: nearer to where it is crossed than to each other.

#include "sim/neighbours/pairs.h"
#include "sim/passes/coupling/geometry.h"
#include "sim/passes/coupling/polygon_grid.h"

namespace drench::sim::DRENCH_BACKEND {

/// The Filter of for_each_pair and of neighbour lists (sim/neighbours/pairs.h).
struct ClothFilter {
  static constexpr int columns = 4;
  int* shaded;  // by particle: 1 where neighbours may be hidden
  ConstVecView position;
  ConstVecView normal;
  const float* plane;
  PolygonView polygons;
  float support_radius;
  bool nothing_known;  // but who is near: all of them are tested

  DRENCH_HD bool tests(int i) const { return shaded[i] != 0; }
  DRENCH_HD void finish(int i, bool any) const { shaded[i] = any; }
  DRENCH_HD Inputs<4> inputs() const { return {{normal.x, normal.y, normal.z, plane}}; }
  /// With the positions that it decides by, where these are not those of the pairs.
  DRENCH_HD Inputs<7> inputs_with_position() const {
    return {{position.x, position.y, position.z, normal.x, normal.y, normal.z, plane}};
  }

  /// The same answer for (i, j) and (j, i): the segment always starts at the smaller end.
  DRENCH_HD bool segment_hidden(Vec3<float> p, Vec3<float> q) const {
    const bool swap = p.x != q.x ? p.x > q.x : p.y != q.y ? p.y > q.y : p.z > q.z;
    const Vec3<float> from = swap ? q : p, to = swap ? p : q;
    const Vec3<float> low{minimum(p.x, q.x), minimum(p.y, q.y), minimum(p.z, q.z)};
    const Vec3<float> high{maximum(p.x, q.x), maximum(p.y, q.y), maximum(p.z, q.z)};
    bool hidden = false;
    polygons.for_each_near_box(low, high, 0.f, [&](int k) {
      if (hidden) return;
      const auto corner = [&](int e) {
        return to_double(polygons.corner_in(k, e, polygons.position));
      };
      hidden = segment_crosses(to_double(from), to_double(to), corner(0), corner(1), corner(2));
    });
    return hidden;
  }

#if defined(__CUDACC__)
  /// @param shift  m, added to where j is: it may be seen beyond a seam
  DRENCH_HD bool hides(int i, int j, Vec3<float> shift) const {
    const Vec3<float> ni = normal[i], nj = normal[j], to = position[j] + shift;
    const bool front_i = dot(ni, to) + plane[i] > 0.f,
               front_j = dot(nj, position[i] - shift) + plane[j] > 0.f;
    if ((front_i && front_j) || i == j) return false;
    if (length2(to - position[i]) >= support_radius * support_radius) return false;
    if (!front_i && !front_j && dot(ni, nj) < 0.f) return true;
    return segment_hidden(position[i], to);
  }
#else
  /// The packs of a tile that hold near particles.
  void find_near(Tile& tile) const { tile.find_packs(plane, 1e30f); }
  /// Are all near ones within the support in front of the particle's plane, and it in front of
  /// theirs? Then nothing is hidden.
  DRENCH_HD bool sees_all(const Tile& tile, int i) const {
    const Vec3<float> x = position[i], n = normal[i];
    const Vec3<Pack> from{x.x, x.y, x.z}, normal_i{n.x, n.y, n.z};
    const Pack plane_i(plane[i]), reach2(support_radius * support_radius);
    for (const Tile::Run& of : tile.packs()) {
      const Lanes j{of.particle};
      const Vec3<Pack> to = position.at(j);
      const Mask back = (dot(normal_i, to) + plane_i <= Pack(0.f)) |
                        (dot(normal.at(j), from) + load(plane, j) <= Pack(0.f));
      if (back.bits() == 0) [[likely]]
        continue;
      if ((back & (length2(to - from) < reach2) & first_lanes(of.count)).bits()) return false;
    }
    return true;
  }

  /// What the test of a particle's neighbours reads of the particle itself.
  struct Self {
    Vec3<Pack> position, normal;
    Pack plane;
    int index;
    bool any;  // hidden neighbours so far
  };
  template <int N>
  DRENCH_HD Self self(const float* const* column, int index) const {
    const auto all = [&](int c) { return Pack(column[c][index]); };
    return {{all(0), all(1), all(2)}, {all(N), all(N + 1), all(N + 2)}, all(N + 3), index, false};
  }

  /// Which of the neighbours k..k+7 does the sheet hide?
  template <int N>
  DRENCH_HD Mask hidden(Self& i, const float* const* column, int k, Vec3<Pack> position) const {
    const Vec3<Pack> normal_j{Pack::load(column[N] + k), Pack::load(column[N + 1] + k),
                              Pack::load(column[N + 2] + k)};
    const Mask back_i = dot(i.normal, position) + i.plane <= Pack(0.f);
    const Mask back_j = dot(normal_j, i.position) + Pack::load(column[N + 3] + k) <= Pack(0.f);
    if ((back_i | back_j).bits() == 0) [[likely]]
      return back_i;  // all eight in front of each other
    const Mask within = length2(position - i.position) < Pack(support_radius * support_radius);
    const Mask surely = back_i & back_j & (dot(i.normal, normal_j) < Pack(0.f));
    const int doubtful = ((back_i | back_j) & within & !surely).bits();
    const Mask hidden{hidden_lanes(column, i.index, k, surely.bits(), doubtful)};
    i.any |= hidden.bits() != 0;
    return hidden;
  }

  /// Lanes that are hidden for sure and those of the doubtful ones whose segment meets a triangle.
  __attribute__((noinline)) Mask::Native hidden_lanes(const float* const* column, int index, int k,
                                                      int surely, int doubtful) const {
    const Vec3<float> p{column[0][index], column[1][index], column[2][index]};
    int hidden = surely;
    for (int bits = doubtful; bits; bits &= bits - 1) {
      const int lane = __builtin_ctz(bits), j = k + lane;
      if (segment_hidden(p, {column[0][j], column[1][j], column[2][j]})) hidden |= 1 << lane;
    }
    // A particle that has been pushed behind its own plane still sees itself.
    if (index >= k && index < k + 8) hidden &= ~(1 << (index - k));
    Mask::Native mask;
    for (int lane = 0; lane < 8; ++lane) mask[lane] = hidden >> lane & 1 ? -1 : 0;
    return mask;
  }
#endif
};

/// What the column says: who is near, or of these those from whom something is hidden.
enum class Shaded { near, hidden };

/// @param position  m, those that the planes of the sheets were taken from
inline ClothFilter cloth_filter(State& state, const ConstVecView& position, Shaded known) {
  FluidState& f = state.fluid;
  return {.shaded = f.shaded.data(),
          .position = position,
          .normal = f.normal.view(),
          .plane = f.plane.data(),
          .polygons = polygons_of(state),
          .support_radius = state.parameters.support_radius,
          .nothing_known = known == Shaded::near};
}

}  // namespace drench::sim::DRENCH_BACKEND
