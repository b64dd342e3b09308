// Fluid that does not slip along obstacles and sheets: closed forms, what goes to whom, same bits.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/passes/viscosity/body_drag.h"
#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/same_state.h"
#include "tests/validation/body_drag.h"

namespace drench::sim_tests {
namespace {

using validation::Floor;

class Across : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(BodyDrag, Across, testing::Values(6, 12, 24));
class Film : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(BodyDrag, Film, testing::Values(6, 12));

// Measured at 6, 12 and 24 across: 5.6, 4.3 and 1.7 %; the return flow 0.28, 0.28 and 0.31 for 1/3.
TEST_P(Across, ASlidingPlaneDrivesATrough) {
  const validation::Dragged trough = validation::lid_driven(GetParam());
  EXPECT_LT(trough.error, GetParam() == 24 ? 0.03 : 0.07);
  EXPECT_NEAR(trough.scale, 1. / 3, GetParam() == 24 ? 0.03 : 0.06);
  EXPECT_LT(trough.thickness, 0.01);
}

// Measured at 6, 12 and 24 layers: mean speed 0.944, 0.958 and 0.976 on a plane, the same on a box,
// 0.943, 0.962 and 0.974 on a sheet; L2 4.6, 3.7 and 3.2 %; the books of momentum within 2e-6. 24
// layers take 20 s: they are a case of the bench, fluid_body_drag.
TEST_P(Film, RunsDownAPlaneAsNusseltSays) {
  for (const Floor floor : {Floor::plane, Floor::box, Floor::sheet}) {
    const validation::Dragged film = validation::film(floor, GetParam());
    EXPECT_NEAR(film.scale, 1, GetParam() == 6 ? 0.06 : 0.045);
    EXPECT_LT(film.error, GetParam() == 6 ? 0.05 : 0.04);
    EXPECT_LT(film.thickness, 0.01);
    if (floor != Floor::sheet) {
      EXPECT_NEAR(film.force, 1, 1e-5);
    }
  }
}

// In a shear flow at a quarter of its height, after 0.6 H^2 / nu. A spacing is half and a quarter
// of the fluid's speed there. Measured: 0.98 to 1.00, and 0.95 to 1.03.
TEST(TowedSheet, GoesWithTheFluidAtAnyMass) {
  for (const double mass : {0.01, 1.}) {
    EXPECT_NEAR(validation::towed_sheet(8, mass).error, 1, 0.05) << mass;
    EXPECT_NEAR(validation::towed_sheet(16, mass).error, 1, 0.07) << mass;
  }
}

// Grid quadrature of the rates that a ball of 3 spacings would brake with if fluid within it went
// on by its depth as beyond a plane. Measured: along 5 to 13 % too much, across 4 to 8 % too
// little; a plane of the same distance would be 70 to 110 % and 17 to 32 % too much.
TEST(BodyDrag, OfABallIsItsShareOfAPlanes) {
  const double h = 2.15, R = 3;  // spacings
  sim::cpu::BodyDrag law{};
  law.walls.inverse_h = float(1 / h), law.support_radius = float(h);
  sim::cpu::ObstacleView ball{};
  ball.shape = sim::ObstacleShape::sphere, ball.half[0] = float(R);
  for (const double d : {0.3, 0.5, 1.}) {
    double plane[2] = {}, round[2] = {};
    constexpr int n = 60;
    for (int k = 0; k < n * n * n; ++k) {
      const V3d x = V3d(k % n + 0.5, k / n % n + 0.5, k / n / n + 0.5) * (2 * h / n) - V3d(h);
      const double r = x.length() / h, w = std::pow(std::max(0., 1 - r), 3);
      const double depth = -x.z - d, in = R - (x + V3d(0, 0, d + R)).length();
      for (int c = 0; c < 2; ++c) {
        const double weight = w * (c == 0 ? x.x * x.x : x.z * x.z);
        plane[c] += depth > 0 ? weight * (1 + depth / d) : 0;
        round[c] += in > 0 ? weight * (1 + in / d) : 0;
      }
    }
    const double filled = law.filled(ball, {0.f, 0.f, float(R + d)}, float(d));
    EXPECT_NEAR(filled * filled / (round[0] / plane[0]), 1, 0.15) << d;
    EXPECT_NEAR(filled / (round[1] / plane[1]), 1, 0.1) << d;
  }
}

Shot honey() {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.kinematic_viscosity = 1e-2;
  return shot;
}
/// With that of the springs, each of which stands in two rows. J
double energy_of(const sim::Scene& scene, const sim::HostState& state) {
  double sum = 0;
  for (size_t i = 0; i < state.id.size(); ++i)
    sum += 0.5 * scene.parameters.particle_mass * at(state.velocity, i).length2();
  for (size_t v = 0; v < state.cloth_velocity.size(); ++v)
    sum += 0.5 * scene.cloth.mass[v] * at(state.cloth_velocity, v).length2();
  const sim::ClothTopology& t = scene.cloth;
  for (int v = 0; v < t.vertices(); ++v) {
    for (int s = t.spring_start[v]; s < t.spring_start[v + 1]; ++s) {
      const V3d way = at(state.cloth_position, t.spring_end[s]) - at(state.cloth_position, v);
      sum += 0.25 * t.stiffness[s] * std::pow(way.length() - t.rest_length[s], 2);
    }
  }
  return sum;
}

/// A block of honey slides along a free sheet of `mass` layers of particles, and into it a little.
Shot slider(double mass) {
  Shot shot = honey();
  add_box(shot, V3d(-0.04, 0.0005, -0.04), {8, 8, 8}, V3d(0.5, -0.02, 0));
  Cloth& sheet = add_sheet(shot, 0.24, 0, 24);
  sheet.damping = 0, sheet.areal_density = mass * 10;
  return shot;
}

// Sheets from a hundredth of a layer's mass to a hundred layers: what the honey loses they have
// got, nothing is gained, and the lightest goes with the honey.
TEST(BodyDrag, OfASheetKeepsMomentumAndGainsNoEnergy) {
  for (const double mass : {0.01, 1., 100.}) {
    Stepper run(slider(mass));
    const V3d before = total_momentum(run.scene, run.scene.start);
    double energy = energy_of(run.scene, run.scene.start), sheet = 0, worst = 0;
    for (int k = 0; k < 60; ++k) {
      run.step(1e-3);
      const sim::HostState state = run.solver->save();
      const double now = energy_of(run.scene, state);
      EXPECT_LT(now, energy * (1 + 1e-5)) << mass << " " << k;
      energy = now;
      worst = std::max(worst, (total_momentum(run.scene, state) - before).length() /
                                  momentum_scale(run.scene, state, 0.3));
      sheet = 0;
      for (size_t v = 0; v < state.cloth_velocity.size(); ++v)
        sheet += state.cloth_velocity.x[v] * run.scene.cloth.mass[v];
    }
    EXPECT_LT(worst, 1e-5) << mass;
    EXPECT_GT(sheet, 0.1 * std::min(before.x, 0.03 * mass)) << mass;
  }
}

// A block that slides along a plate: the plate gets what it loses. A plate that slides takes it
// along. Of the relative speed a layer of this height keeps 8 / pi^2 exp(-pi^2 nu t / 4 H^2) =
// 0.375; 0.353 measured, of a block that is as wide as high.
TEST(BodyDrag, OfAnObstacleIsItsImpulse) {
  for (const bool plate_moves : {false, true}) {
    Shot shot = honey();
    shot.gravity = V3d(0, -2, 0);
    add_box(shot, V3d(-0.04, 0, -0.04), {8, 8, 8}, plate_moves ? V3d(0) : V3d(0.5, 0, 0));
    Obstacle& plate = add_obstacle(shot, ObstacleType::box, V3d(0, -0.02, 0));
    plate.size = V3d(0.8, 0.04, 0.8);
    const double frames = 10;
    if (plate_moves)
      plate.position.keys = {{1001, V3d(0, -0.02, 0)},
                             {1001 + frames, V3d(0.5 * frames / 24, -0.02, 0)}};
    Stepper run(shot);
    const double before = total_momentum(run.scene, run.scene.start).x;
    double impulse = 0;
    for (int k = 0; k < 200; ++k) {
      run.step(1e-3);
      impulse += run.solver->obstacle_impulses()[0].impulse[0];
    }
    const double after = total_momentum(run.scene, run.solver->save()).x;
    const double scale = run.scene.parameters.particle_mass * run.solver->particles() * 0.5;
    EXPECT_NEAR((before - after - impulse) / scale, 0, 1e-5);
    const double left = plate_moves ? 1 - after / scale : after / scale;
    EXPECT_NEAR(left, 0.375, 0.03);
  }
}

TEST(BodyDrag, HoldsWhereItCanBeSeenToHold) {
  const auto held = [](double viscosity, Slip slip) {
    Shot shot = slider(1);
    add_sphere(shot, V3d(0.5), 0.1);
    shot.fluid.kinematic_viscosity = viscosity;
    shot.obstacle[0].slip = shot.cloth[0].slip = slip;
    const sim::Parameters p = sim::build_scene(shot).parameters;
    EXPECT_EQ(p.no_slip_obstacles, p.no_slip_sheets);
    return p.no_slip_sheets;
  };
  EXPECT_TRUE(held(1e-2, Slip::automatic));
  EXPECT_FALSE(held(1e-6, Slip::automatic));  // 1 mm of water against 10 mm
  EXPECT_TRUE(held(1e-6, Slip::none));
  EXPECT_FALSE(held(1e-2, Slip::free));
  EXPECT_FALSE(held(0, Slip::none));
}

Shot slider_on_ball() {
  Shot shot = slider(0.1);
  shot.gravity = V3d(0, -9.81, 0);
  add_sphere(shot, V3d(0, -0.103, 0), 0.1);
  return shot;
}

TEST(BodyDrag, AnyNumberOfThreadsGivesTheSameBits) {
  expect_same_bits_on_threads(slider_on_ball(), 30, 1e-3);
}

TEST(BodyDrag, ASavedStateGoesOnWithTheSameBits) {
  expect_same_bits_when_resumed(slider_on_ball(), 40, 1e-3);
}

}  // namespace
}  // namespace drench::sim_tests
