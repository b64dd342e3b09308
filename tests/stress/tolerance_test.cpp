// Tolerances of the pressure solve up to the loosest that a shot may ask for.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/stress/report.h"
#include "tests/stress/scenes.h"

namespace drench::stress_tests {
namespace {

class Tolerance : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Percent, Tolerance, testing::Values(0.01, 0.1, 1., 10.));

// A cube of water collapses and hits the walls. A tolerance is a mean, which hardly knows of the
// few particles that an impact crushes: they may not throw the rest. Taken with the pressures of
// the last step wherever the mean was met, 1 % gained 41 % energy and 10 % ended in a blow-up.
TEST_P(Tolerance, ThatIsLooseLeavesTheFluidBounded) {
  Shot shot = water(0.05);
  shot.fluid.tolerance = GetParam() / 100;
  shot.domain.min = V3d(0), shot.domain.max = V3d(3, 2, 1);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(0), {20, 20, 20});
  Watch watch(shot);
  while (watch.run.time < 0.5 && watch.figures().steps < 300 && watch.step()) {
  }
  Gates gates;
  if (GetParam() > 0.01) gates.mean = 4e-3, gates.p999 = 0.06;
  EXPECT_GE(watch.run.time, 0.5);
  report("tolerance", fmt::format("{} %, a collapsing cube", GetParam()), watch, gates);
}

}  // namespace
}  // namespace drench::stress_tests
