#pragma once
// Periodic axes of the domain: positions stay in [low, high), and a neighbour is the nearest of its
// images. Pairs found through cells get them shifted there (for_each_run in grid.h); lists hold
// indices, so that passes over lists look for the nearest image themselves.

#include "sim/backend/quad.h"
#include "sim/backend/vec3.h"
#include "sim/parameters.h"

namespace drench::sim::DRENCH_BACKEND {

/// The image of x in [low, high); NaN stays what it is.
template <class T>
DRENCH_HD T wrap(T x, float low, float high) {
  const T from(low), to(high), period(high - low), w = x - period * round_down((x - from) / period);
  const T wrapped = select((w < from) | (w >= to), from, w);  // rounding may end at the border
  return select((x >= from) & (x < to), x, wrapped);
}

/// Lengths of the periodic axes, m; 0 for others.
inline bool any_periodic(const Parameters& p) {
  return p.periodic[0] || p.periodic[1] || p.periodic[2];
}
inline Vec3<float> periods_of(const Parameters& p) {
  const auto period = [&](int k) { return p.periodic[k] ? p.high[k] - p.low[k] : 0.f; };
  return {period(0), period(1), period(2)};
}

/// The nearest image of a separation. @param period  m; 0 where an axis is not periodic.
DRENCH_HD Vec3<float> nearest(Vec3<float> d, Vec3<float> period) {
  const auto along = [](float x, float length) {
    return length > 0.f ? x - length * floorf(x / length + 0.5f) : x;
  };
  return {along(d.x, period.x), along(d.y, period.y), along(d.z, period.z)};
}

/// The image of x nearest to `to`; x itself, to the bit, where that is it.
DRENCH_HD Vec3<float> image_beside(Vec3<float> x, Vec3<float> to, Vec3<float> period) {
  const auto along = [](float x, float to, float length) {
    return length > 0.f ? x + length * floorf((to - x) / length + 0.5f) : x;
  };
  return {along(x.x, to.x, period.x), along(x.y, to.y, period.y), along(x.z, to.z, period.z)};
}

/// x_i - x_j of listed neighbours where no axis is periodic, ...
struct Straight {
  template <class Q>
  DRENCH_HD Q operator()(Q i, Q j) const {
    return i - j;
  }
};
/// ... and where one is. At least two supports to the period: the nearest image is the one listed.
struct NearestImage {
  Float4 period, inverse;  // m, 1/m; 0 where an axis is not periodic and in w

  template <class Q>
  DRENCH_HD Q operator()(Q i, Q j) const {
    const Q d = i - j;
    return d - both(period) * nearest_integer(d * both(inverse));
  }
};
inline NearestImage nearest_image_of(const Parameters& p) {
  const Vec3<float> l = periods_of(p);
  const auto inverse = [](float length) { return length > 0.f ? 1.f / length : 0.f; };
  return {{l.x, l.y, l.z, 0.f}, {inverse(l.x), inverse(l.y), inverse(l.z), 0.f}};
}

/// Calls f with the separation that the axes of the domain ask for.
template <class F>
void with_separation(const Parameters& p, const F& f) {
  if (any_periodic(p))
    f(nearest_image_of(p));
  else
    f(Straight{});
}

}  // namespace drench::sim::DRENCH_BACKEND
