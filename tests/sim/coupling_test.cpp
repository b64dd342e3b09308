// What the exact coupling mends in the published scheme.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

/// Largest kinetic energy of fluid and cloth, J, while a block of 1.536 kg falls 0.05 m onto a
/// pinned sheet of light cotton and lies on it; infinite if the solver itself finds a speed absurd.
double largest_energy(CouplingScheme scheme) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.coupling.scheme = scheme;
  shot.domain.min = V3d(-0.15, -1, -0.15), shot.domain.max = V3d(0.15, 1, 0.15);
  shot.domain.axis = {Axis::walls, Axis::open, Axis::walls};  // nothing runs off the sheet
  add_box(shot, V3d(-0.08, 0.05, -0.08), {16, 6, 16});
  pin_edges(add_sheet(shot, 0.3, 0, 30));
  Stepper run(shot);
  double largest = 0;
  for (int step = 0; run.time < 0.6; ++step) {
    run.step();
    if (run.limits.bad_particle >= 0 || run.limits.bad_vertex >= 0) return INFINITY;
    if (step % 10 != 0) continue;
    const sim::HostState state = run.solver->save();
    double energy = 0;
    for (size_t i = 0; i < state.id.size(); ++i) {
      energy += 0.5 * run.scene.parameters.particle_mass * at(state.velocity, i).length2();
    }
    for (size_t i = 0; i < state.cloth_velocity.size(); ++i) {
      energy += 0.5 * run.scene.cloth.mass[i] * at(state.cloth_velocity, i).length2();
    }
    largest = std::max(largest, energy);
  }
  return largest;
}

// No more than gravity can give: the block's centre is 0.08 m above the sheet and sinks no more
// than the 0.1 m that a sheet of this stiffness sags under it.
constexpr double energy_of_fall = 1.536 * 9.81 * 0.18;  // J

TEST(Coupling, WaterOnLightCottonIsStable) {
  EXPECT_LT(largest_energy(CouplingScheme::exact), energy_of_fall);
}

// The reason for the mended scheme: with the mass of a particle fifty times that of a vertex the
// published one diverges.
TEST(Coupling, WaterOnLightCottonBlowsUpAsPublished) {
  EXPECT_GT(largest_energy(CouplingScheme::paper), 10 * energy_of_fall);
}

std::vector<double> density_by_id(Shot shot) {
  add_sheet(shot, 0.2, 0, 20);
  Stepper run(shot);
  run.solver->refresh();
  const std::vector<int> place = place_of_id(run.solver->save());
  const std::vector<float> density = run.solver->density();
  std::vector<double> sorted;
  for (int p : place) sorted.push_back(density[p]);
  return sorted;
}

// A pool on either side: each has the density that it has alone.
TEST(Coupling, PoolsOnBothSidesOfASheetDoNotFeelEachOther) {
  Shot above = empty_shot(), below = empty_shot(), both = empty_shot();
  for (Shot* shot : {&above, &both}) add_box(*shot, V3d(-0.05, 0.001, -0.05), {10, 4, 10});
  for (Shot* shot : {&below, &both}) add_box(*shot, V3d(-0.05, -0.041, -0.05), {10, 4, 10});
  std::vector<double> alone = density_by_id(above);
  for (double rho : density_by_id(below)) alone.push_back(rho);
  const std::vector<double> together = density_by_id(both);
  ASSERT_EQ(together.size(), alone.size());
  for (size_t i = 0; i < alone.size(); ++i) EXPECT_NEAR(together[i], alone[i], 1e-3) << i;
}

/// One particle over a free sheet of 0.1 m, 2 x 2 cells; no viscosity, so that all forces are
/// normal.
sim::Scene particle_over_sheet(V3d place, V3d velocity) {
  Shot shot = empty_shot();
  shot.fluid.artificial_viscosity = 0, shot.fluid.kinematic_viscosity = 0;
  add_box(shot, V3d(0.5), {1, 1, 1});
  Cloth& cloth = add_sheet(shot, 0.1, 0, 2);
  cloth.damping = 0;
  sim::Scene scene = sim::build_scene(shot);
  sim::HostState& s = scene.start;
  s.position.x[0] = float(place.x + 1), s.position.y[0] = float(place.y + 1),
  s.position.z[0] = float(place.z + 1);
  s.velocity.x[0] = float(velocity.x), s.velocity.y[0] = float(velocity.y),
  s.velocity.z[0] = float(velocity.z);
  return scene;
}

V3d angular_momentum(const sim::Scene& scene, const sim::HostState& s) {
  const V3d about(1, 1, 1);
  V3d sum =
      (at(s.position, 0) - about).cross(at(s.velocity, 0)) * double(scene.parameters.particle_mass);
  for (size_t v = 0; v < s.cloth_position.size(); ++v) {
    sum += (at(s.cloth_position, v) - about).cross(at(s.cloth_velocity, v)) *
           double(scene.cloth.mass[v]);
  }
  return sum;
}

// A reaction shared by the weights of the foot point acts along the same line as the push: no
// torque is left. Against the angular momentum that the particle brought (1e-3 kg, 1 m/s, 0.02 m
// off the centre).
TEST(Coupling, BarycentricReactionBalancesTheTorque) {
  for (const V3d& place :
       {V3d(0.02, 0.004, 0.011), V3d(-0.013, 0.003, 0.031), V3d(0.025, -0.004, -0.02)}) {
    const V3d velocity(0, place.y > 0 ? -1 : 1, 0);
    Stepper run(particle_over_sheet(place, velocity));
    const V3d before = angular_momentum(run.scene, run.scene.start);
    run.step(2e-4);
    const sim::HostState after = run.solver->save();
    ASSERT_GT((at(after.velocity, 0) - velocity).length(), 0.01);  // it was pushed
    EXPECT_LT((angular_momentum(run.scene, after) - before).length(), 1e-5 * 1e-3 * 0.02);
  }
}

// A particle found on the wrong side of a sheet that it never crossed is pushed back to its own.
TEST(Coupling, SideIsRemembered) {
  for (int side : {1, -1}) {
    sim::Scene scene = particle_over_sheet(V3d(0.02, -0.001 * side, 0.011), V3d(0));
    Stepper probe{sim::Scene(scene)};
    probe.solver->refresh();
    const int triangle = probe.solver->near_triangles().at(0);
    ASSERT_GE(triangle, 0);
    scene.start.memory_triangle[0] = triangle, scene.start.memory_side[0] = side;
    Stepper run(std::move(scene));
    run.step(2e-4);
    EXPECT_GT(run.solver->save().velocity.y[0] * side, 0) << side;
    EXPECT_EQ(run.solver->save().memory_side[0], side);
  }
}

}  // namespace
}  // namespace drench::sim_tests
