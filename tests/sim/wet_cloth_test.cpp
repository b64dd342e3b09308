// Sheets that take up water: weight, softness, friction, how fast they soak and dry, and that
// momentum is kept.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/simulator.h"
#include "tests/sim/same_state.h"
#include "tests/sim/support.h"
#include "tests/temporary_folder.h"

namespace drench::sim_tests {
namespace {

constexpr double g = 9.81;  // m/s^2

/// A shell of 0.2 m over the origin in weightless air, of so much water when full.
Shot sheet_alone(double capacity, double wetness) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  Cloth& sheet = add_sheet(shot, 0.2, 0, 10);
  sheet.model = ClothModel::shell;
  sheet.areal_density = 0.2, sheet.water_capacity = capacity, sheet.wetness = wetness;
  return shot;
}

/// The same on a corner of a pool of 0.2 m a side and 6 cm deep, at its surface.
Shot sheet_on_pool() {
  Shot shot = sheet_alone(0.4, 0);
  shot.gravity = V3d(0, -g, 0);
  shot.domain.min = V3d(-0.1, -0.06, -0.1), shot.domain.max = V3d(0.1, 0.2, 0.1);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  shot.fluid.spacing = 0.01;
  add_box(shot, V3d(-0.1, -0.06, -0.1), {20, 6, 20});
  Cloth& sheet = shot.cloth[0];
  sheet.corner = V3d(-0.05, 0, -0.05), sheet.u.x = sheet.v.z = 0.1;
  sheet.soaks = true, sheet.soak_time = 0.05;
  return shot;
}

double mean(const std::vector<float>& values) {
  double sum = 0;
  for (const float one : values) sum += one;
  return sum / double(values.size());
}

double sheet_mass(const sim::Scene& scene, const sim::HostState& state) {
  double mass = 0;
  for (int v = 0; v < scene.cloth.vertices(); ++v)
    mass += scene.cloth.mass[size_t(v)] + sim::water_at(scene.cloth, state, v);
  return mass;
}

/// N, how far a soft pin of 1 N/m at every vertex of one edge is drawn down, at rest.
double weight_on_soft_pins(double wetness) {
  Shot shot = sheet_alone(0.3, wetness);
  shot.gravity = V3d(0, -g, 0);
  Cloth& sheet = shot.cloth[0];
  sheet.v = V3d(0, -0.2, 0), sheet.damping = 10;
  ClothPin pin;
  for (uint32_t i = 0; i < 11; ++i) pin.vertices.push_back(i);
  pin.stiffness = 1;
  sheet.pin.push_back(pin);
  Stepper run(shot);
  run.advance(3);
  double force = 0;
  for (size_t i = 0; i < 11; ++i) {
    const double now = run.solver->save().cloth_position.y[i];
    force += run.scene.start.cloth_position.y[i] - now;
  }
  return force;
}

// 0.2 kg/m^2 with up to 0.3 kg/m^2 of water on 0.04 m^2.
TEST(WetCloth, HangsByItsOwnWeightAndItsWaters) {
  const double dry = 0.2 * 0.04 * g, full = 0.3 * 0.04 * g;
  EXPECT_NEAR(weight_on_soft_pins(0), dry, 0.005 * dry);
  EXPECT_NEAR(weight_on_soft_pins(0.5), dry + full / 2, 0.005 * dry);
  EXPECT_NEAR(weight_on_soft_pins(1), dry + full, 0.005 * dry);
}

/// m, how far the end of a strip, clamped by two rows, is below them at rest.
double droop(double bend, double wetness, double wet_modulus_ratio) {
  Shot shot = sheet_alone(0, 0);
  shot.gravity = V3d(0, -g, 0);
  Cloth& sheet = shot.cloth[0];
  sheet.water_capacity = 1e-6, sheet.wetness = wetness, sheet.wet_modulus_ratio = wet_modulus_ratio;
  sheet.v.z = 0.04, sheet.cells = V2i(20, 4), sheet.damping = 5;
  sheet.bend_warp = sheet.bend_weft = sheet.bend_bias = bend;
  sheet.poisson = 0;
  ClothPin pin;
  for (uint32_t j = 0; j < 5; ++j)
    pin.vertices.push_back(21 * j), pin.vertices.push_back(21 * j + 1);
  sheet.pin.push_back(pin);
  Stepper run(shot);
  run.advance(2);
  const sim::HostState state = run.solver->save();
  return state.cloth_position.y[0] - state.cloth_position.y[20];
}

TEST(WetCloth, BendsAsASheetOfTheWetRigidity) {
  const double bend = 4e-3, wet = droop(bend, 1, 0.5);
  EXPECT_GT(wet, 1.3 * droop(bend, 0, 1));
  EXPECT_NEAR(wet, droop(bend / 2, 0, 1), 1e-3 * wet);
  EXPECT_NEAR(droop(bend, 0.5, 0.5), droop(0.75 * bend, 0, 1), 1e-3 * wet);
}

// What is curved at rest stays so: all of bending softens alike.
TEST(WetCloth, KeepsItsRestShape) {
  Shot shot = sheet_alone(0.3, 1);
  shot.cloth[0].mesh_file = DRENCH_SOURCE_DIR "/tests/bits/bow.obj";
  shot.cloth[0].wet_modulus_ratio = 0.5;
  Stepper run(shot);
  for (int k = 0; k < 100; ++k) run.step(2e-3);
  const sim::HostState state = run.solver->save();
  for (size_t v = 0; v < state.cloth_position.size(); ++v)
    EXPECT_LT((at(state.cloth_position, v) - at(run.scene.start.cloth_position, v)).length(), 2e-5);
}

/// m, that a small sheet slides in 0.3 s on a large one that is held, tilted by tan = 1/2.
double slides(double friction, double wet_friction, double wetness) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  const double tilt = std::atan(0.5);
  shot.gravity = V3d(g * std::sin(tilt), -g * std::cos(tilt), 0);
  for (const double size : {0.3, 0.06}) {
    Cloth& sheet = add_sheet(shot, size, size < 0.1 ? 1.01e-3 : 0, int(std::lround(size / 0.01)));
    sheet.model = ClothModel::shell, sheet.thickness = 1e-3;
    sheet.friction = friction, sheet.wet_friction = wet_friction, sheet.wetness = wetness;
    sheet.name = size < 0.1 ? "small" : "large";
  }
  ClothPin all;
  for (uint32_t v = 0; v < 31 * 31; ++v) all.vertices.push_back(v);
  shot.cloth[0].pin.push_back(all);
  Stepper run(shot);
  run.advance(0.3);
  const sim::HostState state = run.solver->save();
  double moved = 0;
  for (size_t v = 31 * 31; v < state.cloth_position.size(); ++v)
    moved += state.cloth_position.x[v] - run.scene.start.cloth_position.x[v];
  return moved / double(state.cloth_position.size() - 31 * 31);
}

