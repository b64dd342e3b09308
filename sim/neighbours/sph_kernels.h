#pragma once
// SPH kernels of support radius h as Mueller, Charypar, Gross 2003 define them: poly6, spiky, and
// the viscosity kernel's Laplacian; and their integrals over a flat layer and over the half-space
// beyond it, the wall functions of eqs (8) and (9) of Harada et al. 2007. q = distance / h
// throughout. Closed forms and their derivation: tests/validation/README.md, section 4.

#include "sim/backend/pack.h"

namespace drench::sim::DRENCH_BACKEND {

constexpr float pi = 3.14159265358979f;

/// poly6: W(r) = poly6_factor(h) (h^2 - r^2)^3, 1/m^3.
DRENCH_HD float poly6_factor(float h) {
  const float h3 = h * h * h;
  return 315.f / (64.f * pi * h3 * h3 * h3);
}
/// spiky: W(r) = spiky_factor(h) (h - r)^3, 1/m^3.
DRENCH_HD float spiky_factor(float h) {
  const float h3 = h * h * h;
  return 15.f / (pi * h3 * h3);
}
/// spiky: dW/dr = -spiky_gradient_factor(h) (h - r)^2; viscosity: lap W = the same factor (h - r).
DRENCH_HD float spiky_gradient_factor(float h) {
  const float h3 = h * h * h;
  return 45.f / (pi * h3 * h3);
}

/// h times the integral of poly6 over a plane at distance qh.
DRENCH_HD float poly6_plane(float q) {
  const float s = max0(1.f - q * q);
  return 315.f / 256.f * s * s * s * s;
}
/// Integral of poly6 over everything beyond a plane at distance qh: the share of density that a
/// particle at q misses there. 1/2 at q = 0.
DRENCH_HD float poly6_halfspace(float q) {
  const float p = q < 1.f ? q : 1.f, p2 = p * p;
  const float odd = p * (1.f + p2 * (-4.f / 3 + p2 * (6.f / 5 + p2 * (-4.f / 7 + p2 / 9.f))));
  return max0(0.5f - 315.f / 256.f * odd);
}
/// h times the integral of the spiky kernel over a plane at distance qh; by the divergence theorem
/// also h times the gradient sum over the half-space beyond, along the normal.
template <class T>
DRENCH_HD T spiky_plane(T q) {
  const T u = max0(T(1.f) - q), u4 = u * u * u * u;
  return T(7.5f) * u4 - T(6.f) * u4 * u;
}
/// Integral of the spiky kernel over everything beyond a plane at distance qh. 1/2 at q = 0.
DRENCH_HD float spiky_halfspace(float q) {
  const float u = max0(1.f - q), u5 = u * u * u * u * u;
  return 1.5f * u5 - u5 * u;
}
/// -d spiky_plane / dq.
template <class T>
DRENCH_HD T spiky_plane_slope(T q) {
  const T u = max0(T(1.f) - q);
  return T(30.f) * u * u * u * (T(1.f) - u);
}
/// h^3 times the integral of the viscosity Laplacian over a plane at distance qh.
DRENCH_HD float viscosity_plane(float q) {
  const float u = max0(1.f - q);
  return 15.f * u * u * (1.f + 2.f * q);
}
/// h^2 times the integral of the viscosity Laplacian over the half-space beyond.
template <class T>
DRENCH_HD T viscosity_halfspace(T q) {
  const T p = minimum(q, T(1.f));
  return max0(T(15.f) * (T(0.5f) - p + p * p * p - T(0.5f) * p * p * p * p));
}

/// Shapes (without factor) of the two kernels that the weakly compressible fluid may sum its
/// density with, of the squared distance.
struct Spiky {
  template <class T>
  static DRENCH_HD T shape(T r2, T h) {
    const T u = max0(h - square_root(r2));
    return u * u * u;
  }
  static float factor(float h) { return spiky_factor(h); }
};
struct Poly6 {
  template <class T>
  static DRENCH_HD T shape(T r2, T h) {
    const T u = max0(h * h - r2);
    return u * u * u;
  }
  static float factor(float h) { return poly6_factor(h); }
};

/// The kernel of the incompressible solver (Wendland 1995; particles do not pair with it, Dehnen
/// and Aly 2012). u = 1 - r / h, q = distance / h of a plane, negative behind it.
struct WendlandC2 {
  /// W h^3.
  template <class T>
  static DRENCH_HD T value(T u) {
    const T u2 = u * u;
    return T(10.5f / pi) * (u2 * u2) * (T(5.f) - T(4.f) * u);
  }
  /// -W'(r) / r h^5.
  template <class T>
  static DRENCH_HD T slope(T u) {
    return T(210.f / pi) * (u * u * u);
  }
  /// h times the integral over the plane.
  static DRENCH_HD float plane(float q) {
    const float t = max0(1.f - fabsf(q)), t2 = t * t;
    return 21.f * t2 * t2 * t * (1.f - t * (1.5f - 4.f / 7 * t));
  }
  /// Integral over everything beyond the plane.
  static DRENCH_HD float halfspace(float q) {
    const float t = max0(1.f - fabsf(q)), t2 = t * t;
    const float beyond = t2 * t2 * t2 * (3.5f - t * (4.5f - 1.5f * t));
    return q < 0.f ? 1.f - beyond : beyond;
  }
  /// 2 pi times the integral of r W (r - q)^2 from q on, W continued so that moment(-q) =
  /// moment(q) + 2 q: what a ball misses of the half-space (passes/obstacle/obstacle_density.h).
  /// Times h^4.
  static DRENCH_HD float moment(float q) {
    const float t = max0(1.f - fabsf(q)), t2 = t * t;
    const float beyond = t2 * t2 * t2 * t * (1.f - t * (9.f / 8 - t / 3));
    return q < 0.f ? beyond - 2.f * q : beyond;
  }
  /// W of the squared distance, without 1 / h^3: see Spiky.
  template <class T>
  static DRENCH_HD T shape(T r2, T h) {
    return value(max0(T(1.f) - square_root(r2) / h));
  }
  static float factor(float h) { return 1.f / (h * h * h); }
};

/// Weight of a pair in the viscous rows (passes/viscosity/viscosity_rows.h): w = (1 - q)^3, in
/// place of the Wendland kernel's (1 - q)^3 / q^2, because few neighbours weigh more evenly by it:
/// shear along the axes and the diagonals of a cubic lattice differs by a tenth, by the other by a
/// factor of two (docs/decisions/0028-weight-of-viscous-pairs.md).
struct ViscousWeight {
  template <class T>
  static DRENCH_HD T value(T u) {
    return u * u * u;
  }
  /// h^2 / nu times the rate at which a no-slip wall at distance qh brakes a flow along it whose
  /// velocity grows linearly from the wall's, fluid beyond it going on in the same line:
  /// (k / q) int_{z > q} w x^2 z dV, k = 6300 / pi, lengths over h. q > 0.
  static DRENCH_HD float wall_along(float q) {
    const float t = max0(1.f - q), t2 = t * t;
    return t2 * t2 * t2 * (105.f - t * (225.f - t * (163.125f - 40.f * t))) / q;
  }
  /// The same for a flow along the wall's normal: (k / q) int_{z > q} w z^3 dV.
  static DRENCH_HD float wall_across(float q) {
    const float t = max0(1.f - q), t2 = t * t;
    return t2 * t2 * t * (630.f - t * (1995.f - t * (2430.f - t * (1338.75f - 280.f * t)))) / q;
  }
  /// k of nu / h^7 and a neighbour's volume: in a continuum the sum of k w x (x . v) is that of a
  /// Newtonian fluid, int_{all} k w x^2 y^2 dV = 2.
  static constexpr float factor = 6300.f / pi;
};

}  // namespace drench::sim::DRENCH_BACKEND
