// Probes that ride on obstacles, mean velocities, fronts, and rows by intervals.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/probed.h"

namespace drench::sim_tests {
namespace {

// A block in free flight: its mean velocity is what it started with, its front goes with it.
TEST(VelocityAndFront, OfABlockInFlightAreItsOwn) {
  Probed run(R"(
[shot]
frames = [1, 6]
fps = 50
gravity = [0, 0, 0]
[domain]
min = [-1, -1, -1]
max = [1, 1, 1]
x = "open"
y = "open"
z = "open"
[fluid]
spacing = 0.02
[[fluid.box]]
min = [-0.1, -0.1, -0.1]
max = [0.1, 0.1, 0.1]
velocity = [0.6, -0.8, 0]
[[probe]]
type = "velocity"
name = "inside"
radius = 0.05
[[probe]]
type = "velocity"
name = "outside"
position = [0.5, 0.5, 0.5]
[[probe]]
type = "front"
name = "ahead"
direction = [3, 0, 0]
[[probe]]
type = "front"
name = "down"
direction = [0, -1, 0]
)");
  run.run_to(6);
  const Columns inside = run.columns("inside");
  EXPECT_NEAR(inside.at("velocity x [m/s]").front(), 0.6, 1e-6);
  EXPECT_NEAR(inside.at("velocity y [m/s]").back(), -0.8, 1e-3);
  EXPECT_TRUE(std::isnan(run.columns("outside").at("velocity x [m/s]").back()));
  EXPECT_NEAR(run.columns("ahead").at("front [m]").front(), 0.1, 1e-5);
  EXPECT_NEAR(run.columns("ahead").at("front [m]").back(), 0.1 + 0.6 * 0.1, 2e-3);
  EXPECT_NEAR(run.columns("down").at("front [m]").back(), 0.1 + 0.8 * 0.1, 2e-3);
}

std::string rider_text(double interval) {
  return fmt::format(R"(
[shot]
frames = [1, 21]
fps = 20
[domain]
min = [0, 0, 0]
max = [0.24, 0.3, 0.1]
[fluid]
spacing = 0.01
[[fluid.box]]
min = [0, 0, 0]
max = [0.24, 0.2, 0.1]
[[obstacle]]
type = "box"
name = "plunger"
position = [[1, [0.12, 0.16, 0.05]], [21, [0.12, 0.11, 0.05]]]
rotation_deg = [0, 90, 0]
size = [0.2, 0.06, 0.06]
[[probe]]
type = "pressure"
name = "under"
on = "plunger"
position = [0, -0.03, 0]
normal = [0, -1, 0]
radius = 0.02
interval = {0}
[[probe]]
type = "velocity"
name = "beside"
on = "plunger"
position = [0, -0.045, 0]
radius = 0.02
interval = {0}
)",
                     interval);
}

// A plunger goes down slowly: the disc under it reads rho g times the depth that it has come to,
// and the water there goes down with it.
TEST(RidingProbe, ReadsTheDepthThatItsObstacleTakesItTo) {
  Probed run(rider_text(0));
  run.run_to(21);
  const Columns under = run.columns("under");
  const std::vector<double>&time = under.at("time [s]"), &pressure = under.at("pressure [Pa]");
  const double sunk = 0.05 * (0.9 - 0.2);  // m, between the middles of the means
  double early = 0, late = 0, n_early = 0, n_late = 0;
  for (size_t k = 1; k < time.size(); ++k) {
    if (time[k] > 0.1 && time[k] < 0.3) early += pressure[k], ++n_early;
    if (time[k] > 0.8) late += pressure[k], ++n_late;
  }
  EXPECT_NEAR((late / n_late - early / n_early) / (1000 * 9.81 * sunk), 1, 0.25);
  EXPECT_GT(early / n_early, 300);
  EXPECT_LT(run.mean("beside", "velocity y [m/s]", 0.2), 0);
}

// The same values, fewer rows: the first of every interval; means are over every step.
TEST(ProbeInterval, ThinsOutTheRowsAndNothingElse) {
  Probed every(rider_text(0)), some(rider_text(0.05));
  every.run_to(6), some.run_to(6);
  for (const char* name : {"under", "beside"}) {
    const Columns all = every.columns(name), few = some.columns(name);
    ASSERT_EQ(few.at("time [s]").size(), 6u) << name;
    EXPECT_GT(all.at("time [s]").size(), 10u);
    for (const auto& [column, values] : few) {
      size_t at = 0;
      for (size_t k = 0; k < values.size(); ++k) {
        while (all.at("time [s]").at(at) < few.at("time [s]")[k]) ++at;
        if (std::isnan(values[k]))
          EXPECT_TRUE(std::isnan(all.at(column).at(at))) << name << column << k;
        else
          EXPECT_EQ(values[k], all.at(column).at(at)) << name << column << k;
      }
    }
  }
}

}  // namespace
}  // namespace drench::sim_tests
