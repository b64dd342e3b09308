#pragma once
// Point, segment and path against triangles.

#include "sim/vec3.h"

namespace drench::sim::DRENCH_BACKEND {

/// Closest point of triangle (a, b, c) to p: weights sum to 1 and are not negative.
template <class T>
struct ClosestPoint {
  T wa, wb, wc;   // barycentric weights
  T distance2;    // m^2
};

/// Parameter of the closest point to p on segment a + t e, 0..1; a segment of no length gives 0.
template <class T>
DRENCH_HD T closest_on_segment(Vec3<T> from_a, Vec3<T> e) {
  const T t = dot(from_a, e) / maximum(dot(e, e), T(1e-30f));
  return minimum(max0(t), T(1.f));
}

/// Exact in all seven regions: the foot on the plane if it lies inside, else the best edge point.
template <class T>
DRENCH_HD ClosestPoint<T> closest_point(Vec3<T> p, Vec3<T> a, Vec3<T> b, Vec3<T> c) {
  const Vec3<T> ab = b - a, ac = c - a, ap = p - a;
  const T d11 = dot(ab, ab), d12 = dot(ab, ac), d22 = dot(ac, ac);
  const T p1 = dot(ap, ab), p2 = dot(ap, ac);
  const T inverse = T(1.f) / maximum(d11 * d22 - d12 * d12, T(1e-30f));
  const T v = (d22 * p1 - d12 * p2) * inverse, w = (d11 * p2 - d12 * p1) * inverse;
  const auto inside = (v >= T(0.f)) & (w >= T(0.f)) & (v + w <= T(1.f));

  const Vec3<T> bc = c - b, bp = p - b;
  const T t_ab = closest_on_segment(ap, ab), t_ac = closest_on_segment(ap, ac),
          t_bc = closest_on_segment(bp, bc);
  const T d_ab = length2(ap - ab * t_ab), d_ac = length2(ap - ac * t_ac), d_bc = length2(bp - bc * t_bc);
  T vb = t_ab, vc = T(0.f), best = d_ab;  // weights of b and c
  const auto use_ac = d_ac < best;
  vb = select(use_ac, T(0.f), vb), vc = select(use_ac, t_ac, vc), best = select(use_ac, d_ac, best);
  const auto use_bc = d_bc < best;
  vb = select(use_bc, T(1.f) - t_bc, vb), vc = select(use_bc, t_bc, vc), best = select(use_bc, d_bc, best);
  vb = select(inside, v, vb), vc = select(inside, w, vc);
  best = select(inside, length2(ap - ab * v - ac * w), best);
  return {T(1.f) - vb - vc, vb, vc, best};
}

/// Six times the signed volume of (a, b, c, p): positive on the side of the triangle's normal.
DRENCH_HD double signed_volume(Vec3<double> a, Vec3<double> b, Vec3<double> c, Vec3<double> p) {
  return dot(cross(b - a, c - a), p - a);
}

/// Does segment p..q cross triangle (a, b, c)? Touching an edge counts, within 1e-9 of its size.
DRENCH_HD bool segment_crosses(Vec3<double> p, Vec3<double> q, Vec3<double> a, Vec3<double> b,
                               Vec3<double> c) {
  const Vec3<double> n = cross(b - a, c - a);
  const double dp = dot(n, p - a), dq = dot(n, q - a);
  if ((dp > 0) == (dq > 0)) return false;
  const Vec3<double> x = p + (q - p) * (dp / (dp - dq));
  const double slack = -1e-9 * dot(n, n);
  return dot(cross(b - a, x - a), n) >= slack && dot(cross(c - b, x - b), n) >= slack &&
         dot(cross(a - c, x - c), n) >= slack;
}

}  // namespace drench::sim::DRENCH_BACKEND