// Without friction it would go g sin t^2 / 2 = 0.2 m.
TEST(WetCloth, RestsOnASlopeByItsWetFriction) {
  EXPECT_GT(slides(0.3, 0.7, 0), 0.02);
  EXPECT_LT(slides(0.3, 0.7, 1), 0.002);
  EXPECT_LT(slides(0.7, 0.3, 0), 0.002);
  EXPECT_GT(slides(0.7, 0.3, 1), 0.02);
}

TEST(WetCloth, ThatIsDryHasTheBitsOfClothThatNeverIsWet) {
  Shot never = sheet_on_pool();
  never.cloth[0].soaks = false;
  Shot dry = sheet_on_pool();
  dry.cloth[0].corner.y = 0.1, never.cloth[0].corner.y = 0.1;  // falls, and reaches no water
  sim::HostState a = after(dry, 40), b = after(never, 40);
  EXPECT_EQ(mean(a.cloth_wetness), 0);
  EXPECT_TRUE(b.cloth_wetness.empty());
  a.cloth_wetness.clear();
  expect_same_state(a, b);
}

// Under water all along: 1 - exp(-t / 0.05 s), by steps of implicit Euler; dry it stays dry.
TEST(WetCloth, SoaksWhereFluidTouchesIt) {
  Shot shot = sheet_on_pool();
  Stepper run(shot);
  const double steps = 20, dt = 2e-3;
  for (int k = 0; k < steps; ++k) run.step(dt);
  const sim::HostState state = run.solver->save();
  const double expected = 1 - std::pow(1 + dt / 0.05, -steps);
  for (const float w : state.cloth_wetness) EXPECT_NEAR(w, expected, 1e-5);
  EXPECT_NEAR(sheet_mass(run.scene, state), 0.01 * (0.2 + 0.4 * expected), 1e-6);

  shot.cloth[0].corner.y = 0.025;  // 2.5 spacings above the surface
  Stepper above(shot);
  above.step(dt);
  EXPECT_EQ(mean(above.solver->save().cloth_wetness), 0);
}

TEST(WetCloth, AtOnceIsFullAfterAStep) {
  Shot shot = sheet_on_pool();
  shot.cloth[0].soak_time = 0;
  Stepper run(shot);
  run.step(1e-3);
  for (const float w : run.solver->save().cloth_wetness) EXPECT_EQ(w, 1.f);
}

