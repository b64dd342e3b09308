#pragma once
// Bending of a shell's triangle by the second derivatives kappa of the surface in its material
// axes: three vectors that are fixed sums of the positions of the triangle, its neighbours and
// theirs (sim/setup/shell_rest.h makes the weights). The energy
//   A/2 (kappa - kappa_0 n)^T D (kappa - kappa_0 n)
// is quadratic in the positions where the sheet is flat at rest, kappa_0 = 0: its matrix is a
// constant, positive semidefinite number times the unit matrix for every pair of nodes. For
// isometric bending |kappa| is the curvature (Bergou et al. 2006). Where the sheet is curved at
// rest, what is added to the energy and its gradient turns with the normal n.

#include "sim/backend/double_scalar.h"
#include "sim/backend/vec3.h"

namespace drench::sim::DRENCH_BACKEND {

/// On curvatures (xx, yy, 2 xy), N m. Positive definite.
template <class T>
struct Rigidity {
  T d11, d22, d12, d66;
};

/// Numbers or vectors per component (xx, yy, 2 xy).
template <class V>
struct Curvature {
  V xx, yy, xy;
};

template <class V>
DRENCH_HD Curvature<V> operator+(const Curvature<V>& a, const Curvature<V>& b) {
  return {a.xx + b.xx, a.yy + b.yy, a.xy + b.xy};
}
template <class V>
DRENCH_HD Curvature<V> operator-(const Curvature<V>& a, const Curvature<V>& b) {
  return {a.xx - b.xx, a.yy - b.yy, a.xy - b.xy};
}
template <class V, class T>
DRENCH_HD Curvature<V> operator*(const Curvature<V>& a, T s) {
  return {a.xx * s, a.yy * s, a.xy * s};
}

template <class V, class T>
DRENCH_HD Curvature<V> moment(const Rigidity<T>& d, const Curvature<V>& k) {
  return {k.xx * d.d11 + k.yy * d.d12, k.xx * d.d12 + k.yy * d.d22, k.xy * d.d66};
}

template <class T>
DRENCH_HD T contract(const Curvature<Vec3<T>>& a, const Curvature<Vec3<T>>& b) {
  return dot(a.xx, b.xx) + dot(a.yy, b.yy) + dot(a.xy, b.xy);
}

/// The share of node k in kappa, 1/m^2.
template <class T>
DRENCH_HD void add_node(Curvature<Vec3<T>>& kappa, const Curvature<T>& weight, Vec3<T> x) {
  kappa.xx = kappa.xx + x * weight.xx;
  kappa.yy = kappa.yy + x * weight.yy;
  kappa.xy = kappa.xy + x * weight.xy;
}

/// kappa - kappa_0 n, of a sheet that is curved at rest.
template <class T>
DRENCH_HD Curvature<Vec3<T>> beyond_rest(const Curvature<Vec3<T>>& kappa, const Curvature<T>& rest,
                                         Vec3<T> normal) {
  return {kappa.xx - normal * rest.xx, kappa.yy - normal * rest.yy, kappa.xy - normal * rest.xy};
}

/// J, of curvatures less those of rest.
template <class T>
DRENCH_HD T bending_energy(T area, const Rigidity<T>& d, const Curvature<Vec3<T>>& kappa) {
  return T(0.5f) * area * contract(moment(d, kappa), kappa);
}

/// N, on a node, at a normal that does not turn.
template <class T>
DRENCH_HD Vec3<T> bending_force(T area, const Curvature<Vec3<T>>& moments,
                                const Curvature<T>& weight) {
  return (moments.xx * weight.xx + moments.yy * weight.yy + moments.xy * weight.xy) * (-area);
}

/// N/m, times the unit matrix: the block of two nodes.
template <class T>
DRENCH_HD T bending_weight(T area, const Rigidity<T>& d, const Curvature<T>& a,
                           const Curvature<T>& b) {
  const Curvature<T> m = moment(d, b);
  return area * (a.xx * m.xx + a.yy * m.yy + a.xy * m.xy);
}

/// The normal of a triangle and what turns it. A triangle of less than a hundredth of its area at
/// rest turns as one of that: the gradient is exact above.
template <class T>
struct TurningNormal {
  Vec3<T> corner[3];
  Vec3<T> normal;
  T inverse;  // 1/m^2, over twice the area

