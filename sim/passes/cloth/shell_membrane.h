#pragma once
// Stretching of a shell's triangle: linear displacements (CST), Green strain, a law that is linear
// between strain and second Piola-Kirchhoff stress (St. Venant-Kirchhoff) and orthotropic, a limit
// of the strain, and viscosity along the same directions (Kelvin-Voigt). Moduli are those of a
// sheet, N/m: Young's modulus times thickness. T is a float, a double or a pack.

#include "sim/backend/double_scalar.h"
#include "sim/backend/vec3.h"

namespace drench::sim::DRENCH_BACKEND {

/// A symmetric 2 x 2 tensor in the material axes warp and weft.
template <class T>
struct Symmetric2 {
  T xx, yy, xy;
  friend DRENCH_HD Symmetric2 operator+(Symmetric2 a, Symmetric2 b) {
    return {a.xx + b.xx, a.yy + b.yy, a.xy + b.xy};
  }
  friend DRENCH_HD Symmetric2 operator*(Symmetric2 a, T s) {
    return {a.xx * s, a.yy * s, a.xy * s};
  }
};

template <class T>
DRENCH_HD T contract(Symmetric2<T> a, Symmetric2<T> b) {
  return a.xx * b.xx + a.yy * b.yy + T(2.f) * a.xy * b.xy;
}

/// Eigenvalues, high >= low, and the eigenprojector n n^T of the high one.
template <class T>
struct Spectrum2 {
  T high, low;
  Symmetric2<T> projector;
};

template <class T>
DRENCH_HD Spectrum2<T> spectrum_of(Symmetric2<T> a) {
  const T mean = (a.xx + a.yy) * T(0.5f), half = (a.xx - a.yy) * T(0.5f);
  const T radius = square_root(half * half + a.xy * a.xy);
  const auto round = radius > T(0.f);  // else any axes are
  const T scale = T(0.5f) / select(round, radius, T(1.f));
  const T cosine = select(round, half * scale, T(0.5f));
  return {mean + radius, mean - radius, {T(0.5f) + cosine, T(0.5f) - cosine, a.xy * scale}};
}

/// The nearest tensor without negative eigenvalues.
template <class T>
DRENCH_HD Symmetric2<T> positive_part(Symmetric2<T> a) {
  const Spectrum2<T> s = spectrum_of(a);
  const T high = max0(s.high), low = max0(s.low), step = high - low;
  return {low + s.projector.xx * step, low + s.projector.yy * step, s.projector.xy * step};
}

/// At rest: area, m^2, and the gradients of the barycentric coordinates of corners 1 and 2, 1/m:
/// the rows of the inverse of the 2 x 2 matrix of the edges from corner 0.
template <class T>
struct RestTriangle {
  T area;
  T gradient_x[2], gradient_y[2];

  /// Of corner c = 0, 1, 2.
  DRENCH_HD T along_warp(int c) const {
    return c > 0 ? gradient_x[c - 1] : -(gradient_x[0] + gradient_x[1]);
  }
  DRENCH_HD T along_weft(int c) const {
    return c > 0 ? gradient_y[c - 1] : -(gradient_y[0] + gradient_y[1]);
  }
};

/// Columns of a 3 x 2 matrix: the derivatives of a field along warp and weft.
template <class T>
struct SurfaceGradient {
  Vec3<T> warp, weft;
  friend DRENCH_HD SurfaceGradient operator+(const SurfaceGradient& a, const SurfaceGradient& b) {
    return {a.warp + b.warp, a.weft + b.weft};
  }
  friend DRENCH_HD SurfaceGradient operator*(const SurfaceGradient& a, T s) {
    return {a.warp * s, a.weft * s};
  }
};

/// Of what has the values a, b, c at the corners. Of positions: the deformation gradient F.
template <class T>
DRENCH_HD SurfaceGradient<T> surface_gradient(const RestTriangle<T>& rest, Vec3<T> a, Vec3<T> b,
                                              Vec3<T> c) {
  const Vec3<T> e = b - a, f = c - a;
  return {e * rest.gradient_x[0] + f * rest.gradient_x[1],
          e * rest.gradient_y[0] + f * rest.gradient_y[1]};
}

/// E = (F^T F - 1) / 2.
template <class T>
DRENCH_HD Symmetric2<T> green_strain(const SurfaceGradient<T>& f) {
  return {(length2(f.warp) - T(1.f)) * T(0.5f), (length2(f.weft) - T(1.f)) * T(0.5f),
          dot(f.warp, f.weft) * T(0.5f)};
}

/// dE/dt, 1/s, `rate` the gradient of the velocities.
template <class T>
DRENCH_HD Symmetric2<T> green_strain_rate(const SurfaceGradient<T>& f,
                                          const SurfaceGradient<T>& rate) {
  return {dot(f.warp, rate.warp), dot(f.weft, rate.weft),
          (dot(f.warp, rate.weft) + dot(f.weft, rate.warp)) * T(0.5f)};
}

/// d stress / d strain, N/m, on (xx, yy, 2 xy).
template <class T>
struct Moduli {
  T c11, c22, c12, c66, c16, c26;

