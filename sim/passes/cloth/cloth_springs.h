#pragma once
#include "sim/passes/air/wind_on_cloth.h"

namespace drench::sim::DRENCH_BACKEND {

// Spring force on a vertex, eq (4) of the seed, with damping along each spring (momentum is kept).
// Springs stand by slot, slot s of all vertices together, so that eight vertices read them at once;
// vertices with fewer springs have slots of no stiffness that end on themselves.
struct SpringEnds {
  const int *end, *slot_offset;
  int slots, stride;
  ConstVecView shift;  // m, of the other ends; only where a sheet is joined to itself across a seam
  bool joined;

  /// From vertex i, which is at x, to the place of the other end of slot s.
  template <class Index, class T>
  DRENCH_HD Vec3<T> to_end(const ConstVecView& position, Vec3<T> x, Index i, int s) const {
    Vec3<T> d = at_end(position, i, s) - x;
    if (joined) d = d + shift.at(i + s * stride);
    return d;
  }

  /// A vector at the other ends of slot s.
  DRENCH_HD Vec3<float> at_end(const ConstVecView& view, int i, int s) const {
    return view[end[s * stride + i]];
  }
#if !defined(__CUDACC__)
  /// Grids have the same offset all over a slot: then the ends are eight consecutive vertices as
  /// well.
  DRENCH_HD Vec3<Pack> at_end(const ConstVecView& view, Lanes i, int s) const {
    const int other = i.base + slot_offset[s];
    if (slot_offset[s] != 0 && other >= 0 && other + 8 <= stride) return view.at(Lanes{other});
    return view.at(load(end, i + s * stride));
  }
#endif
};

inline SpringEnds spring_ends_of(const ClothState& c) {
  return {.end = c.spring_end.data(),
          .slot_offset = c.slot_offset.data(),
          .slots = c.spring_slots,
          .stride = c.padded,
          .shift = c.spring_shift.view(),
          .joined = c.joined};
}

struct ClothSprings {
  ConstVecView position;
  ConstVecView velocity;
  SpringEnds ends;
  const float *rest_length, *stiffness, *damping;

  template <class Index>
  DRENCH_HD auto force(Index i) const {
    using T = decltype(load(stiffness, i));
    const Vec3<T> x = position.at(i), v = velocity.at(i);
    Vec3<T> f{T(0.f), T(0.f), T(0.f)};
    for (int s = 0; s < ends.slots; ++s) {
      const auto at = i + s * ends.stride;
      const Vec3<T> d = ends.to_end(position, x, i, s);
      const T l = square_root(length2(d)), inverse = T(1.f) / maximum(l, T(1e-12f));
      const T rate = dot(ends.at_end(velocity, i, s) - v, d) * inverse;
      const T pull = load(stiffness, at) * (l - load(rest_length, at)) + load(damping, at) * rate;
      f = f + d * (pull * inverse);
    }
    return f;
  }
};

/// Where a cloth step reads from and writes to.
struct ClothBuffers {
  ConstVecView position;
  VecView velocity, next, next_velocity;
};

/// Domain walls stop cloth and hold half of its sliding back.
struct ClothWalls {
  Vec3<float> low, high;

  template <class T>
  DRENCH_HD void stop(Vec3<T>& x, Vec3<T>& v) const {
    const Vec3<T> inside{minimum(maximum(x.x, T(low.x)), T(high.x)),
                         minimum(maximum(x.y, T(low.y)), T(high.y)),
                         minimum(maximum(x.z, T(low.z)), T(high.z))};
    const Vec3<T> out = x - inside;
    const Vec3<T> stopped{select((out.x * out.x) > T(0.f), T(0.f), v.x * T(0.5f)),
                          select((out.y * out.y) > T(0.f), T(0.f), v.y * T(0.5f)),
                          select((out.z * out.z) > T(0.f), T(0.f), v.z * T(0.5f))};
    v = select(length2(out) > T(0.f), stopped, v);
    x = inside;
  }
};

inline ClothWalls cloth_walls_of(const Parameters& p) {
  const float margin = p.shell_margin > 0.f ? p.shell_margin : cloth_wall_margin * p.spacing;
  float low[3], high[3];
  for (int k = 0; k < 3; ++k) {
    low[k] = p.wall[k] ? p.low[k] + margin : -1e30f;
    high[k] = p.wall[k] ? p.high[k] - margin : 1e30f;
  }
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

// One damped Verlet step, eq (3) of the seed with v = (x_t - x_{t-dt}) / dt, which makes a change
// of dt and the first step right: v' = d v + dt F/m, x' = x + dt v', d = exp(-rate dt).
void cloth_verlet(State& state, const ClothBuffers& b, float dt);

inline ClothBuffers cloth_buffers(ClothState& c) {
  return {c.position.view(), c.velocity.view(), c.next.view(), c.next_velocity.view()};
}

// The mean velocity each vertex would have over the step without contact: the substeps themselves,
// made into spare columns. Whatever the springs do within a step is then in it.
void cloth_predict(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
