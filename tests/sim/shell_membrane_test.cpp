// Stretching of shells: derivatives, definiteness, and the closed forms of their law.

#include "sim/passes/cloth/shell_membrane.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace drench::sim_tests {
namespace {

using namespace sim::cpu;
using V = Vec3<double>;
using Matrix9 = std::array<std::array<double, 9>, 9>;
using Corners = std::array<V, 3>;

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double operator()(double low, double high) {
    return low + (high - low) * double(random_()) / 4294967296.0;
  }
  V vector(double size) {
    return {(*this)(-size, size), (*this)(-size, size), (*this)(-size, size)};
  }

 private:
  std::mt19937 random_;
};

/// Corners at (0, 0), (a, 0), (b, c).
RestTriangle<double> rest_triangle(double a, double b, double c) {
  return {.area = a * c / 2, .gradient_x = {1 / a, 0}, .gradient_y = {-b / (a * c), 1 / c}};
}

MembraneLaw<double> law() {
  const auto moduli = orthotropic(900., 500., 60., 0.3);
  return {moduli, strain_limit(1.05, moduli.c11), 0.};
}

constexpr double forever = 1e30;

double energy_at(const RestTriangle<double>& rest, const Corners& x) {
  const Symmetric2<double> e = green_strain(surface_gradient(rest, x[0], x[1], x[2]));
  return rest.area * law().at(e, {0, 0, 0}, forever).energy;
}

enum class Stress { whole, positive };

Matrix9 hessian(const RestTriangle<double>& rest, const Corners& x, Stress kind) {
  const auto f = surface_gradient(rest, x[0], x[1], x[2]);
  const auto r = law().at(green_strain(f), {0, 0, 0}, forever);
  const auto stress = kind == Stress::whole ? r.stress : positive_part(r.stress);
  Matrix9 h;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      const Block3<double> block = membrane_block(rest, f, stress, r.moduli, a, b);
      const V row[3] = {block.x, block.y, block.z};
      for (int i = 0; i < 3; ++i)
        h[3 * a + i][3 * b] = row[i].x, h[3 * a + i][3 * b + 1] = row[i].y,
                         h[3 * a + i][3 * b + 2] = row[i].z;
    }
  }
  return h;
}

/// Smallest and largest eigenvalue of a symmetric matrix, by Jacobi's rotations.
std::pair<double, double> extreme_eigenvalues(Matrix9 a) {
  for (int sweep = 0; sweep < 30; ++sweep) {
    for (int p = 0; p < 9; ++p) {
      for (int q = p + 1; q < 9; ++q) {
        if (a[p][q] == 0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::hypot(theta, 1.0));
        const double c = 1 / std::hypot(t, 1.0), s = t * c;
        for (int k = 0; k < 9; ++k) {
          const double u = a[k][p], v = a[k][q];
          a[k][p] = c * u - s * v, a[k][q] = s * u + c * v;
        }
        for (int k = 0; k < 9; ++k) {
          const double u = a[p][k], v = a[q][k];
          a[p][k] = c * u - s * v, a[q][k] = s * u + c * v;
        }
      }
    }
  }
  double low = a[0][0], high = a[0][0];
  for (int k = 1; k < 9; ++k) low = std::min(low, a[k][k]), high = std::max(high, a[k][k]);
  return {low, high};
}

/// A triangle anywhere from collapsed to stretched threefold, of either orientation.
Corners random_corners(const RestTriangle<double>& rest, Draw& draw) {
  const double u = draw(-3, 3), v = draw(-3, 3), shear = draw(-1, 1);
  const double a = 1 / rest.gradient_x[0], c = 1 / rest.gradient_y[1],
               b = -rest.gradient_y[0] * a * c;
  const V t = draw.vector(1), s = draw.vector(1), origin = draw.vector(5);
  const V x = t * (1 / length(t)), across = s - x * dot(x, s), y = across * (1 / length(across));
  const V first = x * u, second = y * v + x * shear;
  return {origin, origin + first * a, origin + first * b + second * c};
}

