// The incompressible solver against an experiment and against statics. The bench has the curves of
// time against error; these are the gates.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/validation/fluid.h"
#include "tests/validation/lobovsky.h"

namespace drench::sim_tests {
namespace {

struct CollapseGate {
  int across;
  double height;
};
class MartinMoyce : public testing::TestWithParam<CollapseGate> {};

// The experiment's own series differ by up to 2.7 %.
// Measured: front 2.0, 2.3, 2.5 %, of the figures 2.5, 2.9, 3.1 %, shift -0.09, -0.19, -0.23,
// slope 1.46, 1.49, 1.51 (experiment 1.33 to T = 3), height 0.035, 0.023, 0.023, energy across the
// plane 0.0016, 0.0006, 0.0002.
TEST_P(MartinMoyce, FrontAndHeightFollowTheExperiment) {
  const validation::Collapse collapse = validation::martin_moyce(GetParam().across, 1e-4);
  EXPECT_LT(collapse.front, 0.035);
  EXPECT_LT(collapse.figures, 0.04);
  EXPECT_LT(collapse.slope, 2);  // Ritter's front, which no friction slows
  EXPECT_LT(collapse.height, GetParam().height);
  EXPECT_LT(collapse.thickness, 0.01);
}

INSTANTIATE_TEST_SUITE_P(Across, MartinMoyce,
                         testing::Values(CollapseGate{10, 0.045}, CollapseGate{20, 0.033},
                                         CollapseGate{40, 0.03}),
                         [](const auto& gate) { return std::to_string(gate.param.across); });

// The first peak is a few particles' and falls by chance: the bench has it. The impulse holds that
// peak: 2 % here, 9 and 13 % at 30 and 40. Measured: time 1.1 %, plateau 3.4 % above the
// frictionless one, energy across the plane 0.019.
TEST(Lobovsky, TheWallIsHitWhenTheExperimentSays) {
  const validation::Impact impact = validation::lobovsky(20, 1e-4);
  EXPECT_LT(std::abs(impact.time), 0.03);
  EXPECT_LT(std::abs(impact.impulse), 0.15);
  EXPECT_LT(std::abs(impact.frictionless), 0.1);
  EXPECT_LT(impact.thickness, 0.05);
}

struct RestGate {
  int layers;
  double pressure, drift, volume;
};
class Resting : public testing::TestWithParam<RestGate> {};

// Measured by the bench after 5 s at 10 and 20 layers: pressure 2.0 and 1.3 %, mean density error
// 2e-5 and 1e-5, drift 5.7e-3 and 1.9e-3, volume -0.51 and -0.40 %. After 3 s the drift at 10
// layers is one of 6.9e-3 to 10.4e-3, as roundings fall (12 tolerances within 3 %, two layouts of
// lists).
TEST_P(Resting, ColumnHasTheLinearPressureAndKeepsItsVolume) {
  const validation::Rest rest = validation::resting_column(GetParam().layers, 3, 3, 1e-5);
  EXPECT_LT(rest.pressure, GetParam().pressure);
  EXPECT_LT(rest.density, 1e-3);
  EXPECT_LT(rest.drift, GetParam().drift);
  EXPECT_GT(rest.volume, GetParam().volume);
  EXPECT_LT(rest.volume, 0);
}

INSTANTIATE_TEST_SUITE_P(Layers, Resting,
                         testing::Values(RestGate{10, 0.03, 11e-3, -6e-3},
                                         RestGate{15, 0.025, 8e-3, -5e-3},
                                         RestGate{20, 0.02, 5e-3, -5e-3}),
                         [](const auto& gate) { return std::to_string(gate.param.layers); });

}  // namespace
}  // namespace drench::sim_tests
