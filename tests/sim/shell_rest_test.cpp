// Shells that come to rest in the simulator, from shot files, against closed forms and converged
// solutions (tests/validation/README.md). That the forces balance in these shapes is tested in
// double by shell_statics_test.cpp; here it is that the steps lead there.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/shell_closed_forms.h"

namespace drench::sim_tests {
namespace {

constexpr SheetMesh every_mesh[] = {SheetMesh::diagonal, SheetMesh::union_jack,
                                    SheetMesh::equilateral, SheetMesh::unstructured};

bool near(double a, double b) { return std::abs(a - b) < 1e-9; }

// Errors at 4, 8, 16 cells, %: diagonal -0.01, 0.00, 0.00; union jack -0.27, -0.05, -0.01;
// equilateral 0.00, -0.02, 0.00; unstructured -0.40, -0.08, -0.01.
TEST(ShellRest, AHangingSheetStretchesAsItsClosedForm) {
  for (const SheetMesh mesh : every_mesh) {
    EXPECT_NEAR(hanging_error(mesh, 4, 0.01), 0, 5e-3) << int(mesh);
    EXPECT_NEAR(hanging_error(mesh, 8, 0.01), 0, 1e-3) << int(mesh);
    EXPECT_NEAR(hanging_error(mesh, 16, 0.01), 0, 3e-4) << int(mesh);
  }
}

// Errors at 12, 24, 48 cells, %: 0.4, 0.1, 0.04; unstructured 0.6, 0.2, 0.05.
TEST(ShellRest, ALimpStripHangsInACatenary) {
  for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::unstructured}) {
    for (const int cells : {12, 24, 48})
      EXPECT_NEAR(catenary_error(mesh, cells), 0, cells < 20 ? 1e-2 : 5e-3)
          << int(mesh) << " " << cells;
  }
}

struct Cantilever {
  double gamma, tolerance;  // w L^3 / D; at 40 cells
};
class HeavyShell : public testing::TestWithParam<Cantilever> {};

// Errors at 10, 20, 40 cells, %, of second order: Gamma = 1: 1.0, 0.25, 0.05; 10: 1.7, 0.4, 0.1;
// 100: 11.0, 2.8, 0.9. Unstructured points: 1.0, 0.25, 0.07; 1.7, 0.4, 0.1; 8.2, 3.0, 0.8.
TEST_P(HeavyShell, CantileverDropsAsTheElastica) {
  const auto [gamma, tolerance] = GetParam();
  for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::unstructured}) {
    const double slenderness = mesh == SheetMesh::unstructured ? 100 : 300;
    double error[3];
    for (int k = 0; k < 3; ++k) error[k] = cantilever_error(mesh, 10 << k, gamma, slenderness);
    EXPECT_LT(std::abs(error[2]), tolerance) << int(mesh);
    EXPECT_GT(std::log2(error[0] / error[2]) / 2, 1.5) << int(mesh);
  }
}

INSTANTIATE_TEST_SUITE_P(Gamma, HeavyShell,
                         testing::Values(Cantilever{1, 0.02}, Cantilever{10, 0.03},
                                         Cantilever{100, 0.05}));

// Errors at 10, 20, 40 cells, %: diagonal 12.0, 2.8, 0.6; union jack 11.6, 2.9, 0.6; unstructured
// 12.8, 2.9, 0.7.
TEST(ShellRest, AClampedPlateSagsAsItsClosedForm) {
  for (const SheetMesh mesh :
       {SheetMesh::diagonal, SheetMesh::union_jack, SheetMesh::unstructured}) {
    double error[3];
    for (int k = 0; k < 3; ++k) error[k] = plate_error(mesh, 10 << k);
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
