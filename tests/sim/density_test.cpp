// Density through the whole solver against sums done here in double.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

/// The sum itself, every pair, no grid: kg/m^3 of particle i.
double summed_density(const Stepper& run, const sim::HostState& state, size_t i) {
  const double h = run.scene.parameters.support_radius;
  const double factor = 15 / (M_PI * std::pow(h, 6));  // spiky
  double sum = 0;
  for (size_t j = 0; j < state.id.size(); ++j) {
    const double s = h - (at(state.position, i) - at(state.position, j)).length();
    if (s > 0) sum += factor * s * s * s;
  }
  return sum * run.scene.parameters.particle_mass / run.scene.parameters.lattice_sum;
}

Stepper random_run(int count, double size, double support_ratio, uint64_t seed) {
  Shot shot = empty_shot();
  shot.fluid.support_ratio = support_ratio;
  add_box(shot, V3d(0), {1, 1, 1});
  sim::Scene scene = sim::build_scene(shot);
  sim::HostState& s = scene.start;
  s = {};
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    // Clumps and gaps: cubing one axis leaves rows of cells empty.
    const double x = random() * size, y = std::pow(random(), 3) * size, z = random() * size / 2;
    s.position.push(float(1 + x), float(1 + y), float(1 + z));
    s.velocity.push(0, 0, 0);
    s.id.push_back(i);
  }
  return Stepper(std::move(scene));
}

// A cubic lattice at rest is free of stress: its density is the rest density up to rounding.
TEST(Density, IsRestDensityInsideALattice) {
  for (double ratio : {2.0, 2.5, 3.0}) {
    Shot shot = empty_shot();
    shot.fluid.support_ratio = ratio;
    add_box(shot, V3d(-0.055), {11, 11, 11});
    Stepper run(shot);
    run.solver->refresh();
    const int centre = place_of_id(run.solver->save())[(5 * 11 + 5) * 11 + 5];
    EXPECT_NEAR(run.solver->density()[centre], 1000, 0.02) << ratio;
  }
}

// The kernel integrates to one, so the lattice sum that scales it is one but for the lattice's
// error. The spiky kernel's cusp makes that error fall slowly: 4.7 % at three spacings, 1.5 % at
// four, 0.3 % at six.
TEST(Density, LatticeSumTendsToTheIntegral) {
  Shot shot = empty_shot();
  add_box(shot, V3d(0), {1, 1, 1});
  double before = 1;
  for (const auto& [ratio, error] :
       {std::pair(3., 0.048), std::pair(4., 0.0155), std::pair(6., 0.0031)}) {
    shot.fluid.support_ratio = ratio;
    const double off = std::abs(sim::build_scene(shot).parameters.lattice_sum - 1);
    EXPECT_LT(off, error) << ratio;
    EXPECT_LT(off, before) << ratio;
    before = off;
  }
}

// On a face, an edge, a corner of a block at support 2 a; the oracle is the double sum.
TEST(Density, FallsTowardsAFreeSurface) {
  Shot shot = empty_shot();
  add_box(shot, V3d(0), {9, 9, 9});
  Stepper run(shot);
  run.solver->refresh();
  const sim::HostState state = run.solver->save();
  const std::vector<int> place = place_of_id(state);
  const std::vector<float> density = run.solver->density();
  const double inside = density[place[(4 * 9 + 4) * 9 + 4]], face = density[place[(4 * 9 + 4) * 9]],
               edge = density[place[4 * 9 * 9]], corner = density[place[0]];
  EXPECT_GT(inside, face + 100);
  EXPECT_GT(face, edge + 50);
  EXPECT_GT(edge, corner + 20);
  EXPECT_NEAR(face, summed_density(run, state, place[(4 * 9 + 4) * 9]), 0.01);
  EXPECT_NEAR(corner, summed_density(run, state, place[0]), 0.01);
}

// Rows of 1 to 30 particles, many empty ones: a pack that ran past the end of a row, or a row
// visited twice, would count a neighbour again. A sum of 100 floats is good to 1e-5.
TEST(Density, CountsEveryNeighbourOnce) {
  for (uint64_t seed : {1, 2, 3}) {
    Stepper run = random_run(1500, 0.13, 2 + 0.5 * double(seed % 2), seed);
    run.solver->refresh();
    const sim::HostState state = run.solver->save();
    const std::vector<float> density = run.solver->density();
    ASSERT_EQ(density.size(), 1500u);
    for (size_t i = 0; i < density.size(); ++i) {
      const double expected = summed_density(run, state, i);
      ASSERT_NEAR(density[i], expected, 1e-5 * expected) << "particle " << state.id[i];
    }
  }
}

// Its own kernel is all that one particle sums.
TEST(Density, OfOneParticleIsItsOwnKernel) {
  Stepper run = random_run(1, 0.1, 2, 1);
  run.solver->refresh();
  const double h = 0.02,
               expected = 1e-3 * 15 / (M_PI * h * h * h) / run.scene.parameters.lattice_sum;
  EXPECT_NEAR(run.solver->density().at(0), expected, 1e-5 * expected);
}

TEST(Density, NoParticlesAreNoError) {
  Shot shot = empty_shot();
  FluidEmitter later;
  later.center = V3d(0), later.radius = 0.05, later.speed = 1, later.start = 1;
  shot.fluid.emitter.push_back(later);
  Stepper run(shot);
  run.solver->refresh();
  run.step(1e-3);
  EXPECT_TRUE(run.solver->density().empty());
  EXPECT_EQ(run.limits.max_speed, 0);
}

// A wall stands in for the fluid beyond it: one factor on the half-space integral fits it to a
// lattice that ends half a spacing before a wall. What it cannot fit at once, the two layers at a
// wall and edges, where shares of walls are multiplied, is 0.23 % of the rest density; corners are
// 0.5 % off.
TEST(Density, IsWholeAgainWhereALatticeMeetsWalls) {
  Shot shot = empty_shot();
  shot.domain.min = V3d(0), shot.domain.max = V3d(0.09);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(0), {9, 9, 9});
  Stepper run(shot);
  run.solver->refresh();
  const sim::HostState state = run.solver->save();
  const std::vector<float> density = run.solver->density();
  const auto beside = [](float x) { return x < 0.01f || x > 0.08f; };
  for (size_t i = 0; i < density.size(); ++i) {
    const bool corner =
        beside(state.position.x[i]) && beside(state.position.y[i]) && beside(state.position.z[i]);
    EXPECT_NEAR(density[i], 1000, corner ? 5.5 : 2.6);
  }
}

}  // namespace
}  // namespace drench::sim_tests
