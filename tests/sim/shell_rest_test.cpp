// Shells that come to rest in the simulator, from shot files, against closed forms and converged
// solutions (tests/validation/README.md). That the forces balance in these shapes is tested in
// double by shell_statics_test.cpp; here it is that the steps lead there.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/sim/shell_run.h"

namespace drench::sim_tests {
namespace {

constexpr SheetMesh every_mesh[] = {SheetMesh::diagonal, SheetMesh::union_jack,
                                    SheetMesh::equilateral, SheetMesh::unstructured};

bool near(double a, double b) { return std::abs(a - b) < 1e-9; }

/// u/L of a sheet that hangs by its edge, load = w L / (E h): the tension w (L - s) is
/// E h lambda (lambda^2 - 1) / 2.
double hanging_elongation(double load) {
  const int n = 1000;
  double sum = 0;
  for (int k = 0; k < n; ++k) {
    const double pull = load * (k + 0.5) / n;
    double stretch = 1;
    for (int i = 0; i < 20; ++i)
      stretch -= (stretch * (stretch * stretch - 1) / 2 - pull) / ((3 * stretch * stretch - 1) / 2);
    sum += (stretch - 1) / n;
  }
  return sum;
}

double hung(SheetMesh mesh, int cells, double load) {
  const double length = 0.5;
  ShellSheet sheet;
  sheet.mesh = mesh, sheet.size = {length, 0.25, cells};
  sheet.along = V3d(0, -1, 0), sheet.across = V3d(1, 0, 0);
  sheet.young = sheet.weight() * length / load, sheet.bend = 1e-6;
  sheet.damping = 40;
  sheet.held = [](V3d x) { return near(x.x, 0); };
  ShellRun run(sheet);
  run.advance(0.7);
  return -run.mean([&](V3d x) { return near(x.x, length); }).y / length - 1;
}

// Errors at 4, 8, 16 cells, %: diagonal -0.01, 0.00, 0.00; union jack -0.27, -0.05, -0.01;
// equilateral 0.00, -0.02, 0.00; unstructured -0.40, -0.08, -0.01.
TEST(ShellRest, AHangingSheetStretchesAsItsClosedForm) {
  const double load = 0.01, exact = hanging_elongation(load);
  for (const SheetMesh mesh : every_mesh) {
    EXPECT_NEAR(hung(mesh, 4, load) / exact, 1, 5e-3) << int(mesh);
    EXPECT_NEAR(hung(mesh, 8, load) / exact, 1, 1e-3) << int(mesh);
    EXPECT_NEAR(hung(mesh, 16, load) / exact, 1, 3e-4) << int(mesh);
  }
}

/// Sag over span of a limp strip, E h = 1e4 w L, that falls from two straight halves.
double strip_sag(SheetMesh mesh, int cells, double arc) {
  const double span = 0.5, length = arc * span;
  ShellSheet sheet;
  sheet.mesh = mesh, sheet.size = {length, 0.1 * span, cells};
  sheet.young = 1e4 * sheet.weight() * span, sheet.bend = 1e-6 * sheet.weight() * std::pow(span, 3);
  sheet.damping = 20;
  sheet.held = [=](V3d x) { return near(x.x, 0) || near(x.x, length); };
  ShellRun run(sheet);
  std::vector<V3d> x = run.places();
  for (size_t v = 0; v < run.size(); ++v) {
    const double s = run.flat(v).x / length;
    x[v].x = s * span, x[v].y = -std::min(s, 1 - s) * std::sqrt(arc * arc - 1) * span;
  }
  run.start_from(x, std::vector<V3d>(run.size(), V3d(0)));
  run.advance(1);
  double lowest = 0;
  for (const V3d& p : run.places()) lowest = std::min(lowest, p.y);
  return -lowest / span;
}

// Errors at 12, 24, 48 cells, %: 0.4, 0.1, 0.04; unstructured 0.6, 0.2, 0.05.
TEST(ShellRest, ALimpStripHangsInACatenary) {
  double exact = 0;
  for (const auto& row : read_validation("catenary.csv"))
    if (row[0] == "1.2") exact = std::stod(row[2]);
  ASSERT_GT(exact, 0);
  for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::unstructured}) {
    for (const int cells : {12, 24, 48}) {
      const double found = strip_sag(mesh, cells, 1.2);
      EXPECT_NEAR(found / exact, 1, cells < 20 ? 1e-2 : 5e-3) << int(mesh) << " " << cells;
    }
  }
}

/// Drop over span of a cantilever under its own weight, `slenderness` thicknesses long, that is let
/// go where it is straight.
double drop_over_span(SheetMesh mesh, int cells, double gamma, double slenderness) {
  const double length = 0.2;
  ShellSheet sheet;
  sheet.mesh = mesh, sheet.size = {length, 0.1 * length, cells, 1};
  sheet.bend = sheet.weight() * std::pow(length, 3) / gamma;
  sheet.young = 12 * sheet.bend * std::pow(slenderness / length, 2);
  // rad/s, about: of bending, and of hanging as a pendulum
  const double slowest = (3.5 / std::sqrt(gamma) + 0.5) * std::sqrt(shell_gravity / length);
  sheet.damping = 1.5 * slowest;
  sheet.held = [](V3d x) { return x.x < 1e-9; };
  ShellRun run(sheet);
  run.advance(12 / slowest);
  const V3d tip = run.mean([&](V3d x) { return near(x.x, length); });
  return -tip.y / tip.x;
}

