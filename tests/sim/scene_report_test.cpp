// What of a scene comes to nothing, and what it costs, before anything runs.

#include "sim/setup/scene_report.h"

#include <gtest/gtest.h>

#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/said.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

constexpr double a = 0.02;  // m

/// A closed domain of 1 m with a block of 10 x 10 x 10 particles from the origin on.
Shot block_shot() {
  Shot shot = empty_shot();
  shot.timeline = {1001, 1025, 24};
  shot.fluid.spacing = a, shot.fluid.solver = FluidSolver::incompressible;
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(0), {10, 10, 10});
  return shot;
}

Obstacle& add_solid(Shot& shot, const V3d& centre, double size) {
  Obstacle& box = add_obstacle(shot, ObstacleType::box, centre);
  box.name = "solid", box.size = V3d(size);
  return box;
}

FluidEmitter& add_disc(Shot& shot, const V3d& centre) {
  FluidEmitter disc;
  disc.center = centre, disc.radius = 0.06, disc.speed = 1;
  shot.fluid.emitter.push_back(disc);
  return shot.fluid.emitter.back();
}

TEST(SceneReport, CountsWhatSourcesLoseToObstacles) {
  Shot shot = block_shot();
  add_solid(shot, V3d(0, 0.1, 0.1), 0.08);  // two layers of four by four, 3.2 %
  const sim::SceneReport few = sim::build_scene(shot).report;
  ASSERT_EQ(few.source.size(), 1u);
  EXPECT_EQ(few.source[0].name, "fluid.box[0]");
  EXPECT_EQ(few.source[0].asked, 1000u);
  EXPECT_EQ(few.source[0].kept, 968u);
  EXPECT_EQ(few.source[0].in_obstacles(), 32u);
  EXPECT_EQ(few.particles, 968u);
  EXPECT_EQ(sim::warnings_of(few), std::vector<std::string>{});
  shot.obstacle[0].size = V3d(0.16);  // four layers of eight by eight: 2.05 of 8 litres
  const std::vector<std::string> said = warnings(shot);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"fluid.box[0]", "256 particles", "2.05 litres", "26 %", "\"solid\""});
}

TEST(SceneReport, RefusesASourceThatIsAllInAnObstacle) {
  Shot shot = block_shot();
  add_box(shot, V3d(-0.5), {5, 5, 5});
  add_solid(shot, V3d(0.1), 0.3);
  expect_words(refusal(shot), {"all fluid of fluid.box[0]", "1000 particles", "\"solid\""});
  shot.obstacle[0].position = V3d(-0.45);
  expect_words(refusal(shot), {"all fluid of fluid.box[1]"});
  // Half in one, half in another.
  shot.obstacle[0].size = V3d(0.4, 0.4, 0.2), shot.obstacle[0].position = V3d(0.1, 0.1, 0);
  add_solid(shot, V3d(0.1, 0.1, 0.2), 0.4).name = "other";
  expect_words(refusal(shot), {"all fluid of fluid.box[0]", "\"solid\", \"other\""});
}

TEST(SceneReport, RefusesASourceBeyondOpenSides) {
  Shot shot = block_shot();
  shot.domain.axis[0] = Axis::open;
  shot.fluid.box[0].min.x += 2, shot.fluid.box[0].max.x += 2;
  expect_words(refusal(shot), {"all fluid of fluid.box[0]", "open sides"});
  shot.fluid.box[0].min.x -= 1.06, shot.fluid.box[0].max.x -= 1.06;  // seven of ten layers beyond,
  // one of them by less than a spacing, which is not dropped
  const std::vector<std::string> said = warnings(shot);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"600 particles", "60 %", "open sides"});
}

TEST(SceneReport, RefusesAnInletThatCanNeverSend) {
  Shot shot = block_shot();
  shot.domain.min = V3d(-1), shot.domain.max = V3d(1);
  add_disc(shot, V3d(-0.5, 0, 0));
  EXPECT_EQ(warnings(shot), std::vector<std::string>{});
  add_solid(shot, V3d(-0.5, 0, 0), 0.3);
  expect_words(refusal(shot), {"fluid.emitter[0] can never send", "\"solid\"", "0.01 m"});
  // What moves may let it out: that is likely, not certain.
  shot.obstacle[0].position = Animated<V3d>{};
  shot.obstacle[0].position.keys = {{1001, V3d(-0.5, 0, 0)}, {1025, V3d(-0.5, 0.01, 0)}};
  std::vector<std::string> said = warnings(shot);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"fluid.emitter[0] probably sends nothing", "\"solid\""});
  shot.obstacle[0].position.keys[1].second.y = 1;
  said = warnings(shot);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"% of fluid.emitter[0] sends nothing"});
}

