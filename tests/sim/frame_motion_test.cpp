// Keyed gravity and a turning frame against closed forms.

#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/contract/shot/gravity.h"
#include "tests/sim/probed.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

constexpr double g = 9.81;

std::string height_text(const std::string& name, double x, double z) {
  return fmt::format("[[probe]]\ntype = \"height\"\nname = \"{}\"\nposition = [{}, 0, {}]\n", name,
                     x, z);
}

// A tank that is pushed sideways ever harder, to a third of g: at rest the surface is across the
// gravity that it feels, tan = a / g.
TEST(KeyedGravity, OfATankPushedSidewaysTiltsTheSurface) {
  const double push = g / 3;
  std::string text = fmt::format(R"(
[shot]
frames = [1, 61]
fps = 20
gravity = [[1, [0, -9.81, 0]], [21, [{}, -9.81, 0]]]
[domain]
min = [0, 0, 0]
max = [0.3, 0.3, 0.06]
[fluid]
spacing = 0.01
kinematic_viscosity = 1e-3
[[fluid.box]]
min = [0, 0, 0]
max = [0.3, 0.12, 0.06]
)",
                                 -push);
  text += height_text("left", 0.06, 0.03) + height_text("right", 0.24, 0.03);
  Probed run(text);
  run.run_to(61);
  const double slope =
      (run.mean("left", "height [m]", 2) - run.mean("right", "height [m]", 2)) / 0.18;
  RecordProperty("figures", fmt::format("slope {:.4f} of {:.4f}", slope, push / g));
  EXPECT_NEAR(slope / (push / g), 1, 0.02);
}

// What is keyed but constant is what is not keyed, to the bit.
TEST(KeyedGravity, ThatDoesNotChangeIsTheSameBits) {
  const auto end_of = [](const char* gravity) {
    Probed run(fmt::format(R"(
[shot]
frames = [1, 5]
gravity = {}
[domain]
min = [0, 0, 0]
max = [0.2, 0.2, 0.1]
[fluid]
spacing = 0.01
[[fluid.box]]
min = [0, 0, 0]
max = [0.1, 0.12, 0.1]
[[probe]]
type = "energy"
)",
                           gravity));
    run.run_to(5);
    return run.csv("probe");
  };
  EXPECT_EQ(end_of("[0, -9.81, 0]"), end_of("[[1, [0, -9.81, 0]], [9, [0, -9.81, 0]]]"));
  EXPECT_NE(end_of("[0, -9.81, 0]"), end_of("[[1, [0, -9.81, 0]], [9, [0, -5, 0]]]"));
}

// A bucket that turns evenly, water in it from the start: z = w^2 r^2 / 2g about the mean. A slab
// of it, since what turns with its walls does not feel their shape. The slope of heights over the
// closed form, of all of it and of what is three tenths of its width about the axis: walls stop
// particles half a spacing before them, which is a share of the steepest water that falls with the
// spacing.
struct Allowed {
  double spacing, slope, place;  // m; shares of the slope and of the rise
};
class Bucket : public testing::TestWithParam<Allowed> {};

TEST_P(Bucket, HasTheParabola) {
  const auto [spacing, allowed, at_a_place] = GetParam();
  constexpr double side = 0.3, rate = 9, fps = 20;  // m, rad/s
  constexpr int last = 51, places = 25;
  std::string text =
      fmt::format(R"(
[shot]
frames = [1, {0}]
fps = {1}
frame_rotation_deg = [[1, 0], [1001, {2}]]
frame_axis = [0, 2, 0]
frame_center = [{3}, 0, 0.03]
[domain]
min = [0, 0, 0]
max = [{4}, 0.3, 0.06]
[fluid]
spacing = {5}
kinematic_viscosity = 1e-2
[[fluid.box]]
min = [0, 0, 0]
max = [{4}, 0.15, 0.06]
)",
                  last, fps, rate * 1000 / fps * 180 / M_PI, side / 2, side, spacing);
  const auto distance = [](int k) { return 0.011 * (k - places / 2); };
  for (int k = 0; k < places; ++k)
    text += height_text(fmt::format("h{}", k), side / 2 + distance(k), 0.03);
  Probed run(text);
  run.run_to(last);
  const auto height = [&](int k) { return run.mean(fmt::format("h{}", k), "height [m]", 1.75); };
  const double rise = rate * rate * distance(0) * distance(0) / (2 * g);
  for (int k = 0; k < places; ++k) {
    const double expected = rate * rate * distance(k) * distance(k) / (2 * g);
    EXPECT_NEAR((height(k) - height(places / 2) - expected) / rise, 0, at_a_place) << distance(k);
  }
  const auto slope = [&](double reach) {
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (int k = 0; k < places; ++k) {
      if (std::abs(distance(k)) > reach) continue;
      const double expected = rate * rate * distance(k) * distance(k) / (2 * g);
      ++n, x += expected, y += height(k), xx += expected * expected, xy += expected * height(k);
    }
    return (n * xy - x * y) / (n * xx - x * x);
  };
  RecordProperty("figures", fmt::format("{:.4f}, middle {:.4f}", slope(1), slope(0.09)));
  EXPECT_NEAR(slope(1), 1, allowed);
  EXPECT_NEAR(slope(0.09), 1, 0.02);
}

