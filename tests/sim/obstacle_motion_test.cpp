// Obstacles in violent and moving flows: nothing leaks, room is made, bits stay.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/same_state.h"

namespace drench::sim_tests {
namespace {

/// A block of 16 x 12 x 16 particles that falls into a tank, 3,000 in all.
Shot fall() {
  Shot shot = tank_shot(1);
  const double a = shot.fluid.spacing;
  shot.fluid.box.clear();
  shot.domain.max = V3d(20 * a, 60 * a, 20 * a);
  add_box(shot, V3d(2 * a, 14 * a, 2 * a), {16, 12, 16}, V3d(0, -2, 0));
  return shot;
}

/// Steps with particles counted inside, in double and outside the solver.
int leaks(const Shot& shot, int steps) {
  Stepper run(shot);
  int inside = 0;
  for (int k = 0; k < steps; ++k) {
    run.step();
    if (k % 5 == 0) inside += particles_inside(shot, run);
  }
  EXPECT_EQ(run.solver->particles(), int(run.scene.start.id.size()));
  return inside;
}

TEST(ObstacleLeaks, NoneIntoASphere) {
  Shot shot = fall();
  const double a = shot.fluid.spacing;
  add_sphere(shot, V3d(10 * a, 6 * a, 9.5 * a), 4 * a);
  EXPECT_EQ(leaks(shot, 1200), 0);
}

TEST(ObstacleLeaks, NoneIntoTheEdgesAndCornersOfABox) {
  Shot shot = fall();
  const double a = shot.fluid.spacing;
  Obstacle& box = add_obstacle(shot, ObstacleType::box, V3d(10 * a, 7 * a, 10 * a));
  box.size = V3d(6 * a), box.rotation_deg = V3d(45, 35.26, 0);  // a corner up
  EXPECT_EQ(leaks(shot, 1200), 0);
}

// A funnel of two tilted planes and a thin sharp lid on it: concave where they meet.
TEST(ObstacleLeaks, NoneIntoAFunnelWithALid) {
  Shot shot = fall();
  const double a = shot.fluid.spacing;
  add_plane(shot, V3d(10 * a, 2 * a, 0), V3d(1, 1, 0));
  add_plane(shot, V3d(10 * a, 2 * a, 0), V3d(-1, 1, 0));
  Obstacle& lid = add_obstacle(shot, ObstacleType::box, V3d(10 * a, 8 * a, 10 * a));
  lid.size = V3d(8 * a, 0.5 * a, 20 * a), lid.rotation_deg = V3d(0, 0, 10);
  EXPECT_EQ(leaks(shot, 1200), 0);
}

// Two turns a second and to and fro: 1.6 m/s at the tips.
TEST(ObstacleLeaks, NoneIntoAMovingPaddle) {
  Shot shot = fall();
  const double a = shot.fluid.spacing;
  Obstacle& paddle = add_obstacle(shot, ObstacleType::box, V3d(0));
  paddle.size = V3d(12 * a, 10 * a, 1.5 * a);
  paddle.position.keys.clear(), paddle.rotation_deg.keys.clear();
  for (int k = 0; k < 20; ++k) {
    paddle.position.keys.push_back({1001 + 6. * k, V3d((10 + 2 * (k % 2)) * a, 8 * a, 10 * a)});
  }
  paddle.rotation_deg.keys = {{1001, V3d(0)}, {1121, V3d(0, 3600, 0)}};
  EXPECT_EQ(leaks(shot, 1200), 0);
}

/// Particles that are shot at a plate of `thickness` spacings, which passes `behind` it.
int behind_plate(double thickness, double speed, double plate_speed, double dt) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  const double a = shot.fluid.spacing;
  add_box(shot, V3d(-4 * a, -4 * a, 6 * a), {8, 8, 8}, V3d(0, 0, -speed));
  Obstacle& plate = add_obstacle(shot, ObstacleType::box, V3d(0));
  // Wider than what an impact at 5 spacings a step throws aside gets in the time.
  plate.size = V3d(200 * a, 200 * a, thickness * a);
  const double end = 1001 + shot.timeline.fps;  // a second
  plate.position.keys = {{1001, V3d(0)}, {end, V3d(0, 0, plate_speed)}};
  Stepper run(shot);
  int behind = 0;
  const double until = 30 * a / (speed + plate_speed);
  while (run.time < until) dt > 0 ? run.step(dt) : run.step();
  const sim::HostState state = run.solver->save();
  const double plate_at = plate_speed * run.time;
  for (size_t i = 0; i < state.id.size(); ++i)
    behind += run.scene.frame.to_world(2, state.position.z[i]) < plate_at;
  return behind;
}

// At the solver's own steps, and at steps in which they pass twenty plates.
TEST(ObstacleLeaks, NoneThroughAThinPlateAtAHundredMetresASecond) {
  EXPECT_EQ(behind_plate(0.5, 100, 0, 0), 0);
  EXPECT_EQ(behind_plate(0.05, 100, 0, 0), 0);
  EXPECT_EQ(behind_plate(0.5, 100, 0, 1e-3), 0);    // 10 spacings a step
  EXPECT_EQ(behind_plate(0.5, 50, 50, 5e-4), 0);    // both move
  EXPECT_EQ(behind_plate(0.5, 1e-3, 20, 2e-3), 0);  // the plate passes them: 4 spacings a step
}

// A piston across a tank lifts all the water before it: what it sweeps, the surface rises.
class Piston : public testing::TestWithParam<int> {};
TEST_P(Piston, DisplacesTheVolumeThatItSweeps) {
  const int depth = GetParam();
  Shot shot = tank_shot(depth);
  const double length = 0.24, a = shot.fluid.spacing = 0.12 / depth;
  shot.fluid.box.clear();
  const int across = 2 * depth;
  shot.domain.max = V3d(across * a, 0.48, 8 * a);
  add_box(shot, V3d(0), {across, depth, 8});
  Obstacle& piston = add_obstacle(shot, ObstacleType::box, V3d(0));
  piston.size = V3d(length, 1.2, 16 * a);
  const V3d out(-length / 2, 0.24, 4 * a), in(-length / 2 + length / 4, 0.24, 4 * a);
  piston.position.keys = {{1001, out}, {1025, in}};
  piston.position.interpolation = Interpolation::smooth;
  Stepper run(shot);
  const double before = centre_of_mass(run.solver->save()).y;
  run.advance(2.0);
  const sim::HostState state = run.solver->save();
  EXPECT_EQ(particles_inside(shot, run), 0);
  // Three quarters of the floor are left: as deep as 4/3 before, and the centre half as high.
  const double rise = centre_of_mass(state).y / before;
  RecordProperty("rise", std::to_string(rise));
  EXPECT_NEAR(rise, 4. / 3, 0.04);
}
INSTANTIATE_TEST_SUITE_P(Depth, Piston, testing::Values(8, 12, 16),
                         [](const auto& p) { return std::to_string(p.param); });

// A body that comes to rest in still water: its surface's speed is part of the step's limit.
TEST(ObstacleMotion, LimitsTheStepToFourTenthsOfASpacing) {
  Shot shot = fall();
  Obstacle& ball = add_obstacle(shot, ObstacleType::sphere, V3d(0));
  ball.radius = 0.05;
  ball.position.keys = {{1001, V3d(0)}, {1002, V3d(0)}, {1003, V3d(1, 0, 0)}};
  ball.rotation_deg.keys = {{1001, V3d(0)}};
  Stepper run(shot);
  const double frame = 1 / shot.timeline.fps, a = shot.fluid.spacing;
  EXPECT_DOUBLE_EQ(run.scene.obstacles.limit(0, 0.5 * frame), 0.5 * frame);
  EXPECT_NEAR(run.scene.obstacles.limit(1.5 * frame, frame), 0.4 * a * frame, 1e-3 * a * frame);
  // A step that would reach into the motion ends where the motion has done 0.4 spacings.
  const double dt = run.scene.obstacles.limit(0.99 * frame, frame);
  EXPECT_LE(0.99 + dt / frame, 1 + 0.4 * a);
  EXPECT_GT(dt, 0.005 * frame);
  EXPECT_NEAR(run.scene.obstacles.fastest(), 1 / frame, 0.01 / frame);
}

Shot stirred() {
  Shot shot = fall();
  const double a = shot.fluid.spacing;
  Obstacle& paddle = add_obstacle(shot, ObstacleType::box, V3d(10 * a, 6 * a, 10 * a));
  paddle.size = V3d(12 * a, 8 * a, 2 * a);
  paddle.rotation_deg.keys = {{1001, V3d(0)}, {1121, V3d(0, 3600, 0)}};
  add_sphere(shot, V3d(4 * a, 4 * a, 4 * a), 3 * a);
  return shot;
}

TEST(ObstacleMotion, HasTheSameBitsForAnyNumberOfThreadsAndGoesOn) {
  expect_same_bits_on_threads(stirred(), 60, 2e-3);
  expect_same_bits_when_resumed(stirred(), 60, 2e-3);
}

TEST(ObstacleMotion, FarAwayChangesNoBit) {
  Shot plain = fall(), with = fall();
  add_sphere(with, V3d(3, 0, 0), 0.2);
  Stepper a(plain), b(with);
  for (int k = 0; k < 60; ++k) a.step(2e-3), b.step(2e-3);
  a.solver->refresh(), b.solver->refresh();
  expect_same_state(a.solver->save(), b.solver->save());
  EXPECT_EQ(a.solver->density(), b.solver->density());
}

TEST(ObstacleMotion, WithoutObstaclesThereIsNoPassOfThem) {
  const auto around = [](const Shot& shot) {
    const std::vector<sim::PassInfo> plan = Stepper(shot).solver->plan();
    return std::count_if(plan.begin(), plan.end(), [](const sim::PassInfo& p) {
      return p.name.find("obstacles") != std::string::npos;
    });
  };
  EXPECT_EQ(around(fall()), 0);
  EXPECT_EQ(around(stirred()), 2);
  EXPECT_EQ(Stepper(fall()).solver->plan().size(), Stepper(stirred()).solver->plan().size());
}

TEST(ObstacleSources, LoseWhatStartsInsideOrTooNear) {
  Shot shot = tank_shot(8);
  const double a = shot.fluid.spacing;
  Obstacle& box = add_obstacle(shot, ObstacleType::box, V3d(4 * a, 4 * a, 4 * a));
  box.size = V3d(4 * a);
  const Stepper run(shot);  // 4 x 4 x 4 of the lattice lie in it, the next layer half a spacing off
  EXPECT_EQ(run.scene.inside_obstacles, 64u);
  EXPECT_EQ(run.scene.start.id.size(), 8u * 8 * 8 - 64);
}

}  // namespace
}  // namespace drench::sim_tests
