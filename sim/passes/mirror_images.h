#pragma once
// Sums over the mirror images of neighbours beyond the domain's walls, edges and corners, for
// passes to which a wall is no half-space: a surface that ends at a wall goes on in its image. No
// image is nearer than its particle, so that the neighbour lists hold all that are in reach.

#include "sim/kernels.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// A vector as the mirrors of the axes in `flip` (bit k: axis k) show it.
DRENCH_HD Vec3<float> mirrored(const Float4& v, int flip) {
  return {flip & 1 ? -v.x : v.x, flip & 2 ? -v.y : v.y, flip & 4 ? -v.z : v.z};
}

struct MirrorImages {
  const Float4* place;  // m
  NeighbourView list;
  float low[3], high[3];  // m
  bool on[3];
  float support_radius;  // m

  /// Sum of term(i, j, flip, x, u) over images of j; x: from there to i, u: closeness.
  template <class Term>
  DRENCH_HD Vec3<float> sum(int i, const Term& term) const {
    const Float4 own = place[i];
    const float p[3] = {own.x, own.y, own.z}, h = support_radius;
    float twice[3] = {0.f, 0.f, 0.f};  // m, of the nearest wall's coordinate
    int near = 0;
    for (int k = 0; k < 3; ++k) {
      const bool lower = p[k] - low[k] < high[k] - p[k];
      const float wall = lower ? low[k] : high[k];
      if (on[k] && fabsf(p[k] - wall) < h) near |= 1 << k, twice[k] = 2.f * wall;
    }
    Vec3<float> total{0.f, 0.f, 0.f};
    if (near == 0) return total;
    const size_t begin = size_t(list.begin[i]) * 4;
    for (int k = 0; k < 4 * list.blocks[i]; ++k) {
      if (!(list.closeness[begin + size_t(k)] > 0.f)) continue;
      const int j = list.index[begin + size_t(k)];
      const Float4 at = place[j];
      for (int flip = 1; flip < 8; ++flip) {
        if (flip & ~near) continue;
        const Vec3<float> x{flip & 1 ? own.x + at.x - twice[0] : own.x - at.x,
                            flip & 2 ? own.y + at.y - twice[1] : own.y - at.y,
                            flip & 4 ? own.z + at.z - twice[2] : own.z - at.z};
        const float r2 = length2(x);
        if (r2 < h * h) total = total + term(i, j, flip, x, 1.f - square_root(r2) / h);
      }
    }
    return total;
  }
};

inline MirrorImages mirror_images_of(const State& state) {
  const Parameters& p = state.parameters;
  const PressureState& s = state.pressure;
  MirrorImages images{s.place.data(), view_of(s.lists), {}, {}, {}, p.support_radius};
  for (int k = 0; k < 3; ++k)
    images.low[k] = p.low[k], images.high[k] = p.high[k], images.on[k] = p.wall[k];
  return images;
}

}  // namespace drench::sim::DRENCH_BACKEND
