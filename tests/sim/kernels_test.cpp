// SPH kernels and wall functions against integrals done here and the closed forms of the data.

#include "sim/neighbours/sph_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/setup/wall_table.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

/// Midpoint rule with 20000 points: error below 1e-8 for the polynomials here.
template <class F>
double integrate(double from, double to, const F& f) {
  constexpr int n = 20000;
  double sum = 0;
  for (int k = 0; k < n; ++k) sum += f(from + (to - from) * (k + 0.5) / n);
  return sum * (to - from) / n;
}

constexpr double h = 0.02;         // m
constexpr double rounding = 2e-6;  // of a float closed form with ten operations of order one

double poly6(double r) { return sim::cpu::poly6_factor(float(h)) * std::pow(h * h - r * r, 3); }
double minus_spiky_slope(double r) {
  return sim::cpu::spiky_gradient_factor(float(h)) * (h - r) * (h - r);
}

size_t column(const std::vector<std::string>& header, const std::string& name) {
  const auto found = std::find(header.begin(), header.end(), name);
  EXPECT_NE(found, header.end()) << name;
  return size_t(found - header.begin());
}

TEST(Kernels, Poly6IntegratesToOne) {
  const double volume = integrate(0, h, [](double r) { return 4 * M_PI * r * r * poly6(r); });
  EXPECT_NEAR(volume, 1, rounding);
}

// Integration by parts: int 4 pi r^2 W dr = int 4/3 pi r^3 (-dW/dr) dr.
TEST(Kernels, SpikyWithThisGradientIntegratesToOne) {
  const double volume =
      integrate(0, h, [](double r) { return 4. / 3 * M_PI * r * r * r * minus_spiky_slope(r); });
  EXPECT_NEAR(volume, 1, rounding);
}

TEST(Kernels, Poly6WallFunctionsAreItsIntegrals) {
  for (double q = 0; q < 1; q += 0.0625) {
    const double plane = integrate(q * h, h, [](double r) { return 2 * M_PI * r * poly6(r); });
    const double half = integrate(q * h, h, [&](double r) {  // caps of spheres beyond the plane
      return 2 * M_PI * r * (r - q * h) * poly6(r);
    });
    EXPECT_NEAR(sim::cpu::poly6_plane(float(q)), h * plane, 2 * rounding) << q;
    EXPECT_NEAR(sim::cpu::poly6_halfspace(float(q)), half, rounding) << q;
  }
}

// Along the normal, over the half-space: int_d^h -W' 2 pi r^2 (int_{d/r}^1 mu dmu) dr.
TEST(Kernels, SpikyPlaneIsTheGradientSummedOverTheHalfSpace) {
  for (double q = 0; q < 1; q += 0.0625) {
    const double gradient = integrate(
        q * h, h, [&](double r) { return minus_spiky_slope(r) * M_PI * (r * r - q * q * h * h); });
    EXPECT_NEAR(sim::cpu::spiky_plane(float(q)), h * gradient, 2 * rounding) << q;
  }
}

// By a central difference: its own error is below step^2 / 6 times a third derivative of 200, and
// the rounding of the closed form is divided by the width of 2e-3.
TEST(Kernels, SlopesAreDerivatives) {
  constexpr double step = 1e-3;
  for (double q = 0.05; q < 0.95; q += 0.05) {
    const float up = float(q + step), down = float(q - step);
    const double width = double(up) - down;
    const double of_half =
        (double(sim::cpu::poly6_halfspace(up)) - sim::cpu::poly6_halfspace(down)) / width;
    const double of_plane =
        (double(sim::cpu::spiky_plane(up)) - sim::cpu::spiky_plane(down)) / width;
    EXPECT_NEAR(of_half, -sim::cpu::poly6_plane(float(q)), 3e-4) << q;
    EXPECT_NEAR(of_plane, -sim::cpu::spiky_plane_slope(float(q)), 1e-3) << q;
  }
}

