// Inlets on and in solids, at walls, in sinks, and out of time.

#include <gtest/gtest.h>

#include <cmath>

#include "sim/simulator.h"
#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/said.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

constexpr double a = 0.02;  // m

/// A closed domain of 1 m without gravity and a disc of radius 5 a; nothing else.
Shot disc_shot(const V3d& centre, const V3d& direction, double speed) {
  Shot shot = empty_shot();
  shot.timeline = {1, 4, 24};
  shot.fluid.spacing = a, shot.fluid.solver = FluidSolver::incompressible;
  shot.domain.min = V3d(-0.5), shot.domain.max = V3d(0.5);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  FluidEmitter disc;
  disc.center = centre, disc.direction = direction, disc.radius = 5 * a, disc.speed = speed;
  shot.fluid.emitter.push_back(disc);
  return shot;
}

Obstacle& add_block(Shot& shot, const V3d& centre, const V3d& size) {
  Obstacle& block = add_obstacle(shot, ObstacleType::box, centre);
  block.size = size, block.name = "block";
  return block;
}

struct Ran {
  uint64_t emitted = 0;
  double max_speed = 0;  // m/s
};
Ran run(const Shot& shot) {
  Ran ran;
  Simulator simulator(shot, {.device = Device::cpu});
  for (int k = 0; k < 3; ++k) {
    const StepReport report = simulator.advance_frame();
    ran.emitted += report.emitted, ran.max_speed = std::max(ran.max_speed, report.max_speed);
  }
  return ran;
}

// A nozzle flush on a block, half a spacing in it and before it, and in the middle of a plate: area
// times speed times time of fluid leaves it, less what of a layer is under way.
TEST(Inlet, OnASolidSendsWhatItShould) {
  for (const double off : {-0.5, 0., 0.2, 0.4, 0.5}) {
    for (const double speed : {0.5, 2.}) {
      Shot shot = disc_shot(V3d(off * a, 0, 0), V3d(1, 0, 0), speed);
      add_block(shot, V3d(-0.1, 0, 0), V3d(0.2, 0.4, 0.4));
      EXPECT_EQ(warnings(shot), std::vector<std::string>{}) << off;
      const double layer = 79;  // pi 25, rounded up
      const double expected = M_PI * 25 * a * a * speed * (3. / 24) / (a * a * a);
      EXPECT_NEAR(double(run(shot).emitted), expected, layer) << off << " " << speed;
    }
  }
  Shot plate = disc_shot(V3d(0), V3d(1, 0, 0), 1);
  add_block(plate, V3d(0), V3d(0.4 * a, 0.4, 0.4));
  EXPECT_GT(run(plate).emitted, 300u);
  plate.obstacle[0].size.x = 4 * a;  // a spacing and a half do not lead out
  expect_words(refusal(plate), {"can never send", "\"block\""});
}

// What of a disc lies beyond a wall sends nothing, and nothing is thrown; a warning names the wall.
TEST(Inlet, ThatReachesThroughAWallSendsTheRest) {
  const Shot whole = disc_shot(V3d(0, 0.2, 0), V3d(0, -1, 0), 1),
             half = disc_shot(V3d(-0.5, 0.2, 0), V3d(0, -1, 0), 1);
  EXPECT_EQ(warnings(whole), std::vector<std::string>{});
  const std::vector<std::string> said = warnings(half);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"% of fluid.emitter[0] sends nothing", "domain's walls"});
  const Ran all = run(whole), some = run(half);
  EXPECT_NEAR(double(some.emitted) / double(all.emitted), 0.44, 0.03);  // 35 of 79 places
  EXPECT_LT(all.max_speed, 1.5);
  EXPECT_LT(some.max_speed, 1.5);
  // On the wall and away from it, all of it sends.
  EXPECT_EQ(warnings(disc_shot(V3d(-0.5, 0, 0), V3d(1, 0, 0), 1)), std::vector<std::string>{});
}

// The first layer leaves half an interval after the start.
TEST(Inlet, WhoseFirstLayerComesTooLateIsSaid) {
  Shot shot = disc_shot(V3d(0), V3d(0, -1, 0), 1);
  shot.fluid.emitter[0].stop = 0.4 * a;  // s; a layer takes a / speed
  expect_words(refusal(shot), {"never any fluid", "fluid.emitter[0]"});
  shot.fluid.emitter[0].stop = 0.6 * a;
  EXPECT_EQ(refusal(shot), "");
  EXPECT_GT(run(shot).emitted, 70u);
  shot.timeline.last = shot.timeline.first;  // a still
  expect_words(refusal(shot), {"never any fluid"});
  add_box(shot, V3d(-0.4), {4, 4, 4});
  const std::vector<std::string> said = warnings(shot);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"fluid.emitter[0] sends nothing", "first layer"});
}

TEST(Sinks, ThatTakeAllOrNothingAreSaid) {
  Shot shot = disc_shot(V3d(0), V3d(0, -1, 0), 1);
  Sink sink;
  sink.shape.type = ObstacleType::box, sink.shape.size = V3d(0.5), sink.shape.name = "drain";
  shot.sink.push_back(sink);
  expect_words(refusal(shot), {"fluid.emitter[0] can never send", "in a sink"});
  shot.fluid.emitter[0].center = V3d(0.41, 0, 0);  // its rim is behind a wall, the rest in the sink
  shot.sink[0].shape.size = V3d(2);
  expect_words(refusal(shot), {"in a sink"});
  shot.sink[0].shape.size = V3d(0.5);
  shot.fluid.emitter.clear();
  add_box(shot, V3d(-0.1), {10, 10, 10});
  std::vector<std::string> said = warnings(shot);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"fluid.box[0] loses 1000 particles", "in a sink"});
  shot.sink[0].shape.size = V3d(0.18);  // all but one layer of each side
  said = warnings(shot);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"fluid.box[0] loses 512 particles", "in a sink"});
  shot.sink[0].start = 0.01;
  EXPECT_EQ(warnings(shot), std::vector<std::string>{});
  shot.sink[0].start = 1;
  said = warnings(shot);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"\"drain\" takes nothing", "after the last frame"});
  shot.sink[0].start = 0, shot.sink[0].shape.position = V3d(2, 0, 0);
  said = warnings(shot);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"\"drain\" takes nothing", "beyond the domain"});
}

}  // namespace
}  // namespace drench::sim_tests