// Central differences of the energy; 1e-6 of a step of 1e-6 m and forces of some N.
TEST(ShellMembrane, ForceIsTheGradientOfTheEnergy) {
  Draw draw(3);
  for (int trial = 0; trial < 50; ++trial) {
    const auto rest = rest_triangle(draw(0.5, 1), draw(-0.3, 1), draw(0.4, 1));
    Corners x = random_corners(rest, draw);
    const auto f = surface_gradient(rest, x[0], x[1], x[2]);
    const auto r = law().at(green_strain(f), {0, 0, 0}, forever);
    for (int c = 0; c < 3; ++c) {
      const V force = membrane_force(rest, f, r.stress, c), d = draw.vector(1);
      const double step = 1e-5;
      Corners high = x, low = x;
      high[c] = high[c] + d * step, low[c] = low[c] - d * step;
      const double slope = (energy_at(rest, high) - energy_at(rest, low)) / (2 * step);
      EXPECT_NEAR(-dot(force, d), slope, 1e-6 * (length(force) + 1)) << trial;
    }
  }
}

TEST(ShellMembrane, BlocksAreTheDerivativeOfTheForce) {
  Draw draw(4);
  for (int trial = 0; trial < 50; ++trial) {
    const auto rest = rest_triangle(draw(0.5, 1), draw(-0.3, 1), draw(0.4, 1));
    const Corners x = random_corners(rest, draw);
    const Matrix9 h = hessian(rest, x, Stress::whole);
    const double scale = extreme_eigenvalues(h).second;
    for (int column = 0; column < 9; ++column) {
      const double step = 1e-6;
      const auto force = [&](double by, int c) {
        Corners y = x;
        double* at = &y[column / 3].x;
        at[column % 3] += by;
        const auto f = surface_gradient(rest, y[0], y[1], y[2]);
        return membrane_force(rest, f, law().at(green_strain(f), {0, 0, 0}, forever).stress, c);
      };
      for (int c = 0; c < 3; ++c) {
        const V d = (force(-step, c) - force(step, c)) * (1 / (2 * step));
        EXPECT_NEAR(h[3 * c][column], d.x, 1e-5 * scale);
        EXPECT_NEAR(h[3 * c + 1][column], d.y, 1e-5 * scale);
        EXPECT_NEAR(h[3 * c + 2][column], d.z, 1e-5 * scale);
      }
    }
  }
}

// Random, compressed, inverted, collapsed to a line and to a point. -1e-12 of the largest is
// rounding.
TEST(ShellMembrane, ATriangleIsPositiveSemidefinite) {
  Draw draw(5);
  const auto expect_definite = [](const RestTriangle<double>& rest, const Corners& x) {
    const auto [low, high] = extreme_eigenvalues(hessian(rest, x, Stress::positive));
    EXPECT_GE(low, -1e-12 * high);
    EXPECT_TRUE(std::isfinite(high));
  };
  for (int trial = 0; trial < 2000; ++trial) {
    const auto rest = rest_triangle(draw(0.01, 1), draw(-1, 1), draw(0.01, 1));
    Corners x = random_corners(rest, draw);
    expect_definite(rest, x);
    const V middle = (x[0] + x[1] + x[2]) * (1. / 3);
    const double size = trial % 3 == 0 ? 0. : draw(0, 0.5);  // compressed
    for (V& corner : x) corner = middle + (corner - middle) * size;
    expect_definite(rest, x);
    x[2] = x[0] + (x[1] - x[0]) * draw(-2, 2);  // a line
    expect_definite(rest, x);
  }
}

TEST(ShellMembrane, WithoutProjectionACompressedTriangleIsIndefinite) {
  const auto rest = rest_triangle(1, 0, 1);
  const Corners x{V{0, 0, 0}, V{0.9, 0, 0}, V{0, 0.9, 0}};
  EXPECT_LT(extreme_eigenvalues(hessian(rest, x, Stress::whole)).first, -1);
}