  friend DRENCH_HD Moduli operator+(Moduli a, Moduli b) {
    return {a.c11 + b.c11, a.c22 + b.c22, a.c12 + b.c12,
            a.c66 + b.c66, a.c16 + b.c16, a.c26 + b.c26};
  }
  friend DRENCH_HD Moduli operator*(Moduli a, T s) {
    return {a.c11 * s, a.c22 * s, a.c12 * s, a.c66 * s, a.c16 * s, a.c26 * s};
  }
  DRENCH_HD Symmetric2<T> times(Symmetric2<T> e) const {
    const T shear = T(2.f) * e.xy;
    return {c11 * e.xx + c12 * e.yy + c16 * shear, c12 * e.xx + c22 * e.yy + c26 * shear,
            c16 * e.xx + c26 * e.yy + c66 * shear};
  }
};

/// Plane stress of an orthotropic sheet. @param warp, weft, shear  moduli, N/m.
/// @param poisson  of |.| < 1: the geometric mean of the two Poisson ratios, nu_12 / E_1 = nu_21 /
///        E_2, with which warp and weft may change places. Positive definite if the moduli are
///        positive.
template <class T>
DRENCH_HD Moduli<T> orthotropic(T warp, T weft, T shear, T poisson) {
  const T scale = T(1.f) / (T(1.f) - poisson * poisson);
  return {.c11 = warp * scale,
          .c22 = weft * scale,
          .c12 = poisson * square_root(warp * weft) * scale,
          .c66 = shear,
          .c16 = T(0.f),
          .c26 = T(0.f)};
}

/// A limit of the strain: energy per area kappa/3 sum max(0, lambda - l0)^3 over the eigenvalues of
/// E. Twice differentiable, and convex and increasing in them, so that its stress and its moduli
/// are positive semidefinite as they are (convex spectral functions: Davis 1957, Lewis 1996).
template <class T>
struct StrainLimit {
  T start;      // l0, the Green strain at which it acts
  T stiffness;  // kappa, N/m

  struct Response {
    T energy;  // J/m^2
    Symmetric2<T> stress;
    Moduli<T> moduli;
  };

  DRENCH_HD Response at(Symmetric2<T> strain) const {
    const Spectrum2<T> s = spectrum_of(strain);
    const T a = max0(s.high - start), b = max0(s.low - start);
    const T slope_a = stiffness * a * a, slope_b = stiffness * b * b;
    const T bend_a = T(2.f) * stiffness * a, bend_b = T(2.f) * stiffness * b;
    // (phi'(high) - phi'(low)) / (high - low); the second factor is in [0, 1], 1 where both exceed
    const T apart = s.high - s.low;
    const T share = select(a - b < apart, (a - b) / select(apart > T(0.f), apart, T(1.f)), T(1.f));
    const T twist = stiffness * (a + b) * share;
    const Symmetric2<T> p = s.projector, q{T(1.f) - p.xx, T(1.f) - p.yy, -p.xy};
    // (n m^T + m n^T) / 2 of the two eigenvectors, n = (c, s), m = (-s, c): (-cs, cs, (c^2 -
    // s^2)/2)
    const Symmetric2<T> r{-p.xy, p.xy, (p.xx - p.yy) * T(0.5f)};
    return {.energy = stiffness * (a * a * a + b * b * b) * T(1.f / 3),
            .stress = p * slope_a + q * slope_b,
            .moduli = square(p) * bend_a + square(q) * bend_b + square(r) * (T(2.f) * twist)};
  }

