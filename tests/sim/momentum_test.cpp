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
Drift drift_of(V3d velocity, double areal_density) {
  Shot shot = empty_shot();
  add_box(shot, V3d(-0.04, 0.02, -0.04), {8, 8, 8}, velocity);
  Cloth& cloth = add_sheet(shot, 0.2, 0, 16);
  cloth.damping = 0, cloth.areal_density = areal_density;
  Stepper run(shot);
  const V3d before = total_momentum(run.scene, run.scene.start);
  Drift drift;
  for (int k = 0; k < 400; ++k) {
    run.step();
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

// The cloth weighs 8 g, so 4e-3 kg m/s is half its speed of impact: the two did meet.
TEST(Momentum, OfFluidAndClothIsKeptInASplash) {
  const Drift drift = drift_of(V3d(0, -1, 0), 0.2);
  EXPECT_LT(drift.worst, 1e-5);
  EXPECT_GT(drift.cloth, 4e-3);
}

// A heavy sheet stops a fast block, where the path test acts as well: its impulses must balance
// too.
TEST(Momentum, IsKeptWhereThePathTestActs) {
  const Drift drift = drift_of(V3d(0, -10, 0), 20);
  EXPECT_LT(drift.worst, 1e-5);
  EXPECT_GT(drift.guard_hits, 0u);
}

TEST(Momentum, IsKeptByASidewaysBlow) {
  const Drift drift = drift_of(V3d(2, -1, 1), 0.2);
  EXPECT_LT(drift.worst, 1e-5);
  EXPECT_GT(drift.cloth, 4e-3);
}

}  // namespace
}  // namespace drench::sim_tests
