// Motion that no inner force may change.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

/// A block whose particles are shaken by half a spacing: it is under pressure and flies apart.
sim::Scene shaken_block(const Shot& shot) {
  sim::Scene scene = sim::build_scene(shot);
  Random random(7);
  sim::HostVec& x = scene.start.position;
  const float amplitude = float(0.5 * shot.fluid.spacing);
  for (size_t i = 0; i < x.size(); ++i) {
    x.x[i] += amplitude * float(random() - 0.5);
    x.y[i] += amplitude * float(random() - 0.5);
    x.z[i] += amplitude * float(random() - 0.5);
  }
  return scene;
}

// Symplectic Euler falls g dt^2 (1 + 2 + .. + n) = g t^2/2 (1 + 1/n) in n steps. Positions near 1 m
// are known to 6e-8 m; 400 roundings of random sign over 512 particles leave the mean below 1e-6 m
// off.
TEST(FreeFall, CentreOfMassFallsByTheParabola) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.time_step = 1e-4;
  add_box(shot, V3d(0), {8, 8, 8});
  Stepper run(shaken_block(shot));
  const V3d before = centre_of_mass(run.solver->save());
  constexpr int n = 400;
  for (int k = 0; k < n; ++k) run.step(5e-4);
  const V3d moved = centre_of_mass(run.solver->save()) - before;
  const double t = n * 5e-4;
  EXPECT_NEAR(moved.y, -0.5 * 9.81 * t * t * (1 + 1.0 / n), 1e-6);
  EXPECT_NEAR(moved.x, 0, 1e-6);
  EXPECT_NEAR(moved.z, 0, 1e-6);
}

// Pressure acts along the line between two particles, so it cannot start a spin. Angular momentum
// about the centre, against sum m |x| |v|.
TEST(FreeFall, PressureStartsNoSpin) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.artificial_viscosity = 0;
  shot.fluid.kinematic_viscosity = 0;
  add_box(shot, V3d(0), {8, 8, 8});
  Stepper run(shaken_block(shot));
  for (int k = 0; k < 200; ++k) run.step(5e-4);
  const sim::HostState state = run.solver->save();
  const V3d centre = centre_of_mass(state);
  V3d velocity(0), spin(0);
  for (size_t i = 0; i < state.id.size(); ++i)
    velocity += at(state.velocity, i) / double(state.id.size());
  double scale = 0;
  // The shaken block starts without velocity, so all spin was made by forces.
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d x = at(state.position, i) - centre, v = at(state.velocity, i) - velocity;
    spin += x.cross(v);
    scale += x.length() * v.length();
  }
  ASSERT_GT(scale, 1e-3 * double(state.id.size()) * 0.04);  // it did fly apart
  EXPECT_LT(spin.length(), 1e-4 * scale);
}

// Every particle of a lattice at rest falls alike: it is free of stress.
TEST(FreeFall, ALatticeStaysALattice) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  add_box(shot, V3d(0), {8, 8, 8});
  Stepper run(shot);
  for (int k = 0; k < 200; ++k) run.step(5e-4);
  const sim::HostState state = run.solver->save();
  for (size_t i = 0; i < state.id.size(); ++i) {
    ASSERT_NEAR(state.velocity.y[i], -9.81 * 0.1, 2e-3);
    ASSERT_NEAR(state.velocity.x[i], 0, 2e-3);
  }
}

}  // namespace
}  // namespace drench::sim_tests
