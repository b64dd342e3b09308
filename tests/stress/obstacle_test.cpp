// Obstacles that are fast, thin or sharp, and periodic axes, which obstacles and sheets in a
// weakly compressible fluid refuse.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/shot_file.h"
#include "tests/sim/obstacle_scenes.h"
#include "tests/stress/report.h"
#include "tests/stress/scenes.h"

namespace drench::stress_tests {
namespace {

/// A tank of 16 x 10 x 16 spacings of water, open above.
Shot tank() {
  const double a = 0.02;
  Shot shot = water(a);
  shot.domain.min = V3d(0), shot.domain.max = V3d(16 * a, 60 * a, 16 * a);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(0), {16, 10, 16});
  return shot;
}

class MovingBody : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Speeds, MovingBody, testing::Values(1., 10., 50., 100.));

// Energy and speeds are those of the body: it does work. No particle may be in it.
TEST_P(MovingBody, ThroughAPoolTakesNothingIn) {
  const double a = 0.02, speed = GetParam();
  Shot shot = tank();
  add_sphere(shot, V3d(0), 3 * a);
  const double seconds = 16 * a / speed, frames = seconds * shot.timeline.fps;
  const V3d from(8 * a, 16 * a, 8 * a), to(8 * a, 0, 8 * a);
  shot.obstacle[0].position.keys = {{1001, from}, {1001 + frames, to}};
  Watch watch(shot);
  int inside = 0;
  while (watch.run.time < 1.5 * seconds && watch.step(watch.run.next_dt()))
    inside += particles_inside(shot, watch.run);
  EXPECT_EQ(inside, 0);
  Gates gates = squeezed();
  gates.energy = gates.speed = no_rule;  // the ball's doing
  report("moving obstacle", fmt::format("ball at {} m/s", speed), watch, gates,
         fmt::format("{} particles inside; {:.1f} m/s", inside, watch.figures().max_speed));
}

class Plate : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Thickness, Plate, testing::Values(0.05, 0.2, 0.5, 1.),
                         [](const auto& p) { return std::to_string(int(100 * p.param)); });

TEST_P(Plate, ThatIsThinIsTight) {
  for (const double speed : {10., 100.}) {
    const double a = 0.02;
    Shot shot = water(a);
    shot.gravity = V3d(0);
    add_box(shot, V3d(-4 * a, 2 * a, -4 * a), {8, 8, 8}, V3d(0, -speed, 0));
    Obstacle& plate = add_obstacle(shot, ObstacleType::box, V3d(0));
    plate.size = V3d(60 * a, GetParam() * a, 60 * a);
    Watch watch(shot);
    watch.until(20 * a / speed);
    int behind = 0;
    for (const float y : watch.state().position.y) behind += y < 1;
    EXPECT_EQ(behind, 0);
    Gates gates;
    gates.drift = no_rule;  // the plate has it
    gates.speed = 1.6;      // as the rim of any impact
    report("thin plate", fmt::format("{} spacings, {} m/s", GetParam(), speed), watch, gates,
           fmt::format("{} behind it", behind));
  }
}

// Water falls into the edge between two planes that meet at `degrees`, and into a corner of walls.
class Corner : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Degrees, Corner, testing::Values(20., 60., 90., 150.));
TEST_P(Corner, TakesWaterAndKeepsIt) {
  const double a = 0.02, half = 0.5 * GetParam() * M_PI / 180;
  Shot shot = tank();
  shot.fluid.box.clear();
  const double above = 4 * a / std::tan(half);  // where two planes are eight spacings apart
  add_box(shot, V3d(6 * a, above + 4 * a, 0), {4, 8, 16});
  shot.domain.max.y = above + 40 * a;
  add_plane(shot, V3d(8 * a, 0, 0), V3d(std::cos(half), std::sin(half), 0));
  add_plane(shot, V3d(8 * a, 0, 0), V3d(-std::cos(half), std::sin(half), 0));
  Watch watch(shot);
  int inside = 0;
  while (watch.run.time < 0.8 && watch.step(watch.run.next_dt())) {
    if (watch.figures().steps % 5 == 0) inside += particles_inside(shot, watch.run);
  }
  EXPECT_EQ(inside, 0);
  report("corner", fmt::format("{} deg", GetParam()), watch, {},
         fmt::format("{} inside, {:.2f} m/s at the end", inside, watch.last_speed()));
}

// A block that goes around a periodic domain again and again, over all seams at once.
class Seam : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Speeds, Seam, testing::Values(1., 100.));
TEST_P(Seam, IsNotFeltByWhatPasses) {
  const double a = 0.02, speed = GetParam();
  Shot shot = water(a);
  shot.gravity = V3d(0);
  shot.domain.min = V3d(0), shot.domain.max = V3d(14 * a);
  shot.domain.axis = {Axis::periodic, Axis::periodic, Axis::periodic};
  add_box(shot, V3d(-3 * a, 2 * a, 3 * a), {8, 8, 8}, V3d(1, 0.7, -0.3) * speed);
  Watch watch(shot, 0);
  watch.until(5 * 14 * a / speed);
  Gates gates;
  report("periodic", fmt::format("block at {} m/s, five times around", speed), watch, gates);
}

TEST(Unsupported, SeamsWithClothAndMoreAreRefused) {
  const std::string shot =
      "[domain]\nx = \"periodic\"\nmin = [-1, -1, -1]\nmax = [1, 1, 1]\n[[fluid.box]]\n"
      "min = [-0.05, 0.1, -0.05]\nmax = [0.05, 0.2, 0.05]\n[[cloth]]\ncorner = [-0.1, 0, -0.1]\n"
      "u = [0.2, 0, 0]\nv = [0, 0, 0.2]\ncells = [4, 4]\n";
  const std::string weak = "[fluid]\nsolver = \"weakly_compressible\"\n" + shot;
  const std::string said = test::error_of([&] { parse_shot(weak, "both.toml"); });
  report("unsupported", "cloth, a periodic axis and a weakly compressible fluid",
         said.find("seam") != std::string::npos, said.substr(0, 90));
}

}  // namespace
}  // namespace drench::stress_tests