 private:
  static DRENCH_HD Moduli<T> square(Symmetric2<T> p) {
    return {.c11 = p.xx * p.xx,
            .c22 = p.yy * p.yy,
            .c12 = p.xx * p.yy,
            .c66 = p.xy * p.xy,
            .c16 = p.xx * p.xy,
            .c26 = p.yy * p.xy};
  }
};

/// @param stretch  > 1, length over rest length up to which the sheet has its own moduli. A tenth
/// of
///        the strain beyond it resists ten times as much as `modulus`, N/m.
template <class T>
DRENCH_HD StrainLimit<T> strain_limit(T stretch, T modulus) {
  const T start = (stretch * stretch - T(1.f)) * T(0.5f);
  return {start, T(50.f) * modulus / start};
}

/// What a triangle answers with: stress, and the moduli of its derivative by the positions.
template <class T>
struct MembraneResponse {
  T energy;              // J/m^2, what is stored
  Symmetric2<T> stress;  // N/m
  Moduli<T> moduli;      // N/m
};

/// What a sheet is made of, in its plane.
template <class T>
struct MembraneLaw {
  Moduli<T> moduli;
  StrainLimit<T> limit;
  T damping_time;  // s: the viscosity is this times the moduli

  /// @param strain_rate  1/s, at the positions at hand. @param dt  s, of the implicit step in whose
  ///        matrix the viscosity counts by damping_time / dt.
  DRENCH_HD MembraneResponse<T> at(Symmetric2<T> strain, Symmetric2<T> strain_rate, T dt) const {
    const auto limited = limit.at(strain);
    const Symmetric2<T> elastic = moduli.times(strain);
    return {.energy = contract(elastic, strain) * T(0.5f) + limited.energy,
            .stress = elastic + moduli.times(strain_rate) * damping_time + limited.stress,
            .moduli = moduli * (T(1.f) + damping_time / dt) + limited.moduli};
  }
};

/// N, on corner c: -A F S grad L_c.
template <class T>
DRENCH_HD Vec3<T> membrane_force(const RestTriangle<T>& rest, const SurfaceGradient<T>& f,
                                 Symmetric2<T> stress, int c) {
  const T x = rest.along_warp(c), y = rest.along_weft(c);
  return (f.warp * (stress.xx * x + stress.xy * y) + f.weft * (stress.xy * x + stress.yy * y)) *
         (-rest.area);
}

/// A 3 x 3 matrix by rows.
template <class T>
struct Block3 {
  Vec3<T> x, y, z;
  DRENCH_HD Vec3<T> times(Vec3<T> v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
  DRENCH_HD Vec3<T> transpose_times(Vec3<T> v) const { return x * v.x + y * v.y + z * v.z; }
};

/// The block of corners a and b, N/m, of the derivative of -membrane_force: A (B_a^T C B_b + (grad
/// L_a . S grad L_b) 1), B_c taking a displacement of corner c to the change of (E_xx, E_yy, 2
/// E_xy). The 9 x 9 of a triangle is positive semidefinite where `stress` is; positive_part makes
/// it so. The block of b and a is the transpose.
template <class T>
DRENCH_HD Block3<T> membrane_block(const RestTriangle<T>& rest, const SurfaceGradient<T>& f,
                                   Symmetric2<T> stress, const Moduli<T>& m, int a, int b) {
  const T ax = rest.along_warp(a), ay = rest.along_weft(a), bx = rest.along_warp(b),
          by = rest.along_weft(b);
  const T A = rest.area;
  // by the products of the columns of F
  const T uu = A * (m.c11 * ax * bx + m.c66 * ay * by + m.c16 * (ax * by + ay * bx));
  const T vv = A * (m.c22 * ay * by + m.c66 * ax * bx + m.c26 * (ax * by + ay * bx));
  const T uv = A * (m.c12 * ax * by + m.c66 * ay * bx + m.c16 * ax * bx + m.c26 * ay * by);
  const T vu = A * (m.c12 * ay * bx + m.c66 * ax * by + m.c16 * ax * bx + m.c26 * ay * by);
  const T pull =
      A * (ax * (stress.xx * bx + stress.xy * by) + ay * (stress.xy * bx + stress.yy * by));
  const Vec3<T> p = f.warp * uu + f.weft * uv, q = f.warp * vu + f.weft * vv;  // of warp, of weft
  const Vec3<T> u = f.warp, v = f.weft;
  return {{u.x * p.x + v.x * q.x + pull, u.x * p.y + v.x * q.y, u.x * p.z + v.x * q.z},
          {u.y * p.x + v.y * q.x, u.y * p.y + v.y * q.y + pull, u.y * p.z + v.y * q.z},
          {u.z * p.x + v.z * q.x, u.z * p.y + v.z * q.y, u.z * p.z + v.z * q.z + pull}};
}

}  // namespace drench::sim::DRENCH_BACKEND