struct Cantilever {
  double gamma, tolerance;  // w L^3 / D; at 40 cells
};
class HeavyShell : public testing::TestWithParam<Cantilever> {};

// Errors at 10, 20, 40 cells, %, of second order: Gamma = 1: 1.0, 0.25, 0.05; 10: 1.7, 0.4, 0.1;
// 100: 11.0, 2.8, 0.9. Unstructured points: 1.0, 0.25, 0.07; 1.7, 0.4, 0.1; 8.2, 3.0, 0.8.
TEST_P(HeavyShell, CantileverDropsAsTheElastica) {
  const auto [gamma, tolerance] = GetParam();
  double exact = 0;
  for (const auto& row : read_validation("cantilever_heavy_elastica.csv"))
    if (row[0] == std::to_string(int(gamma))) exact = std::stod(row[3]);
  ASSERT_GT(exact, 0);
  for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::unstructured}) {
    const double slenderness = mesh == SheetMesh::unstructured ? 100 : 300;
    double error[3];
    for (int k = 0; k < 3; ++k)
      error[k] = drop_over_span(mesh, 10 << k, gamma, slenderness) / exact - 1;
    EXPECT_LT(std::abs(error[2]), tolerance) << int(mesh);
    EXPECT_GT(std::log2(error[0] / error[2]) / 2, 1.5) << int(mesh);
  }
}

INSTANTIATE_TEST_SUITE_P(Gamma, HeavyShell,
                         testing::Values(Cantilever{1, 0.02}, Cantilever{10, 0.03},
                                         Cantilever{100, 0.05}));

/// Deflection of the middle of a square, clamped all around by two rings of held vertices, over
/// 0.00126532 w a^4 / D (nu = 0.3; Timoshenko and Woinowsky-Krieger). It is a twentieth of the
/// thickness: linear.
double plate_deflection(SheetMesh mesh, int cells) {
  const double edge = 0.4, ring = edge / cells, all = edge + 2 * ring, deflection = 1e-3,
               thickness = 0.02, nu = 0.3;
  ShellSheet sheet;
  sheet.mesh = mesh, sheet.size = {all, all, cells + 2}, sheet.size.still = 1;
  sheet.bend = 0.00126532 * sheet.weight() * std::pow(edge, 4) / deflection;
  sheet.young = 12 * (1 - nu * nu) * sheet.bend / (thickness * thickness), sheet.poisson = nu;
  sheet.damping = 150;
  sheet.held = [=](V3d x) { return std::min({x.x, x.y, all - x.x, all - x.y}) < ring + 1e-9; };
  ShellRun run(sheet);
  run.advance(0.15);
  double most = 0;
  for (const V3d& x : run.places()) most = std::max(most, -x.y);
  return most / deflection;
}

// Errors at 10, 20, 40 cells, %: diagonal 12.0, 2.8, 0.6; union jack 11.6, 2.9, 0.6; unstructured
// 12.8, 2.9, 0.7.
TEST(ShellRest, AClampedPlateSagsAsItsClosedForm) {
  for (const SheetMesh mesh :
       {SheetMesh::diagonal, SheetMesh::union_jack, SheetMesh::unstructured}) {
    double error[3];
    for (int k = 0; k < 3; ++k) error[k] = plate_deflection(mesh, 10 << k) - 1;
    EXPECT_LT(std::abs(error[2]), 0.01) << int(mesh);
    EXPECT_GT(std::log2(error[0] / error[2]) / 2, 1.5) << int(mesh);
  }
}

// What moves a sheet at rest is rounding. With a tolerance relative to that it would take 245
// sweeps a step.
TEST(ShellRest, ASheetAtRestIsLeftAlone) {
  ShellSheet sheet;
  sheet.size = {0.4, 0.4, 40}, sheet.along = V3d(0.6, -0.8, 0);
  sheet.young = 12000, sheet.bend = 1e-5, sheet.damping_time = 5e-3;
  sheet.gravity = V3d(0);
  sheet.held = [](V3d x) { return near(x.x, 0); };
  ShellRun run(sheet);
  int sweeps = 0;
  for (int k = 0; k < 20; ++k) {
    run.step(2.5e-3);
    sweeps += run.limits.sheet_sweeps;
    EXPECT_EQ(run.limits.sheets_cut_short, 0);
  }
  EXPECT_LT(sweeps / 20, 60);
  for (const V3d& u : run.velocities()) EXPECT_LT(u.length(), 1e-5);
}

}  // namespace
}  // namespace drench::sim_tests