TEST(Kernels, HalfOfTheDensityIsMissingOnAWall) {
  EXPECT_EQ(sim::cpu::poly6_halfspace(0), 0.5f);
  EXPECT_NEAR(sim::cpu::poly6_halfspace(1), 0, rounding);
  EXPECT_NEAR(sim::cpu::poly6_halfspace(7), 0, rounding);
}

TEST(Kernels, WallFunctionsOfALayerMatchTheData) {
  const auto rows = read_validation("wall_functions_plane.csv");
  ASSERT_GT(rows.size(), 20u);
  const size_t q = column(rows[0], "q"), poly = column(rows[0], "poly6_plane"),
               laplacian = column(rows[0], "lap_visc_plane");
  for (size_t k = 1; k < rows.size(); ++k) {
    const float at = std::stof(rows[k][q]);
    EXPECT_NEAR(sim::cpu::poly6_plane(at), std::stod(rows[k][poly]), rounding) << at;
    EXPECT_NEAR(sim::cpu::viscosity_plane(at), std::stod(rows[k][laplacian]), 15 * rounding) << at;
  }
}

// The column is the integral beyond a plane half a spacing nearer than the layer.
TEST(Kernels, WallFunctionOfAHalfSpaceMatchesTheData) {
  const auto rows = read_validation("wall_functions_halfspace.csv");
  int compared = 0;
  for (size_t k = 1; k < rows.size(); ++k) {
    if (rows[k][2] != "poly6") continue;
    const double ratio = std::stod(rows[k][0]), layer = std::stod(rows[k][1]);
    const float q = float(std::max(0.0, layer - 0.5) / ratio);
    EXPECT_NEAR(sim::cpu::poly6_halfspace(q), std::stod(rows[k][3]), rounding) << q;
    ++compared;
  }
  EXPECT_GT(compared, 5);
}

TEST(Kernels, SpikyHalfSpaceIsTheSumOfItsLayers) {
  for (double q = 0; q < 1; q += 0.0625) {
    const double layers =
        integrate(q, 1, [](double s) { return 7.5 * std::pow(1 - s, 4) - 6 * std::pow(1 - s, 5); });
    EXPECT_NEAR(sim::cpu::spiky_halfspace(float(q)), layers, rounding) << q;
  }
  EXPECT_EQ(sim::cpu::spiky_halfspace(0), 0.5f);
}

TEST(Kernels, ViscosityOfAHalfSpaceIsTheSumOfItsLayers) {
  for (double q = 0; q < 1; q += 0.0625) {
    const double layers =
        integrate(q, 1, [](double s) { return 15 * (1 - s) * (1 - s) * (1 + 2 * s); });
    EXPECT_NEAR(sim::cpu::viscosity_halfspace(float(q)), layers, 15 * rounding) << q;
  }
}

// The seed's table is a mean over lattice offsets; 1e-3 of the value at the wall leaves room for
// linear interpolation between 64 samples (at most 3e-4 for poly6, 2e-4 for the Laplacian).
TEST(WallTable, MatchesMeansOverTheLattice) {
  const auto rows = read_validation("wall_functions_plane.csv");
  const size_t q = column(rows[0], "q"), poly = column(rows[0], "poly6_lat_mean"),
               laplacian = column(rows[0], "lap_visc_lat_mean");
  for (double ratio : {2., 3., 4.}) {
    const sim::cpu::WallTable table{sim::build_wall_table(ratio)};
    int compared = 0;
    for (size_t k = 1; k < rows.size(); ++k) {
      if (std::stod(rows[k][0]) != ratio) continue;
      const float at = std::stof(rows[k][q]);
      EXPECT_NEAR(table.density(at), std::stod(rows[k][poly]), 1e-3 * 1.2305) << ratio << ' ' << at;
      EXPECT_NEAR(table.viscosity(at), std::stod(rows[k][laplacian]), 1e-3 * 15)
          << ratio << ' ' << at;
      ++compared;
    }
    EXPECT_GT(compared, 10) << ratio;
  }
}

double wendland(double r) {
  return sim::cpu::WendlandC2::value(std::max(0.0, 1 - r / h)) / (h * h * h);
}

