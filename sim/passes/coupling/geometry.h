#pragma once
// Point, segment and path against triangles.

#include "sim/backend/double_scalar.h"
#include "sim/backend/vec3.h"

namespace drench::sim::DRENCH_BACKEND {

/// Closest point of triangle (a, b, c) to p: weights sum to 1 and are not negative.
template <class T>
struct ClosestPoint {
  T wa, wb, wc;  // barycentric weights
  T distance2;   // m^2
};

/// A triangle with what every point that asks for its closest point needs.
template <class T>
struct PreparedTriangle {
  Vec3<T> a, ab, ac;                     // m
  T d11, d12, d22;                       // m^2: ab.ab, ab.ac, ac.ac
  T inverse_ab, inverse_ac, inverse_bc;  // 1/m^2, of the squared lengths
  T inverse;                             // 1/m^4, of the squared double area
};

template <class T>
DRENCH_HD PreparedTriangle<T> prepare_triangle(Vec3<T> a, Vec3<T> b, Vec3<T> c) {
  const T tiny(1e-30f), one(1.f);  // an edge of no length has its closest point at its start
  const Vec3<T> ab = b - a, ac = c - a, bc = c - b;
  const T d11 = dot(ab, ab), d12 = dot(ab, ac), d22 = dot(ac, ac);
  return {.a = a,
          .ab = ab,
          .ac = ac,
          .d11 = d11,
          .d12 = d12,
          .d22 = d22,
          .inverse_ab = one / maximum(d11, tiny),
          .inverse_ac = one / maximum(d22, tiny),
          .inverse_bc = one / maximum(dot(bc, bc), tiny),
          .inverse = one / maximum(d11 * d22 - d12 * d12, tiny)};
}

/// The foot of p on the plane of the triangle: p = a + v ab + w ac + something normal.
template <class T>
struct PlaneFoot {
  Vec3<T> ap;  // m, p - a
  T p1, p2;    // m^2, ap.ab, ap.ac
  T v, w;
};

template <class T>
DRENCH_HD PlaneFoot<T> plane_foot(Vec3<T> p, const PreparedTriangle<T>& t) {
  const Vec3<T> ap = p - t.a;
  const T p1 = dot(ap, t.ab), p2 = dot(ap, t.ac);
  return {ap, p1, p2, (t.d22 * p1 - t.d12 * p2) * t.inverse, (t.d11 * p2 - t.d12 * p1) * t.inverse};
}

/// A squared distance that the triangle is not nearer than: to its plane and, in the plane, past
/// the edge line that the foot lies farthest beyond. Cheap, and exact but for corners; less what
/// rounding may add, which grows as the corner at a gets sharp.
template <class T>
DRENCH_HD T distance2_bound(const PlaneFoot<T>& f, const PreparedTriangle<T>& t) {
  const T blur = T(1e-6f) * (t.d11 * t.d22 * t.inverse), det = t.d11 * t.d22 - t.d12 * t.d12;
  const T v = max0(-f.v - blur), w = max0(-f.w - blur), u = max0(f.v + f.w - T(1.f) - blur);
  const T plane = max0(length2(f.ap) * (T(1.f - 1e-5f) - blur) - (f.v * f.p1 + f.w * f.p2));
  const T past = maximum(v * v * t.inverse_ac, maximum(w * w * t.inverse_ab, u * u * t.inverse_bc));
  return plane + past * det * max0(T(0.9999f) - blur);
}

/// Exact in all seven regions: the foot on the plane if it lies inside, else the best edge point.
template <class T>
DRENCH_HD ClosestPoint<T> closest_point(const PlaneFoot<T>& f, const PreparedTriangle<T>& t) {
  const auto clamped = [](T x) { return minimum(max0(x), T(1.f)); };
  const auto inside = (f.v >= T(0.f)) & (f.w >= T(0.f)) & (f.v + f.w <= T(1.f));
  const Vec3<T> bc = t.ac - t.ab, bp = f.ap - t.ab;
  const T t_ab = clamped(f.p1 * t.inverse_ab), t_ac = clamped(f.p2 * t.inverse_ac),
          t_bc = clamped(dot(bp, bc) * t.inverse_bc);
  const T d_ab = length2(f.ap - t.ab * t_ab), d_ac = length2(f.ap - t.ac * t_ac),
          d_bc = length2(bp - bc * t_bc);
  T vb = t_ab, vc = T(0.f), best = d_ab;  // weights of b and c
  const auto use_ac = d_ac < best;
  vb = select(use_ac, T(0.f), vb), vc = select(use_ac, t_ac, vc), best = select(use_ac, d_ac, best);
  const auto use_bc = d_bc < best;
  vb = select(use_bc, T(1.f) - t_bc, vb), vc = select(use_bc, t_bc, vc),
  best = select(use_bc, d_bc, best);
  vb = select(inside, f.v, vb), vc = select(inside, f.w, vc);
  best = select(inside, length2(f.ap - t.ab * f.v - t.ac * f.w), best);
  return {T(1.f) - vb - vc, vb, vc, best};
}

template <class T>
DRENCH_HD ClosestPoint<T> closest_point(Vec3<T> p, Vec3<T> a, Vec3<T> b, Vec3<T> c) {
  const PreparedTriangle<T> t = prepare_triangle(a, b, c);
  return closest_point(plane_foot(p, t), t);
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
