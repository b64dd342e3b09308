// Nothing crosses cloth, counted outside the solver from its states (crossings.h).

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/sim/crossings.h"

namespace drench::sim_tests {
namespace {

struct Count {
  int crossings = 0;
  uint64_t guard_hits = 0;
  int near_steps = 0;  // steps with particles near the sheet
};

/// `velocity` of a block of 8^3 particles just over a pinned sheet of 0.3 m, steps short enough for
/// one cloth substep each, every path counted.
Count flown_at_sheet(V3d velocity, int steps) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  const V3d aim = velocity.length() > 0 ? V3d(velocity.x, 0, velocity.z) * 0.02 : V3d(0);
  add_box(shot, V3d(-0.04, 0.015, -0.04) - aim, {8, 8, 8}, velocity);
  pin_edges(add_sheet(shot, 0.3, 0, 16));
  Stepper run(shot);
  sim::HostState before = run.solver->save();
  Count count;
  for (int k = 0; k < steps; ++k) {
    run.step(std::min(run.stable_dt(), double(run.scene.parameters.cloth_dt_limit)));
    if (run.limits.bad_particle >= 0 || run.limits.bad_vertex >= 0) break;
    const sim::HostState after = run.solver->save();
    count.crossings += count_crossings(run.scene.cloth, before, after);
    const std::vector<int> near = run.solver->near_triangles();
    count.near_steps += std::any_of(near.begin(), near.end(), [](int t) { return t >= 0; });
    before = after;
    count.guard_hits = before.guard_hits;
  }
  return count;
}

TEST(Crossing, NoneWhereABlockOfWaterFallsOnLightCotton) {
  const Count count = flown_at_sheet(V3d(0, -1, 0), 1500);
  EXPECT_EQ(count.crossings, 0);
  EXPECT_GT(count.near_steps, 500);
}

TEST(Crossing, NoneByAJetAtTenMetresASecond) {
  const Count count = flown_at_sheet(V3d(0, -10, 0), 600);
  EXPECT_EQ(count.crossings, 0);
  EXPECT_GT(count.guard_hits, 0u);
}

TEST(Crossing, NoneByAGrazingJet) {
  const Count count = flown_at_sheet(V3d(9.8, -2, 0), 600);
  EXPECT_EQ(count.crossings, 0);
  EXPECT_GT(count.near_steps, 50);
}

// Several cloth substeps a step: their paths are not stored, but who is below the sheet is.
TEST(Crossing, NothingIsBelowASheetThatIsSubstepped) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  add_box(shot, V3d(-0.04, 0.015, -0.04), {8, 8, 8}, V3d(0, -1, 0));
  pin_edges(add_sheet(shot, 0.3, 0, 16));
  Stepper run(shot);
  ASSERT_GE(run.stable_dt(), 2 * run.scene.parameters.cloth_dt_limit);
  run.advance(0.1);  // nothing has run over the edge of the sheet yet
  const sim::HostState state = run.solver->save();
  EXPECT_EQ(count_below(run.scene.cloth, state, run.scene.start.cloth_position, 1), 0);
}

// One particle goes straight down through the middle of a triangle, one beside the sheet, one along
// it.
TEST(CrossingCounter, CountsAMadeUpCrossing) {
  Shot shot = empty_shot();
  add_box(shot, V3d(-0.005, 0.02, -0.005), {3, 1, 1});
  add_sheet(shot, 0.3, 0, 3);
  const sim::Scene scene = sim::build_scene(shot);
  sim::HostState before = scene.start, after = scene.start;
  const auto put = [](sim::HostState& s, int i, V3d p) {
    s.position.x[i] = float(p.x + 1), s.position.y[i] = float(p.y + 1),
    s.position.z[i] = float(p.z + 1);
  };
  put(before, 0, V3d(0.01, 0.02, 0.02)), put(after, 0, V3d(0.01, -0.02, 0.02));
  put(before, 1, V3d(0.2, 0.02, 0)), put(after, 1, V3d(0.2, -0.02, 0));
  put(before, 2, V3d(-0.1, 0.02, 0)), put(after, 2, V3d(0.1, 0.02, 0));
  EXPECT_EQ(count_crossings(scene.cloth, before, after), 1);
  EXPECT_EQ(count_below(scene.cloth, after, scene.start.cloth_position, 1), 2);
  for (float& y : after.cloth_position.y) y += 0.03f;  // now the sheet rises past the third as well
  EXPECT_EQ(count_crossings(scene.cloth, before, after), 2);
}

// Through a sheet that is only drawn, not simulated, all 512 particles of a block fall once each.
TEST(CrossingCounter, CountsEveryParticleThatFallsThroughAGhostOnce) {
  Shot shot = empty_shot();
  add_box(shot, V3d(-0.04, 0.015, -0.04), {8, 8, 8}, V3d(0.3, -10, 0.2));
  Stepper run(shot);
  pin_edges(add_sheet(shot, 0.3, 0, 16));
  const sim::Scene ghost = sim::build_scene(shot);
  int crossings = 0;
  sim::HostState before = run.solver->save();
  before.cloth_position = ghost.start.cloth_position;
  for (int k = 0; k < 40; ++k) {
    run.step(5e-4);
    sim::HostState after = run.solver->save();
    after.cloth_position = ghost.start.cloth_position;
    crossings += count_crossings(ghost.cloth, before, after);
    before = after;
  }
  EXPECT_EQ(crossings, 512);
  EXPECT_EQ(count_below(ghost.cloth, before, ghost.start.cloth_position, 1), 512);
}

}  // namespace
}  // namespace drench::sim_tests