TEST(Kernels, WendlandIntegratesToOneAndItsSlopeIsItsDerivative) {
  const double volume = integrate(0, h, [](double r) { return 4 * M_PI * r * r * wendland(r); });
  EXPECT_NEAR(volume, 1, rounding);
  for (double q = 0.0625; q < 1; q += 0.0625) {
    const double step = 1e-6 * h, r = q * h;
    const double slope = (wendland(r - step) - wendland(r + step)) / (2 * step * r);
    EXPECT_NEAR(sim::cpu::WendlandC2::slope(1 - q), slope * std::pow(h, 5), 1e-6 * 210 / M_PI) << q;
  }
}

// Behind the plane, where q is negative, the half-space has what is left of the whole.
TEST(Kernels, WendlandWallFunctionsAreItsIntegrals) {
  for (double q = 0; q < 1; q += 0.0625) {
    const double plane = integrate(q * h, h, [](double r) { return 2 * M_PI * r * wendland(r); });
    const double half =
        integrate(q * h, h, [&](double r) { return 2 * M_PI * r * (r - q * h) * wendland(r); });
    EXPECT_NEAR(sim::cpu::WendlandC2::plane(float(q)), h * plane, 2 * rounding) << q;
    EXPECT_NEAR(sim::cpu::WendlandC2::plane(float(-q)), h * plane, 2 * rounding) << q;
    EXPECT_NEAR(sim::cpu::WendlandC2::halfspace(float(q)), half, rounding) << q;
    EXPECT_NEAR(sim::cpu::WendlandC2::halfspace(float(-q)), 1 - half, rounding) << q;
  }
}

double viscous(double q) { return std::pow(1 - q, 3); }

// Over the sphere, int w x^2 y^2 dV = 4 pi / 15 int w r^6 dr: 2 is what a Newtonian fluid has.
TEST(Kernels, ViscousWeightHasTheMomentOfANewtonianFluid) {
  const double moment =
      integrate(0, 1, [](double r) { return 4 * M_PI / 15 * viscous(r) * std::pow(r, 6); });
  EXPECT_NEAR(sim::cpu::ViscousWeight::factor * moment, 2, 2 * rounding);
  EXPECT_NEAR(sim::cpu::ViscousWeight::value(0.7), viscous(0.3), rounding);
}

// Beyond the plane at q, by the angle to its normal, c = cos: int over r and c of w times x^2 z or
// z^3, the mean of x^2 about the normal being r^2 (1 - c^2) / 2.
TEST(Kernels, ViscousWallsAreIntegralsOverTheHalfSpace) {
  constexpr double k = 6300 / M_PI;
  for (double q = 0.0625; q < 1; q += 0.0625) {
    const auto beyond = [q](const auto& f) {
      return integrate(q, 1, [&](double r) {
        constexpr int n = 200;
        double sum = 0;
        for (int m = 0; m < n; ++m) {
          const double c = q / r + (1 - q / r) * (m + 0.5) / n;
          sum += f(r, c) * (1 - q / r) / n;
        }
        return 2 * M_PI * r * r * viscous(r) * sum;
      });
    };
    const double along = beyond([](double r, double c) { return r * r * (1 - c * c) / 2 * r * c; });
    const double across = beyond([](double r, double c) { return std::pow(r * c, 3); });
    // Midpoints of 200 angles: a few 1e-5 of the value; rounding of sums of a few thousand.
    EXPECT_NEAR(sim::cpu::ViscousWeight::wall_along(float(q)), k * along / q,
                1e-4 * k * along / q + 1e-4)
        << q;
    EXPECT_NEAR(sim::cpu::ViscousWeight::wall_across(float(q)), k * across / q,
                1e-4 * k * across / q + 3e-4)
        << q;
  }
  EXPECT_EQ(sim::cpu::ViscousWeight::wall_along(1.f), 0.f);
  EXPECT_EQ(sim::cpu::ViscousWeight::wall_across(3.f), 0.f);
}

}  // namespace
}  // namespace drench::sim_tests
