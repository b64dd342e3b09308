#include "pipeline/contract/shot/colour.h"

#include <cmath>

namespace drench {

namespace {

using Vector = std::array<double, 3>;

struct Chromaticity {
  double x, y;
};

struct Primaries {
  Chromaticity red, green, blue, white;
};

// Rec. ITU-R BT.709; SMPTE ST 2065 / ACEScg specification S-2014-004 (AP1).
constexpr Primaries rec709{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}};
constexpr Primaries ap1{{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, {0.32168, 0.33767}};

// Bradford's cone responses from XYZ.
constexpr Matrix3 bradford{
    {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};

Matrix3 multiply(const Matrix3& a, const Matrix3& b) {
  Matrix3 product{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      for (size_t k = 0; k < 3; ++k) product[i][j] += a[i][k] * b[k][j];
    }
  }
  return product;
}

Vector multiply(const Matrix3& a, const Vector& v) {
  Vector product{};
  for (size_t i = 0; i < 3; ++i) product[i] = a[i][0] * v[0] + a[i][1] * v[1] + a[i][2] * v[2];
  return product;
}

Matrix3 inverse(const Matrix3& m) {
  const auto minor = [&](size_t i, size_t j) {
    const size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
    return m[a][c] * m[b][d] - m[a][d] * m[b][c];
  };
  const double determinant = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
  Matrix3 result{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) result[j][i] = minor(i, j) / determinant;
  }
  return result;
}

Vector xyz_of(const Chromaticity& c) { return {c.x / c.y, 1, (1 - c.x - c.y) / c.y}; }

Matrix3 diagonal(const Vector& v) { return {{{v[0], 0, 0}, {0, v[1], 0}, {0, 0, v[2]}}}; }

/// Columns are the primaries, scaled so that (1, 1, 1) gives the white.
Matrix3 xyz_from_rgb(const Primaries& p) {
  const Vector r = xyz_of(p.red), g = xyz_of(p.green), b = xyz_of(p.blue);
  const Matrix3 columns{{{r[0], g[0], b[0]}, {r[1], g[1], b[1]}, {r[2], g[2], b[2]}}};
  return multiply(columns, diagonal(multiply(inverse(columns), xyz_of(p.white))));
}

Matrix3 adaptation(const Chromaticity& from, const Chromaticity& to) {
  const Vector source = multiply(bradford, xyz_of(from));
  const Vector target = multiply(bradford, xyz_of(to));
  const Vector gain{target[0] / source[0], target[1] / source[1], target[2] / source[2]};
  return multiply(inverse(bradford), multiply(diagonal(gain), bradford));
}

// IEC 61966-2-1.
double linear_from_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

}  // namespace

const Matrix3& acescg_from_rec709() {
  static const Matrix3 matrix =
      multiply(inverse(xyz_from_rgb(ap1)),
               multiply(adaptation(rec709.white, ap1.white), xyz_from_rgb(rec709)));
  return matrix;
}

Imath::V3f acescg_from_srgb(const Imath::V3d& encoded) {
  const Vector display{linear_from_srgb(encoded.x), linear_from_srgb(encoded.y),
                       linear_from_srgb(encoded.z)};
  const Vector linear = multiply(acescg_from_rec709(), display);
  return {float(linear[0]), float(linear[1]), float(linear[2])};
}

}  // namespace drench
