// Sinks take what comes into them, open sides what leaves, and both count it.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "sim/simulator.h"
#include "tests/sim/obstacle_scenes.h"

namespace drench::sim_tests {
namespace {

Sink& add_sink(Shot& shot, ObstacleType type, const V3d& position) {
  shot.sink.emplace_back().shape.type = type;
  shot.sink.back().shape.position = position;
  return shot.sink.back();
}

/// 1,000 particles at rest without gravity: no step moves them.
Shot block_at_rest(FluidSolver solver) {
  Shot shot = empty_shot();
  shot.fluid.solver = solver;
  add_box(shot, V3d(-0.05), {10, 10, 10});
  return shot;
}

V3d world_of(const Stepper& run, const sim::HostState& state, size_t i) {
  V3d world;
  for (int k = 0; k < 3; ++k) world[k] = run.scene.frame.to_world(k, at(state.position, i)[k]);
  return world;
}

// The exact distances, in double, say who goes; the rest stays to the bit.
TEST(Sink, TakesWhatIsInsideItsShapeAndNothingElse) {
  for (const auto solver : {FluidSolver::incompressible, FluidSolver::weakly_compressible}) {
    for (const auto type : {ObstacleType::plane, ObstacleType::box, ObstacleType::sphere}) {
      Shot shot = block_at_rest(solver);
      Obstacle& shape = add_sink(shot, type, V3d(0.012, -0.007, 0.003)).shape;
      shape.normal = V3d(1, 2, -0.5), shape.size = V3d(0.05, 0.06, 0.04), shape.radius = 0.031;
      shape.rotation_deg = V3d(20, -30, 50);
      Stepper run(shot);
      std::set<int> expected;
      const sim::HostState before = run.solver->save();
      for (size_t i = 0; i < before.id.size(); ++i) {
        if (exact_distance(shape, 1001, world_of(run, before, i)) >= 0)
          expected.insert(before.id[i]);
      }
      run.step(1e-4);
      const sim::HostState after = run.solver->save();
      EXPECT_EQ(std::set<int>(after.id.begin(), after.id.end()), expected) << int(type);
      EXPECT_LT(expected.size(), 950u);
      EXPECT_EQ(after.removed.at(0), 1000 - expected.size());
      EXPECT_EQ(after.removed.at(1), 0u);
    }
  }
}

// Of two sinks in one place the first counts.
TEST(Sink, CountsEveryParticleOnce) {
  Shot shot = block_at_rest(FluidSolver::incompressible);
  shot.fluid.spacing = 0.01;
  add_sink(shot, ObstacleType::box, V3d(-0.5, 0, 0));  // x < 0
  add_sink(shot, ObstacleType::box, V3d(0, -0.5, 0));  // y < 0
  Stepper run(shot);
  run.step(1e-4);
  EXPECT_EQ(run.solver->save().removed, (std::vector<uint64_t>{500, 250, 0}));
  EXPECT_EQ(run.solver->particles(), 250);
}

TEST(Sink, IsThereBetweenStartAndStop) {
  Shot shot = block_at_rest(FluidSolver::incompressible);
  shot.timeline = {1001, 1004, 20};
  shot.preroll = 0.05;
  Sink& sink = add_sink(shot, ObstacleType::sphere, V3d(0.2, 0, 0));
  sink.shape.radius = 0.03;
  sink.shape.position.keys = {{1001, V3d(-0.05, 0, 0)}, {1003, V3d(0.05, 0, 0)}};
  sink.start = 0.1, sink.stop = 0.15;  // frame 1002 to 1003
  Simulator simulator(shot, {});
  EXPECT_EQ(simulator.advance_frame().drained.at(0).second, 0u);
  const StepReport during = simulator.advance_frame();
  EXPECT_GT(during.drained.at(0).second, 50u);
  EXPECT_EQ(during.particles + during.drained[0].second, 1000u);
  const StepReport after = simulator.advance_frame();
  EXPECT_EQ(after.drained.at(0).second, 0u);
  EXPECT_EQ(after.particles, during.particles);
}

// A jet into a sink: what was sent is there or was taken, to the particle, and no id comes twice.
TEST(Sink, AndEmitterKeepTheBooks) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  shot.timeline = {1001, 1020, 30};
  FluidEmitter emitter;
  emitter.radius = 0.03, emitter.speed = 1;
  shot.fluid.emitter.push_back(emitter);
  add_sink(shot, ObstacleType::plane, V3d(0, -0.15, 0));
  Simulator simulator(shot, {});
  std::set<uint32_t> seen, last;
  uint64_t taken = 0;
  uint32_t newest = 0;
  for (int frame = 0; frame < 15; ++frame) {
    taken += simulator.advance_frame().drained.at(0).second;
    const ParticleFrame now = simulator.particles();
    const std::set<uint32_t> ids(now.id.begin(), now.id.end());
    ASSERT_EQ(ids.size(), now.id.size());
    for (const uint32_t id : ids) {
      EXPECT_TRUE(last.contains(id) || id > newest || frame == 0) << "an id was used again";
    }
    newest = *std::max_element(ids.begin(), ids.end());
    seen.insert(ids.begin(), ids.end());
    last = ids;
    EXPECT_EQ(newest + 1, now.id.size() + taken);
  }
  // 0.5 s of the flow less the 0.15 s that are on their way.
  EXPECT_NEAR(double(taken) * 1e-6, M_PI * 9e-4 * 0.35, 0.04 * M_PI * 9e-4 * 0.35);
}

TEST(Sink, MayTakeAllAndLetMoreCome) {
  for (const auto solver : {FluidSolver::incompressible, FluidSolver::weakly_compressible}) {
    Shot shot = block_at_rest(solver);
    shot.timeline = {1001, 1004, 10};
    Sink& sink = add_sink(shot, ObstacleType::box, V3d(0));
    sink.stop = 0.05;
    FluidEmitter late;
    late.speed = 1, late.start = 0.15;
    shot.fluid.emitter.push_back(late);
    Simulator simulator(shot, {});
    EXPECT_EQ(simulator.advance_frame().particles, 0u);
    EXPECT_GT(simulator.advance_frame().particles, 300u);
    const ParticleFrame frame = simulator.particles();
    EXPECT_GE(*std::min_element(frame.id.begin(), frame.id.end()), 1000u);
  }
}

// Fluid that falls out of an open domain is dropped and counted, so that it costs no more.
TEST(OpenSide, LosesWhatLeavesAndCountsIt) {
  for (const auto solver : {FluidSolver::incompressible, FluidSolver::weakly_compressible}) {
    Shot shot = block_at_rest(solver);
    shot.timeline = {1001, 1010, 10};
    shot.fluid.box[0].velocity = V3d(0, -3, 0);
    Simulator simulator(shot, {});
    uint64_t lost = 0;
    size_t left = 1000;
    for (int frame = 0; frame < 5; ++frame) {
      const StepReport report = simulator.advance_frame();
      lost += report.lost, left = report.particles;
      EXPECT_EQ(left + lost, 1000u);
    }
    EXPECT_EQ(left, 0u);  // -1.5 m: 0.5 m below the domain
  }
}

}  // namespace
}  // namespace drench::sim_tests