TEST(WetCloth, DriesOnlyWhereATimeIsGiven) {
  Shot shot = sheet_alone(0.3, 1);
  EXPECT_EQ(mean(after(shot, 50, 1e-2).cloth_wetness), 1);
  shot.cloth[0].dry_time = 0.25;
  EXPECT_NEAR(mean(after(shot, 50, 1e-2).cloth_wetness), std::pow(1 + 1e-2 / 0.25, -50), 1e-4);
}

// A sheet that flies through still drops, in weightless air: the water that it takes up, with the
// drops' velocity, is counted as taken from them. Kinetic energy is not gained.
TEST(WetCloth, KeepsMomentumWhenWhatItTakesUpIsTakenFromTheFluid) {
  Shot shot = sheet_alone(0.4, 0);
  shot.fluid.spacing = 0.01;
  shot.cloth[0].soaks = true, shot.cloth[0].soak_time = 0.02;
  shot.cloth[0].velocity = V3d(0, -0.5, 0), shot.cloth[0].damping = 0;
  add_box(shot, V3d(-0.1, -0.035, -0.1), {20, 3, 20});
  Stepper run(shot);
  const double start = -0.5 * 0.2 * 0.04;  // kg m/s
  double taken = 0;                        // kg m/s, at most: fluid moves no faster than the sheet
  for (int k = 0; k < 40; ++k) run.step(1e-3);
  const sim::HostState state = run.solver->save();
  double fluid = 0, sheet = 0, water = 0;
  for (size_t i = 0; i < state.id.size(); ++i)
    fluid += double(run.scene.parameters.particle_mass) * state.velocity.y[i];
  if (state.owed.size() > 0)
    for (const float owed : state.owed.y) fluid -= owed;
  for (int v = 0; v < run.scene.cloth.vertices(); ++v) {
    const double held = sim::water_at(run.scene.cloth, state, v);
    sheet += (run.scene.cloth.mass[size_t(v)] + held) * state.cloth_velocity.y[size_t(v)];
    water += held;
  }
  EXPECT_GT(water, 0.5 * 0.4 * 0.04);
  // What the water had when it was taken up lies between none and the sheet's own speed.
  taken = fluid + sheet - start;
  EXPECT_LE(taken, 1e-6);
  EXPECT_GE(taken, -0.5 * water);
  EXPECT_GE(sheet / (0.2 * 0.04 + water), -0.5);
}

TEST(WetCloth, HasTheSameBitsOnThreadsAndResumed) {
  Shot shot = sheet_on_pool();
  shot.cloth[0].dry_time = 1;
  shot.cloth[0].corner += V3d(0.02, 0.01, 0);
  add_box(shot, V3d(-0.04, 0.03, -0.04), {6, 4, 6});
  expect_same_bits_on_threads(shot, 50);
  expect_same_bits_when_resumed(shot, 50, 0);
  Shot alone = sheet_alone(0.3, 1);
  alone.gravity = V3d(0, -g, 0);
  alone.cloth[0].dry_time = 1;
  alone.cloth[0].pin = {{.vertices = {0, 10}, .box = {}}};
  expect_same_bits_on_threads(alone, 50, 2e-3);
  expect_same_bits_when_resumed(alone, 50, 2e-3);
}

TEST(WetCloth, IsWrittenWithItsWetness) {
  Shot shot = sheet_alone(0.3, 0.25);
  shot.cloth.push_back(shot.cloth[0]);
  shot.cloth[1].name = "dry", shot.cloth[1].wetness = 0, shot.cloth[1].corner.y = 0.1;
  shot.timeline = {1, 10, 60};
  Simulator simulator(shot, {});
  EXPECT_NEAR(simulator.advance_frame().water_in_cloth, 0.25 * 0.3 * 0.04, 1e-8);
  const std::vector<ClothFrame> frames = simulator.cloth();
  EXPECT_EQ(frames[0].mesh.wetness, std::vector<float>(121, 0.25f));
  EXPECT_TRUE(frames[1].mesh.wetness.empty());
}

// A pin that lets go later frees a vertex of the wet mass.
TEST(WetCloth, FallsAsFastAsDryClothWhenAPinLetsGo) {
  Shot shot = sheet_alone(1, 1);
  shot.gravity = V3d(0, -g, 0);
  ClothPin pin;
  for (uint32_t v = 0; v < 121; ++v) pin.vertices.push_back(v);
  pin.release = 0.05;
  shot.cloth[0].pin.push_back(pin), shot.cloth[0].damping = 0;
  Stepper run(shot);
  run.advance(0.15);
  const sim::HostState state = run.solver->save();
  for (const float y : state.cloth_velocity.y) EXPECT_NEAR(y, -0.1 * g, 0.02);
}

}  // namespace
}  // namespace drench::sim_tests