// The same in float as in double, within what a float of E holds.
TEST(ShellMembrane, FloatsFollowDoubles) {
  const auto rest = rest_triangle(0.01, 0.004, 0.009);
  const RestTriangle<float> single{float(rest.area),
                                   {float(rest.gradient_x[0]), float(rest.gradient_x[1])},
                                   {float(rest.gradient_y[0]), float(rest.gradient_y[1])}};
  const auto f = surface_gradient(rest, V{0, 0, 0}, V{0.0106, 0, 0.001}, V{0.004, 0.0089, 0});
  const auto g =
      surface_gradient<float>(single, {0, 0, 0}, {0.0106f, 0, 0.001f}, {0.004f, 0.0089f, 0});
  const auto a = law().at(green_strain(f), {0, 0, 0}, forever);
  const auto moduli = orthotropic(900.f, 500.f, 60.f, 0.3f);
  const MembraneLaw<float> same{moduli, strain_limit(1.05f, moduli.c11), 0.f};
  const auto b = same.at(green_strain(g), {0, 0, 0}, 1e30f);
  EXPECT_NEAR(b.stress.xx, a.stress.xx, 1e-4 * a.stress.xx);
  EXPECT_NEAR(b.stress.yy, a.stress.yy, 1e-3 * a.stress.xx);
  EXPECT_NEAR(b.stress.xy, a.stress.xy, 1e-4 * a.stress.xx);
}

// Pulled along warp with free sides: S_xx = E_1 E_xx, E_yy = -nu_12 E_xx, nu_12 = nu sqrt(E_1/E_2).
TEST(ShellMembrane, UniaxialPullHasYoungsModulusAndPoissonsRatio) {
  const double warp = 900, weft = 500, poisson = 0.3, strain = 1e-3;
  const auto moduli = orthotropic(warp, weft, 60., poisson);
  const double narrowing = poisson * std::sqrt(warp / weft) * strain;
  const auto s = moduli.times({strain, -narrowing, 0});
  EXPECT_NEAR(s.xx, warp * strain, 1e-12);
  EXPECT_NEAR(s.yy, 0, 1e-12);
}

// Moments of the limit: none up to the stretch; twice differentiable where it starts and where the
// eigenvalues meet.
TEST(ShellMembrane, StrainLimitStartsSmoothly) {
  const auto limit = strain_limit(1.05, 1000.);
  const double start = (1.05 * 1.05 - 1) / 2;
  EXPECT_EQ(limit.at({start, 0, 0}).energy, 0);
  EXPECT_NEAR(limit.at({1.1 * start, 0, 0}).moduli.c11, 10 * 1000, 1e-6);
  const auto equal = limit.at({2 * start, 2 * start, 0}).moduli;
  const auto near = limit.at({2 * start + 1e-9, 2 * start, 1e-9}).moduli;
  EXPECT_NEAR(equal.c11, near.c11, 1e-5 * equal.c11);
  EXPECT_NEAR(equal.c66, near.c66, 1e-5 * equal.c11);
  EXPECT_NEAR(equal.c66, equal.c11 / 2, 1e-9 * equal.c11);  // isotropic: mu = bend / 2
}

// tau C : dE/dt gives off power A tau dE:C:dE, and what it pulls with has no resultant or moment.
TEST(ShellMembrane, ViscosityTakesEnergyAndKeepsMomentum) {
  Draw draw(6);
  MembraneLaw<double> viscous = law();
  viscous.damping_time = 0.02;
  const auto rest = rest_triangle(1, 0.2, 0.8);
  const Corners x = random_corners(rest, draw), v{draw.vector(1), draw.vector(1), draw.vector(1)};
  const auto f = surface_gradient(rest, x[0], x[1], x[2]);
  const auto rate = green_strain_rate(f, surface_gradient(rest, v[0], v[1], v[2]));
  const auto e = green_strain(f);
  const auto extra = viscous.at(e, rate, 0.01).stress + law().at(e, rate, 0.01).stress * -1.;
  double power = 0;
  V sum{0, 0, 0}, spin{0, 0, 0};
  for (int c = 0; c < 3; ++c) {
    const V force = membrane_force(rest, f, extra, c);
    power += dot(force, v[c]), sum = sum + force, spin = spin + cross(x[c], force);
  }
  const double expected = rest.area * 0.02 * contract(law().moduli.times(rate), rate);
  EXPECT_GT(expected, 0);
  EXPECT_NEAR(power, -expected, 1e-9 * expected);
  EXPECT_NEAR(length(sum), 0, 1e-9 * expected);
  EXPECT_NEAR(length(spin), 0, 1e-8 * expected);
  EXPECT_NEAR(viscous.at({0, 0, 0}, rate, 0.01).moduli.c11, 3 * law().moduli.c11, 1e-9);
}

}  // namespace
}  // namespace drench::sim_tests