INSTANTIATE_TEST_SUITE_P(TurningFrame, Bucket,
                         testing::Values(Allowed{0.015, 0.06, 0.1}, Allowed{0.01, 0.035, 0.06}),
                         [](const auto& p) {
                           return fmt::format("{}Micrometres",
                                              int(std::lround(1e6 * p.param.spacing)));
                         });

// A free particle is at rest in the world: in a frame that begins to turn under it, it runs around
// the axis backwards, at its distance, once a turn.
TEST(TurningFrame, LeavesWhatIsFreeAtRestInTheWorld) {
  Shot shot = empty_shot();
  shot.domain.min = V3d(-1), shot.domain.max = V3d(1);
  shot.timeline = {1, 41, 20};
  shot.preroll = 0.1;  // at rest before the first key
  shot.frame_rotation_deg.keys = {{1, 0}, {41, 360}};
  shot.frame_axis = V3d(0, 0, 3), shot.frame_center = V3d(0.1, 0, 0);
  for (const FluidSolver solver : {FluidSolver::incompressible, FluidSolver::weakly_compressible}) {
    shot.fluid.solver = solver;
    shot.fluid.box.clear();
    add_box(shot, V3d(0.4, 0.1, 0), {1, 1, 1});
    Simulator simulator(shot, {.device = Device::cpu, .level_set = {}});
    simulator.preroll();
    const V3f from = simulator.particles().position.at(0);
    const V3d r = V3d(from) - shot.frame_center;
    for (const int frame : {11, 21, 31, 41}) {
      while (simulator.frame() < frame) simulator.advance_frame();
      const double angle = -2 * M_PI * (frame - 1) / 40;
      const V3d expected =
          shot.frame_center + V3d(r.x * std::cos(angle) - r.y * std::sin(angle),
                                  r.x * std::sin(angle) + r.y * std::cos(angle), r.z);
      EXPECT_LT((V3d(simulator.particles().position.at(0)) - expected).length(), 0.05 * r.length())
          << frame;
    }
  }
}

// Gravity stays the world's: after a quarter turn about z, down is where -x was.
TEST(TurningFrame, TurnsGravityBack) {
  Shot shot;
  shot.frame_rotation_deg.keys = {{1, 0}, {11, 90}};
  shot.frame_axis = V3d(0, 0, 1);
  EXPECT_LT((gravity_at(shot, 1) - V3d(0, -9.81, 0)).length(), 1e-12);
  EXPECT_LT((gravity_at(shot, 11) - V3d(-9.81, 0, 0)).length(), 1e-12);
}

// An axis without direction, and a period that turning breaks, are refused by name.
TEST(TurningFrame, RefusesWhatItCannotTurn) {
  const auto message = [](const std::string& keys) {
    try {
      parse_shot(
          fmt::format("[shot]\nframe_rotation_deg = [[1, 0], [2, 9]]\n{}[fluid]\n"
                      "spacing = 0.1\n[[fluid.box]]\nmin = [0, 0, 0]\nmax = [0.5, 0.5, 0.5]\n",
                      keys),
          "turning.toml");
    } catch (const std::exception& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(message(""), "");
  EXPECT_NE(message("frame_axis = [0, 0, 0]\n").find("frame_axis"), std::string::npos);
  EXPECT_NE(message("[domain]\nx = \"periodic\"\n").find("period"), std::string::npos);
  EXPECT_EQ(message("[domain]\ny = \"periodic\"\n"), "");
}

}  // namespace
}  // namespace drench::sim_tests
