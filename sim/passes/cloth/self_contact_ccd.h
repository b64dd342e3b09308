#pragma once
// Pieces of sheets that may meet: a vertex and a triangle, or two edges. Their closest points, and
// whether their straight paths over a step keep them apart: additive continuous collision detection
// (Li, Kaufman and Jiang 2021), which advances by what the distance allows.

#include "sim/backend/double_scalar.h"
#include "sim/passes/coupling/geometry.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// Closest points of two segments, as fractions of their ways from their first ends.
template <class T>
struct ClosestOnSegments {
  T s, u;
};

/// The square of the sine of the angle below which segments count as parallel, where rounding hides
/// in which direction they come nearer. Their distance is then at most that sine times their length
/// too large.
template <class T>
constexpr float parallel_sine2 = 1e-6f;
template <>
inline constexpr float parallel_sine2<double> = 1e-12f;

/// Segments a + s d, b + u e, from a - b = r (Ericson 2005, 5.1.9).
template <class T>
DRENCH_HD ClosestOnSegments<T> closest_on_segments(Vec3<T> d, Vec3<T> e, Vec3<T> r) {
  const auto clamped = [](T x) { return minimum(max0(x), T(1)); };
  const T tiny(1e-30f), dd = maximum(dot(d, d), tiny), ee = maximum(dot(e, e), tiny),
                        de = dot(d, e), dr = dot(d, r), er = dot(e, r);
  const T det = dd * ee - de * de;
  T s = det > T(parallel_sine2<T>) * dd * ee ? clamped((de * er - dr * ee) / det) : T(0);
  T u = (de * s + er) / ee;
  if (u < T(0)) u = T(0), s = clamped(-dr / dd);
  if (u > T(1)) u = T(1), s = clamped((de - dr) / dd);
  return {s, u};
}

/// How two pieces lie: weights as SheetRow has them.
template <class T>
struct PieceDistance {
  T weight[4];
  Vec3<T> apart;  // m, from the second to the first
};

template <class T>
DRENCH_HD PieceDistance<T> distance_of_pieces(bool edges, const Vec3<T> (&p)[4]) {
  if (edges) {
    const Vec3<T> d = p[1] - p[0], e = p[3] - p[2], r = p[0] - p[2];
    const ClosestOnSegments<T> c = closest_on_segments(d, e, r);
    return {{T(1) - c.s, c.s, c.u - T(1), -c.u}, r + d * c.s - e * c.u};
  }
  const ClosestPoint<T> c = closest_point(p[0], p[1], p[2], p[3]);
  const Vec3<T> from = p[0] - p[1];
  return {{T(1), -c.wa, -c.wb, -c.wc}, from - (p[2] - p[1]) * c.wb - (p[3] - p[1]) * c.wc};
}

/// How much nearer to each other motions may bring two pieces at most, m: what they have in common
/// does not.
template <class T>
DRENCH_HD T approach_of_pieces(bool edges, const Vec3<T> (&d)[4]) {
  const Vec3<T> mean = (d[0] + d[1] + d[2] + d[3]) * T(0.25f);
  T size[4];
  for (int k = 0; k < 4; ++k) size[k] = length2(d[k] - mean);
  const T second = maximum(size[2], size[3]);
  if (edges) return square_root(maximum(size[0], size[1])) + square_root(second);
  return square_root(size[0]) + square_root(maximum(size[1], second));
}

/// The fraction of their paths up to which two pieces do not come nearer than a tenth of their
/// distance, or than `clearance`; 1: they never do. Once nearer than twice the clearance, the
/// inverse of their distance grows by half that of the clearance: n steps in a row leave 2 / n
/// clearances, where halves would soon be lost in what places round off.
/// @param x  m, at the start. @param d  m, the way. @param clearance  m
DRENCH_HD double safe_part(bool edges, const Vec3<double> (&x)[4], const Vec3<double> (&d)[4],
                           double clearance) {
  const double approach = approach_of_pieces(edges, d);
  const double start = length(distance_of_pieces(edges, x).apart);
  const double keep = start > 2 * clearance ? maximum(0.1 * start, clearance)
                                            : 2 * clearance * start / (2 * clearance + start);
  double t = 0, distance = start;
  for (int step = 0; step < 128; ++step) {
    if (approach * (1 - t) <= distance - keep) return 1;
    // Ends a hundredth of what is left before `keep`, so that few steps get there.
    if (step > 0 && distance <= keep + 0.01 * (start - keep)) return t;
    t += (distance - keep) / approach;
    const Vec3<double> now[4] = {x[0] + d[0] * t, x[1] + d[1] * t, x[2] + d[2] * t,
                                 x[3] + d[3] * t};
    distance = length(distance_of_pieces(edges, now).apart);
  }
  return t;
}

}  // namespace drench::sim::DRENCH_BACKEND
