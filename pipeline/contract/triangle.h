#pragma once
// The closest point of a triangle.

#include <Imath/ImathVec.h>

namespace drench {

/// Ericson, Real-Time Collision Detection, 2005: by Voronoi regions of the triangle.
inline Imath::V3f closest_on_triangle(const Imath::V3f& p, const Imath::V3f& a, const Imath::V3f& b,
                                      const Imath::V3f& c) {
  const Imath::V3f ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp),
              d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const float vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  return a + (ab * vb + ac * vc) / (va + vb + vc);
}

}  // namespace drench