TEST(SceneReport, RefusesAnInletFarBeyondAnOpenSide) {
  Shot shot = block_shot();
  shot.domain.axis[1] = Axis::open;
  add_disc(shot, V3d(0.5, 1.2, 0.5));
  expect_words(refusal(shot), {"fluid.emitter[0] can never send", "open sides"});
  shot.fluid.emitter[0].center = V3d(0.5, 1, 0.5);  // on it: what it sends falls in
  EXPECT_EQ(warnings(shot), std::vector<std::string>{});
}

TEST(SceneReport, WarnsOfAnInletThatIsPartlyBlockedOrOutOfTime) {
  Shot shot = block_shot();
  add_disc(shot, V3d(-0.5, 0, 0)).start = 2;  // the shot is 1 s long
  std::vector<std::string> said = warnings(shot);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"fluid.emitter[0] sends nothing", "after the last frame"});
  shot.preroll = 1.5, shot.fluid.emitter[0].start = 2;
  EXPECT_EQ(warnings(shot), std::vector<std::string>{});
  add_solid(shot, V3d(-0.65, 0, 0), 0.3);  // up to the middle of the disc
  said = warnings(shot);
  ASSERT_EQ(said.size(), 1u);
  expect_words(said[0], {"% of fluid.emitter[0] sends nothing", "\"solid\""});
}

// Probes in a solid, on one but given in the world's coordinates, and of one that is not there.
TEST(SceneReport, WarnsOfProbesThatNeverRead) {
  Shot shot = block_shot();
  add_solid(shot, V3d(0.5, 0, 0.5), 0.4);
  Probe probe;
  const auto said = [&](ProbeType type, const V3d& position) {
    probe.type = type, probe.position = position;
    shot.probe = {probe};
    const std::vector<std::string> all = warnings(shot);
    return all.empty() ? std::string() : all.at(0);
  };
  for (const ProbeType type : {ProbeType::velocity, ProbeType::pressure}) {
    expect_words(said(type, V3d(0.5, 0, 0.5)), {"can never read", "\"solid\""});
    EXPECT_EQ(said(type, V3d(0.5, 0.2, 0.5)), "");
  }
  EXPECT_EQ(said(ProbeType::height, V3d(0.5, 0, 0.5)), "");
  shot.obstacle[0].size.y = 10;
  expect_words(said(ProbeType::height, V3d(0.5, 0, 0.5)), {"can never read", "\"solid\""});
  shot.obstacle[0].size.y = 0.4;
  probe.on = "solid";
  expect_words(said(ProbeType::pressure, V3d(0.9, 0.9, 0.9)),
               {"can never read", "own coordinates"});
  EXPECT_EQ(said(ProbeType::pressure, V3d(0.2, 0, 0)), "");
  probe.on.clear(), probe.target = "solid";
  EXPECT_EQ(said(ProbeType::force, V3d(0)), "");
  shot.obstacle[0].position = V3d(3, 0, 0);
  expect_words(said(ProbeType::force, V3d(0)), {"can never read", "beyond the domain"});
}

// Against what the solver allocates, and against the steps of the first frames.
TEST(SceneReport, EstimatesMemoryAndSteps) {
  Shot shot = block_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.box.clear();
  add_box(shot, V3d(-1, -1, -1), {30, 25, 25});
  Stepper run(shot);
  const sim::SceneReport& report = run.scene.report;
  run.step();
  double bytes = 0;
  for (const sim::ColumnMemory& group : run.solver->memory()) bytes += double(group.bytes);
  EXPECT_NEAR(report.memory, bytes, 0.2 * bytes);
  run.advance(0.25);  // six frames
  EXPECT_GT(report.steps_a_frame, 0.4 * run.steps / 6);
  EXPECT_LT(report.steps_a_frame, 2.5 * run.steps / 6);
  add_disc(shot, V3d(0, 0.5, 0));
  EXPECT_NEAR(sim::build_scene(shot).report.particles_at_end,
              18750 + M_PI * 0.06 * 0.06 / (a * a * a), 5);
}

TEST(SceneReport, GuessesCentimetresAndNotAWideGround) {
  Domain domain;
  domain.min = V3d(-0.3, -0.05, -0.3), domain.max = V3d(0.3, 0.6, 0.3);
  expect_words(sim::guess_of_unit(domain, V3d(-8, 0, -8), V3d(8, 24, 8)),
               {"24 m wide in a domain of 0.65 m", "centimetres", "scale = 0.01"});
  expect_words(sim::guess_of_unit(domain, V3d(-60), V3d(60)), {"0.12 km", "centimetres"});
  expect_words(sim::guess_of_unit(domain, V3d(-70), V3d(70)), {"millimetres", "scale = 0.001"});
  EXPECT_EQ(sim::guess_of_unit(domain, V3d(-10, -0.2, -10), V3d(10, 0, 10)), "");
  EXPECT_EQ(sim::guess_of_unit(domain, V3d(-1), V3d(1)), "");
}

}  // namespace
}  // namespace drench::sim_tests
