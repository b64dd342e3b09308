// Momentum of fluid and cloth together, with nothing outside that could give or take any.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

struct Drift {
  double worst = 0;  // |p - p0| over sum m max(speed, sqrt(gH)) at that step, gH = speed^2/2
  double cloth = 0;  // kg m/s, largest momentum that the cloth had
  uint64_t guard_hits = 0;
};

/// A block of water flies at a free sheet for 400 steps.
Drift drift_of(V3d velocity, double areal_density, FluidSolver solver,
               ClothModel model = ClothModel::springs) {
  Shot shot = empty_shot();
  shot.fluid.solver = solver;
  add_box(shot, V3d(-0.04, 0.02, -0.04), {8, 8, 8}, velocity);
  Cloth& cloth = add_sheet(shot, 0.2, 0, 16);
  cloth.damping = 0, cloth.areal_density = areal_density, cloth.model = model;
  Stepper run(shot);
  const V3d before = total_momentum(run.scene, run.scene.start);
  Drift drift;
  // Past 0.02 s a sheet that is hit at 10 m/s is folded onto itself, which nothing holds apart yet.
  const bool folds = solver == FluidSolver::incompressible && velocity.length() > 5;
  for (int k = 0; k < 400; ++k) {
    // Nothing is to leave the domain.
    run.step(std::min(run.stable_dt(), folds ? 5e-5 : velocity.length() > 5 ? 2e-4 : 4e-4));
    const sim::HostState state = run.solver->save();
    const double scale = momentum_scale(run.scene, state, velocity.length() / std::sqrt(2.0));
    drift.worst =
        std::max(drift.worst, (total_momentum(run.scene, state) - before).length() / scale);
    V3d cloth(0);
    for (size_t v = 0; v < state.cloth_velocity.size(); ++v) {
      cloth += at(state.cloth_velocity, v) * double(run.scene.cloth.mass[v]);
    }
    drift.cloth = std::max(drift.cloth, cloth.length());
    drift.guard_hits = state.guard_hits;
  }
  return drift;
}

class Momentum : public testing::TestWithParam<FluidSolver> {};
INSTANTIATE_TEST_SUITE_P(Solvers, Momentum,
                         testing::Values(FluidSolver::weakly_compressible,
                                         FluidSolver::incompressible));

// The cloth weighs 8 g, so 3e-3 kg m/s is a third of its speed of impact: the two did meet.
TEST_P(Momentum, OfFluidAndClothIsKeptInASplash) {
  const Drift drift = drift_of(V3d(0, -1, 0), 0.2, GetParam());
  EXPECT_LT(drift.worst, 1e-5);
  EXPECT_GT(drift.cloth, 3e-3);
}

// A heavy sheet stops a fast block, where the collision test acts as well: its impulses must
// balance too.
TEST_P(Momentum, IsKeptWhereCollisionsAct) {
  const Drift drift = drift_of(V3d(0, -10, 0), 20, GetParam());
  EXPECT_LT(drift.worst, 1e-5);
  if (GetParam() == FluidSolver::weakly_compressible) {
    EXPECT_GT(drift.guard_hits, 0u);
  }
}

// Sheets six times as heavy as the water between them close on it until the collision test stops
// them, too: 0.08 kg of vertex by 0.008 kg of particle. Nothing is faster than twice an even
// outflow from a disc, speed R / (2 gap), when 30 mm are left.
TEST(HeavySheets, KeepMomentumWhereParticlesStopThem) {
  const double a = 0.02, speed = 10, size = 16 * a;
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = a;
  add_box(shot, V3d(-5 * a, -2 * a, -5 * a), {10, 4, 10});
  for (const double side : {-1., 1.}) {
    Cloth& sheet = add_sheet(shot, size, side * (2 * a + 0.0005), 16);
    sheet.name = side < 0 ? "low" : "high";
    sheet.adjacent_stiffness = 6000, sheet.diagonal_stiffness = 3000;
    sheet.damping = 0, sheet.areal_density = 200, sheet.velocity.y = -side * speed / 2;
  }
  Stepper run(shot);
  const V3d before = total_momentum(run.scene, run.scene.start);
  double drift = 0, fastest = 0;
  for (int k = 0; k < 40; ++k) {
    run.step();
    ASSERT_LT(run.limits.bad_particle + run.limits.bad_vertex, 0) << k;
    const sim::HostState state = run.solver->save();
    drift = std::max(drift, (total_momentum(run.scene, state) - before).length() /
                                momentum_scale(run.scene, state, speed / 2));
    fastest = std::max(fastest, double(run.limits.max_speed));
  }
  EXPECT_GT(run.solver->save().guard_holds, 5u);
  EXPECT_LT(drift, 1e-7);
  EXPECT_LT(fastest, speed * (size / 2) / 0.03);
}

// Cotton, whose stress is rounded to more than a spring's force.
TEST(ShellMomentum, IsKeptInASplash) {
  for (const V3d& velocity : {V3d(0, -1, 0), V3d(2, -1, 1)}) {
    const Drift drift = drift_of(velocity, 0.2, FluidSolver::incompressible, ClothModel::shell);
    EXPECT_LT(drift.worst, 1e-5);
    EXPECT_GT(drift.cloth, 3e-3);
  }
}

TEST_P(Momentum, IsKeptByASidewaysBlow) {
  const Drift drift = drift_of(V3d(2, -1, 1), 0.2, GetParam());
  EXPECT_LT(drift.worst, 1e-5);
  EXPECT_GT(drift.cloth, 3e-3);
}

}  // namespace
}  // namespace drench::sim_tests
