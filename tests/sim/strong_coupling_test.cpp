// The incompressible fluid and sheets: what the sheets answer is inside the pressure solve.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/support.h"
#include "tests/validation/coupled.h"

namespace drench::sim_tests {
namespace {

class PoolOnSheet : public testing::TestWithParam<ClothModel> {};
INSTANTIATE_TEST_SUITE_P(Models, PoolOnSheet,
                         testing::Values(ClothModel::springs, ClothModel::shell));

// Error of the sag against the sheet's own static solution (bench: 15, 20, 30 across).
TEST_P(PoolOnSheet, HangsAsDeepAsTheSheetSays) {
  const validation::PinnedPool pool = validation::pinned_pool(15, 1, 0.2, GetParam());
  ASSERT_GT(pool.static_sag, 0.02);
  EXPECT_NEAR(pool.sag / pool.static_sag, 1, 0.02);
  EXPECT_NEAR(pool.volume, 0, 0.02);
}

class MassRatio : public testing::TestWithParam<double> {};
// rho a / sigma; the published scheme fails from 3, cotton under water of this spacing has 100.
INSTANTIATE_TEST_SUITE_P(Ratios, MassRatio, testing::Values(0.1, 1., 3., 10., 50., 200.));

/// Water that falls 0.1 m onto a pinned sheet in a shaft.
Shot fall_on_sheet(double mass_ratio) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = 0.02;
  shot.domain.min = V3d(-0.16, -0.5, -0.16), shot.domain.max = V3d(0.16, 0.5, 0.16);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(-0.12, 0.1, -0.12), {12, 5, 12});
  Cloth& sheet = add_sheet(shot, 0.32, 0, 16);
  sheet.areal_density = 1000 * 0.02 / mass_ratio;
  sheet.adjacent_stiffness = 6000, sheet.diagonal_stiffness = 3000;
  pin_edges(sheet);
  return shot;
}

TEST_P(MassRatio, NeitherBlowsUpNorLeaks) {
  Stepper run(fall_on_sheet(GetParam()));
  const double fastest = 3 * std::sqrt(2 * 9.81 * 0.2);
  double compression = 0, samples = 0;
  while (run.time < 0.5) {
    run.step();
    ASSERT_LT(run.limits.bad_particle + run.limits.bad_vertex, 0) << run.time;
    ASSERT_LT(run.limits.max_speed, fastest) << run.time;
    if (run.steps % 10 != 0) continue;
    run.solver->refresh();
    for (float rho : run.solver->density()) compression += std::max(rho / 1000. - 1, 0.);
    samples += double(run.solver->particles());
  }
  EXPECT_LT(compression / samples, 1e-3);
  const sim::HostState state = run.solver->save();
  EXPECT_EQ(state.id.size(), run.scene.start.id.size());
  // The sheet sags by less than 0.1 m, and all that was above it is.
  const double pins = run.scene.start.cloth_position.y[0];
  EXPECT_GT(*std::min_element(state.position.y.begin(), state.position.y.end()), pins - 0.1);
  EXPECT_LT(*std::min_element(state.cloth_position.y.begin(), state.cloth_position.y.end()), pins);
}

/// Fluid that starts later than any test ends: sheets take implicit steps by themselves.
Shot before_its_fluid() {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.solver = FluidSolver::incompressible;
  FluidEmitter late;
  late.center = V3d(0.5, 0, 0), late.radius = 0.03, late.speed = 1, late.start = 100,
  late.stop = 101;
  shot.fluid.emitter.push_back(late);
  return shot;
}

// A hanging sheet in a shot whose fluid has not started: the implicit step alone. Elongation
// w L / (2 E h_t) with w = sigma g and E h_t = 8/3 k_diag, narrow enough for Poisson's ratio not to
// matter; damped, so that it stands after 3 s (tests/validation/README.md).
TEST(StrongCoupling, AHangingSheetStretchesByItsWeight) {
  Shot shot = before_its_fluid();
  Cloth& sheet = add_sheet(shot, 0.4, 0, 16);
  sheet.corner = V3d(0, 0, 0), sheet.u = V3d(0.1, 0, 0), sheet.v = V3d(0, -0.4, 0);
  sheet.cells = V2i(4, 16), sheet.areal_density = 2, sheet.damping = 20;
  sheet.adjacent_stiffness = 400, sheet.diagonal_stiffness = 200;
  ClothPin pin;
  for (uint32_t v = 0; v < 5; ++v) pin.vertices.push_back(v);
  sheet.pin.push_back(pin);
  Stepper run(shot);
  while (run.time < 3) run.step(0.01);
  const sim::HostState state = run.solver->save();
  const auto& y = state.cloth_position.y;
  const double length = y[2] - y[16 * 5 + 2];
  EXPECT_NEAR(length / 0.4 - 1, 2 * 9.81 * 0.4 / (2 * 8. / 3 * 200), 2e-4);
}

