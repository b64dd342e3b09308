// A fluid that fills a closed domain, under gravity.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/probed.h"
#include "tests/sim/same_state.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

/// A tank of 10^3 particles, full to its lid.
Shot tank(double viscosity) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.tolerance = 1e-5, shot.fluid.xsph = 0;
  shot.fluid.kinematic_viscosity = viscosity;
  shot.domain.min = V3d(0), shot.domain.max = V3d(0.1);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(0), {10, 10, 10});
  return shot;
}

double rms_speed(const sim::HostState& state) {
  double sum = 0;
  for (size_t k = 0; k < state.id.size(); ++k) sum += at(state.velocity, k).length2();
  return std::sqrt(sum / double(state.id.size()));
}

/// The same with every particle up to a fifth of a spacing from its place.
sim::Scene shaken(const Shot& shot) {
  sim::Scene scene = sim::build_scene(shot);
  Random random(5);
  const auto shake = [&](std::vector<float>& place) {
    for (float& x : place) x += float(0.4 * shot.fluid.spacing * (random() - 0.5));
  };
  shake(scene.start.position.x), shake(scene.start.position.y), shake(scene.start.position.z);
  return scene;
}

// Gravity between walls is pressure alone. Left to the solve it made 0.2 m/s of this packing within
// 0.05 s and 1 m/s within 0.3 s.
TEST(FullBox, WhateverRestsInASealedTankGoesOnResting) {
  for (const double viscosity : {0., 1e-2}) {
    Stepper run(shaken(tank(viscosity)));
    ASSERT_TRUE(run.scene.parameters.full);
    ASSERT_EQ(run.scene.parameters.no_slip, viscosity > 0);
    run.advance(0.3);
    EXPECT_EQ(rms_speed(run.solver->save()), 0) << viscosity;
  }
}

TEST(FullBox, GravityBetweenWallsChangesNoBitOfAFlow) {
  const auto stirred = [](double gravity) {
    Shot shot = tank(1e-4);
    shot.gravity = V3d(0, -gravity, 0);
    sim::Scene scene = shaken(shot);
    for (size_t k = 0; k < scene.start.id.size(); ++k) {
      const V3d x = at(scene.start.position, k);  // about the tank's middle, as the frame is
      scene.start.velocity.x[k] = float(5 * x.y), scene.start.velocity.y[k] = float(-5 * x.x);
    }
    Stepper run(scene);
    for (int k = 0; k < 20; ++k) run.step(2e-3);
    return run.solver->save();
  };
  const sim::HostState pulled = stirred(9.81), floating = stirred(0);
  expect_same_state(pulled, floating);
  EXPECT_GT(rms_speed(pulled), 0.05);
}

// Of the two solves of a step the first leaves more here.
TEST(FullBox, EitherSolveCutShortIsTold) {
  sim::Scene scene = sim::build_scene(tank(0));
  Random random(5);
  for (std::vector<float>* v :
       {&scene.start.velocity.x, &scene.start.velocity.y, &scene.start.velocity.z}) {
    for (float& u : *v) u = float(random() - 0.5);
  }
  scene.parameters.most_iterations = 1, scene.parameters.tolerance = 6e-3f;
  Stepper run(scene);
  run.step(1e-3);
  EXPECT_GT(run.limits.residual, scene.parameters.tolerance);
  EXPECT_EQ(run.limits.iterations, 1);
  EXPECT_GT(run.limits.pressure, 0);  // of the first, too
}

/// Two axes periodic or none, a shaft of 12 x 12 spacings that is full to its lid.
std::string shaft_text(const std::string& sides) {
  return fmt::format(R"(
[shot]
frames = [1, 11]
fps = 20
[domain]
min = [0, 0, 0]
max = [0.12, 0.2, 0.12]
x = "{0}"
z = "{0}"
[fluid]
spacing = 0.01
tolerance = 1e-5
[[fluid.box]]
min = [0, 0, 0]
max = [0.12, 0.2, 0.12]
[[probe]]
type = "pressure"
name = "floor"
position = [0.06, 0, 0.06]
radius = 0.06
[[probe]]
type = "pressure"
name = "lid"
position = [0.06, 0.2, 0.06]
normal = [0, -1, 0]
radius = 0.06
[[probe]]
type = "pressure"
name = "inside"
position = [0.06, 0.05, 0.06]
normal = [1, 1, 0]
radius = 0.03
[[probe]]
type = "force"
name = "down"
[[probe]]
type = "force"
name = "up"
target = "y_high"
)",
                     sides);
}

// p = rho g (H / 2 - y), since nothing gives the mean of a sealed tank; its walls bear the weight.
TEST(FullBox, ProbesHaveThePressureThatGravityMakes) {
  for (const char* sides : {"walls", "periodic"}) {
    Probed run{shaft_text(sides)};
    run.run_to(11);
    const double whole = 1000 * 9.81 * 0.2, weight = whole * 0.12 * 0.12;
    EXPECT_NEAR(run.mean("floor", "pressure [Pa]", 0.1) / whole, 0.5, 0.02) << sides;
    EXPECT_NEAR(run.mean("lid", "pressure [Pa]", 0.1) / whole, -0.5, 0.02) << sides;
    EXPECT_NEAR(run.mean("inside", "pressure [Pa]", 0.1) / whole, 0.25, 0.02) << sides;
    EXPECT_NEAR(run.mean("down", "force y [N]", 0.1) / weight, -0.5, 0.01) << sides;
    EXPECT_NEAR(run.mean("up", "force y [N]", 0.1) / weight, -0.5, 0.01) << sides;
  }
}

}  // namespace
}  // namespace drench::sim_tests