  DRENCH_HD TurningNormal(Vec3<T> a, Vec3<T> b, Vec3<T> c, T rest_area) : corner{a, b, c} {
    const Vec3<T> twice = cross(b - a, c - a);
    inverse = T(1.f) / maximum(square_root(length2(twice)), T(0.02f) * rest_area);
    normal = twice * inverse;
  }
  /// Derivative of n . p by corner c, p held.
  DRENCH_HD Vec3<T> derivative(int c, Vec3<T> p) const {
    const Vec3<T> across = p - normal * dot(normal, p);
    return cross(corner[(c + 1) % 3] - corner[(c + 2) % 3], across) * inverse;
  }
};

/// N, on corner c of a triangle that is curved at rest, beside bending_force: the normal turns and
/// kappa_0 with it. `moments` are those of kappa less kappa_0 n.
template <class T>
DRENCH_HD Vec3<T> turning_force(T area, const Curvature<Vec3<T>>& moments, const Curvature<T>& rest,
                                const TurningNormal<T>& normal, int c) {
  const Vec3<T> q = moments.xx * rest.xx + moments.yy * rest.yy + moments.xy * rest.xy;
  return normal.derivative(c, q) * area;
}

/// How a triangle turns: linear in how corners 1 and 2 move against corner 0, and that of any
/// motion that is rigid. One of less than a hundredth of its area at rest turns as one of that.
template <class T>
struct TriangleTurn {
  Vec3<T> normal, dual[2];  // 1 and 1/m: dual to the edges in their plane

  DRENCH_HD TriangleTurn(Vec3<T> edge1, Vec3<T> edge2, T rest_area) {
    const Vec3<T> twice = cross(edge1, edge2);
    const T least = maximum(T(0.02f) * rest_area, T(1e-12f));  // so that none is an area, too
    const T inverse = T(1.f) / maximum(square_root(length2(twice)), least);
    normal = twice * inverse;
    dual[0] = cross(edge2, normal) * inverse, dual[1] = cross(normal, edge1) * inverse;
  }
  /// Radian, of displacements; of a rotation their curl is the axis and the normal part again.
  DRENCH_HD Vec3<T> of(Vec3<T> d1, Vec3<T> d2) const {
    const Vec3<T> curl = cross(dual[0], d1) + cross(dual[1], d2);
    return curl - normal * (T(0.5f) * dot(normal, curl));
  }
  /// Derivative of torque . of(d1, d2) by d1 or d2, corner 1 or 2.
  DRENCH_HD Vec3<T> derivative(int corner, Vec3<T> torque) const {
    const Vec3<T> q = torque - normal * (T(0.5f) * dot(normal, torque));
    return cross(q, dual[corner - 1]);
  }
};

/// kappa as turned by `turn`, less kappa.
template <class T>
DRENCH_HD Curvature<Vec3<T>> turned(Vec3<T> turn, const Curvature<Vec3<T>>& kappa) {
  return {cross(turn, kappa.xx), cross(turn, kappa.yy), cross(turn, kappa.xy)};
}

/// The derivative of contract(turned(turn, kappa), moments) by `turn`.
template <class T>
DRENCH_HD Vec3<T> torque(const Curvature<Vec3<T>>& kappa, const Curvature<Vec3<T>>& moments) {
  return cross(kappa.xx, moments.xx) + cross(kappa.yy, moments.yy) + cross(kappa.xy, moments.xy);
}

}  // namespace drench::sim::DRENCH_BACKEND
