// Shells of any constants: moduli, rigidities, weights, cells and steps.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/stress/exact_crossing.h"
#include "tests/stress/shell_scenes.h"
#include "tests/stress/shell_watch.h"

namespace drench::stress_tests {
namespace {

/// What turns far in a step that is too long is stretched: energy and distance stand in the rows
/// (docs/stress.md). Nothing crosses or is thrown.
constexpr ShellGates impact{.energy = not_gated, .nearest = 0};
/// What 1e6 N/m or sixteen times the step throw: nothing crosses.
constexpr ShellGates beyond{.speed = not_gated, .energy = not_gated, .nearest = 0};

double seconds() { return long_form() ? 2 : 0.5; }

class ShellModulus : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Moduli, ShellModulus, testing::Values(1., 1e1, 1e2, 1e3, 1e4, 1e5, 1e6));

TEST_P(ShellModulus, NeitherBlowsUpNorCrosses) {
  Shot shot = fall_on_ball();
  set_moduli(shot.cloth[0], GetParam(), 1.5e-5);
  ShellWatch watch(shot);
  watch.until(seconds());
  report("shell's modulus", fmt::format("{:g} N/m", GetParam()), watch,
         GetParam() < 1e6 ? ShellGates{} : beyond);
}

class ShellRigidity : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Rigidities, ShellRigidity,
                         testing::Values(1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2));

TEST_P(ShellRigidity, NeitherBlowsUpNorCrosses) {
  Shot shot = fall_on_ball();
  set_moduli(shot.cloth[0], 1e4, GetParam());
  ShellWatch watch(shot);
  watch.until(seconds());
  report("shell's rigidity", fmt::format("{:g} N m", GetParam()), watch, {});
}

class ShellWeight : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Weights, ShellWeight, testing::Values(0.02, 0.2, 2., 10., 50.));

TEST_P(ShellWeight, NeitherBlowsUpNorCrosses) {
  Shot shot = fall_on_ball();
  shot.cloth[0].areal_density = GetParam();
  ShellWatch watch(shot);
  watch.until(seconds());
  report("shell's weight", fmt::format("{:g} kg/m^2", GetParam()), watch, {});
}

class ShellStep : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Steps, ShellStep, testing::Values(0.25, 0.5, 1., 2., 4., 8., 16.));

TEST_P(ShellStep, NeitherBlowsUpNorCrosses) {
  ShellWatch watch(fall_on_ball(), {.step = GetParam()});
  watch.until(seconds());
  report("shell's step", fmt::format("solver at {:g}x", GetParam()), watch,
         GetParam() < 2    ? ShellGates{}
         : GetParam() < 16 ? impact
                           : beyond);
}

/// Ends of cells, of which two in the middle of either direction are a needle's width apart.
std::vector<double> lines_with_needles(int cells, double width) {
  std::vector<double> line;
  for (int k = 0; k <= cells; ++k) line.push_back(double(k) / cells);
  line.insert(line.begin() + cells / 2 + 1, 0.5 + width / cells);
  return line;
}

TEST(ShellNeedles, NeitherBlowUpNorCross) {
  const test::TemporaryFolder folder;
  for (const double width : {1e-1, 1e-2, 1e-4}) {
    Shot shot = fall_on_ball();
    const Cloth like = shot.cloth[0];
    shot.cloth.clear();
    Cloth& sheet = add_mesh(shot, square_mesh(0.4, 0.05, lines_with_needles(20, width)), folder);
    sheet.pin.clear(), sheet.model = ClothModel::shell, sheet.weld = 0;
    sheet.areal_density = like.areal_density, sheet.thickness = like.thickness;
    ShellWatch watch(shot);
    watch.until(seconds());
    ShellGates gates = impact;
    gates.energy = ShellGates{}.energy;
    // Single precision does not resolve how stiff the finest are; the solver tells.
    if (width < 1e-3) gates.speed = gates.energy = not_gated, gates.blow_ups = 1;
    report("shell's cells", fmt::format("needles, 1:{:g}", 1 / width), watch, gates);
  }
}

}  // namespace
}  // namespace drench::stress_tests