// Kelvin and Voigt: a mode of frequency omega dies at the rate omega^2 tau / 2, and implicit Euler
// adds omega^2 dt / 2. A hanging strip of two vertices a side is one mode: omega^2 = k / m with the
// masses of the lower row, k of its upright springs.
TEST(StrongCoupling, InnerFrictionDampsAsKelvinAndVoigtSay) {
  Shot shot = before_its_fluid();
  Cloth& sheet = add_sheet(shot, 0.1, 0, 1);
  sheet.corner = V3d(0, 0, 0), sheet.u = V3d(0.1, 0, 0), sheet.v = V3d(0, -0.1, 0);
  sheet.areal_density = 20, sheet.damping = 0, sheet.spring_damping = 0;
  sheet.adjacent_stiffness = 400, sheet.diagonal_stiffness = 0, sheet.retardation_time = 0.01;
  ClothPin pin;
  pin.vertices = {0, 1};
  sheet.pin.push_back(pin);
  Stepper run(shot);
  const double dt = 5e-4, omega2 = 200 / 0.05;  // half a spring, a quarter of 0.2 kg
  const double rest = -0.1 - 9.81 / omega2, pinned = run.scene.start.cloth_position.y[0];
  std::vector<double> turn;  // m, how far from rest the strip turns
  for (double last = 0, before = 0; turn.size() < 3 && run.steps < 2000;) {
    run.step(dt);
    const double y = run.solver->save().cloth_position.y[2] - pinned - rest;
    if (run.steps > 2 && (last - before) * (y - last) < 0) turn.push_back(std::abs(last));
    before = last, last = y;
  }
  ASSERT_EQ(turn.size(), 3u);
  const double rate = omega2 * (0.01 + dt) / 2, omega = std::sqrt(omega2 - rate * rate);
  for (size_t k = 0; k + 1 < turn.size(); ++k)
    EXPECT_NEAR(std::log(turn[k] / turn[k + 1]), rate * M_PI / omega, 0.03 * rate * M_PI / omega);
}

// A sheet that lies on the floor bears its water: held by the floor it answers as the floor does.
TEST(StrongCoupling, ASheetOnTheFloorBearsItsWater) {
  Shot shot = fall_on_sheet(50);
  shot.domain.min.y = 0;
  // Nearer to the walls than half a spacing: nothing flows around it.
  Cloth& sheet = shot.cloth[0];
  sheet.pin.clear();
  sheet.corner = V3d(-0.153, 0.01, -0.153), sheet.u.x = sheet.v.z = 0.306;
  shot.fluid.box.clear();
  add_box(shot, V3d(-0.16, 0.02, -0.16), {16, 6, 16});
  Stepper run(shot);
  run.advance(0.5);
  const sim::HostState state = run.solver->save();
  const auto& y = state.position.y;
  double centre = 0;
  for (float height : y) centre += height / double(y.size());
  const double floor = run.scene.parameters.low[1];
  EXPECT_GT(*std::min_element(y.begin(), y.end()), floor + 0.25 * 0.02);
  EXPECT_NEAR(centre - floor, 0.06 + 0.25 * 0.02, 0.1 * 0.02);
  EXPECT_LT(run.limits.max_speed, 0.3);
}

// What walls hold does not slide on them for ever.
TEST(StrongCoupling, ASheetThatSlidesOnTheFloorComesToRest) {
  Shot shot = fall_on_sheet(50);
  shot.domain.min.y = 0;
  Cloth& sheet = shot.cloth[0];
  sheet.pin.clear();
  sheet.corner = V3d(-0.1, 0.006, -0.1), sheet.u.x = sheet.v.z = 0.2, sheet.cells = V2i(8, 8);
  sheet.velocity = V3d(1, 0, 0), sheet.damping = 0;
  shot.fluid.box.clear();
  add_box(shot, V3d(-0.02, 0.4, -0.02), {2, 2, 2});
  Stepper run(shot);
  run.advance(0.1);
  EXPECT_LT(at(run.solver->save().cloth_velocity, 40).length(), 0.01);
}

// A free edge has no force: drops that fall past it do not feel it.
TEST(StrongCoupling, DropsThatFallPastAFreeEdgeDoNotFeelIt) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.solver = FluidSolver::incompressible;
  const double a = shot.fluid.spacing;
  Cloth& sheet = add_sheet(shot, 0.2, 0, 8);
  sheet.areal_density = 50;
  pin_edges(sheet);
  for (int k = 0; k < 8; ++k) {
    add_box(shot, V3d(0.1 + (0.1 + 0.25 * k) * a - a / 2, 0.05, (4 * k - 16) * a), {1, 1, 1});
  }
  Stepper run(shot);
  std::vector<float> x = run.scene.start.position.x;
  run.advance(0.2);
  const sim::HostState state = run.solver->save();
  const std::vector<int> place = place_of_id(state);
  for (size_t i = 0; i < x.size(); ++i) {
    EXPECT_EQ(state.position.x[place[i]], x[i]);
    EXPECT_EQ(state.velocity.y[place[i]], state.velocity.y[place[0]]);
  }
  EXPECT_NEAR(state.velocity.y[place[0]], -9.81 * 0.2, 1e-4);
}

}  // namespace
}  // namespace drench::sim_tests
