#pragma once
// The closest point of a triangle.

#include <Imath/ImathVec.h>

#include <algorithm>

namespace drench {

/// The end of a segment that is a point is `a`.
inline Imath::V3f closest_on_segment(const Imath::V3f& p, const Imath::V3f& a,
                                     const Imath::V3f& b) {
  const Imath::V3f ab = b - a;
  const float square = ab.length2();
  return square > 0 ? a + ab * std::clamp(ab.dot(p - a) / square, 0.f, 1.f) : a;
}

/// Ericson, Real-Time Collision Detection, 2005: by Voronoi regions of the triangle. Of a triangle
/// without area, but for rounding, the nearest point of its edges.
inline Imath::V3f closest_on_triangle(const Imath::V3f& p, const Imath::V3f& a, const Imath::V3f& b,
                                      const Imath::V3f& c) {
  const Imath::V3f ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp),
              d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const float vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return a + ab * (d1 / (d1 - d3));
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return a + ac * (d2 / (d2 - d6));
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0 && (d4 - d3) + (d5 - d6) > 0)
    return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  if (ab.cross(ac).length2() > 1e-6f * ab.length2() * ac.length2())
    return a + (ab * vb + ac * vc) / (va + vb + vc);
  Imath::V3f nearest = closest_on_segment(p, a, b);
  for (const Imath::V3f& at : {closest_on_segment(p, b, c), closest_on_segment(p, c, a)})
    if ((at - p).length2() < (nearest - p).length2()) nearest = at;
  return nearest;
}

}  // namespace drench
