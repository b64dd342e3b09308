// Nothing crosses cloth, counted outside the solver from its states (crossings.h).

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/sim/crossings.h"

namespace drench::sim_tests {
namespace {

/// Paths from one observed state to the next against the sheet, substep by substep.
class PathCount {
 public:
  /// @param ghost  sheet in place of the simulated one: drawn where it starts, touched by nothing.
  /// @param sink   m that the ghost sinks from state to state.
  explicit PathCount(Stepper& run, const sim::Scene* ghost = nullptr, float sink = 0)
      : run_(run), ghost_(ghost), sink_(sink), before_(shown(run.solver->save())) {
    run.solver->observe_substeps([this](const sim::HostState& state) { add(state); });
  }
  ~PathCount() { run_.solver->observe_substeps({}); }
  PathCount(const PathCount&) = delete;
  PathCount& operator=(const PathCount&) = delete;

  void step(double dt) {
    substep_ = 0;
    run_.step(dt);
    fewest = std::min(fewest, substep_), most = std::max(most, substep_);
    const std::vector<int> near = run_.solver->near_triangles();
    near_steps += std::any_of(near.begin(), near.end(), [](int t) { return t >= 0; });
  }
  const sim::HostState& last() const { return before_; }

  int crossings = 0, late_crossings = 0;  // late: not in the first substep of a step
  int fewest = 1000, most = 0;            // substeps a step
  int near_steps = 0;                     // steps with particles near the sheet

 private:
  sim::HostState shown(sim::HostState state) {
    if (!ghost_) return state;
    state.cloth_position = ghost_->start.cloth_position;
    for (float& y : state.cloth_position.y) y -= sunk_;
    sunk_ += sink_;
    return state;
  }
  void add(const sim::HostState& state) {
    sim::HostState after = shown(state);
    const int count = count_crossings((ghost_ ? *ghost_ : run_.scene).cloth, before_, after);
    crossings += count;
    late_crossings += substep_ > 0 ? count : 0;
    ++substep_;
    before_ = std::move(after);
  }

  Stepper& run_;
  const sim::Scene* ghost_;
  float sink_, sunk_ = 0;
  sim::HostState before_;
  int substep_ = 0;
};

/// A block of 8^3 particles of one velocity just over a pinned sheet of 0.3 m, of light cotton.
Shot block_over_sheet(V3d velocity) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  const V3d aim = V3d(velocity.x, 0, velocity.z) * (0.2 / velocity.length());
  add_box(shot, V3d(-0.04, 0.015, -0.04) - aim, {8, 8, 8}, velocity);
  pin_edges(add_sheet(shot, 0.3, 0, 16));
  return shot;
}

/// The same with a sheet so stiff that the first stable fluid step takes `substeps` cloth steps:
/// their limit falls with the square root of the stiffness. For one, it stays cotton.
Shot jet_at_sheet(V3d velocity, int substeps) {
  Shot shot = block_over_sheet(velocity);
  if (substeps == 1) return shot;
  Stepper run(shot);
  const double wanted_limit = run.stable_dt() / (substeps - 0.4);
  const double ratio = run.scene.parameters.cloth_dt_limit / wanted_limit;
  shot.cloth[0].adjacent_stiffness *= ratio * ratio;
  shot.cloth[0].diagonal_stiffness *= ratio * ratio;
  return shot;
}

/// Stable steps of at most `substeps` cloth steps, every path counted: none may cross.
/// @return particles that the collision test held back.
uint64_t expect_no_crossing(const Shot& shot, int steps, int substeps, int least_near_steps) {
  Stepper run(shot);
  PathCount count(run);
  for (int k = 0; k < steps; ++k) {
    count.step(std::min(run.stable_dt(), substeps * double(run.scene.parameters.cloth_dt_limit)));
    if (run.limits.bad_particle < 0 && run.limits.bad_vertex < 0) continue;
    ADD_FAILURE() << "blew up in step " << k;
    break;
  }
  EXPECT_EQ(count.crossings, 0);
  EXPECT_GE(count.fewest, std::min(substeps, 2));
  EXPECT_EQ(count.most, substeps);
  EXPECT_GE(count.near_steps, least_near_steps);
  return count.last().guard_hits;
}

class Crossing : public testing::TestWithParam<int> {};  // cloth substeps a step
INSTANTIATE_TEST_SUITE_P(Substeps, Crossing, testing::Values(1, 2, 3, 4));

TEST_P(Crossing, NoneWhereABlockOfWaterFallsOnLightCotton) {
  expect_no_crossing(block_over_sheet(V3d(0, -1, 0)), 1500 / GetParam(), GetParam(), 300);
}

TEST_P(Crossing, NoneByAJetAtTenMetresASecond) {
  const Shot shot = jet_at_sheet(V3d(0, -10, 0), GetParam());
  EXPECT_GT(expect_no_crossing(shot, 600, GetParam(), 200), 0u);
}

TEST_P(Crossing, NoneByAGrazingJet) {
  expect_no_crossing(jet_at_sheet(V3d(9.8, -2, 0), GetParam()), 600, GetParam(), 300);
}

class StrongJets : public testing::TestWithParam<V3d> {};
// Falls, normal jets and grazing ones.
INSTANTIATE_TEST_SUITE_P(Velocities, StrongJets,
                         testing::Values(V3d(0, -1, 0), V3d(0, -10, 0), V3d(9.8, -2, 0),
                                         V3d(0, -50, 0), V3d(0, -100, 0), V3d(99.6, -8.7, 0)));

TEST_P(StrongJets, NoneCrossesInTheIncompressibleFluid) {
  Shot shot = block_over_sheet(GetParam());
  shot.fluid.solver = FluidSolver::incompressible;
  expect_no_crossing(shot, 150, 1, 20);
}

// A step of many spacings, which the solver never chooses: particles come from farther than their
// support and would pass in one step.
TEST(StrongCrossing, NoneInStepsLongerThanTheSupport) {
  for (const double speed : {3., 10.}) {
    Shot shot = block_over_sheet(V3d(0, -speed, 0));
    shot.fluid.solver = FluidSolver::incompressible;
    Stepper run(shot);
    PathCount count(run);
    for (int k = 0; k < 8; ++k) count.step(3 * shot.fluid.spacing / speed);
    EXPECT_EQ(count.crossings, 0) << speed;
    EXPECT_LT(run.limits.bad_particle + run.limits.bad_vertex, 0) << speed;
    EXPECT_GT(count.last().guard_hits, 100u) << speed;
  }
}

// What is counted is what the solver went through: the last substep of a step is the state after
// it, and being watched changes no bit.
TEST(CrossingObserver, SeesTheStatesOfTheSolverAndLeavesThemAlone) {
  const Shot shot = jet_at_sheet(V3d(0, -10, 0), 3);
  Stepper watched(shot), alone(shot);
  PathCount count(watched);
  for (int k = 0; k < 60; ++k) count.step(watched.stable_dt()), alone.step();
  EXPECT_GE(count.fewest, 2);
  const sim::HostState a = watched.solver->save(), b = alone.solver->save();
  for (const sim::HostState* other : {&b, &count.last()}) {
    EXPECT_EQ(other->id, a.id);
    EXPECT_EQ(other->position.y, a.position.y);
    EXPECT_EQ(other->velocity.y, a.velocity.y);
    EXPECT_EQ(other->cloth_position.y, a.cloth_position.y);
  }
}

// A ghost 12 mm above the simulated sheet, within the support radius of 20 mm: the jet crosses it,
// and whoever has done so an odd number of times is below.
TEST(CrossingObserver, CountsThroughAGhost) {
  Shot shot = jet_at_sheet(V3d(0.3, -10, 0.2), 3);
  const sim::Scene ghost = sim::build_scene(shot);
  shot.cloth.back().corner.y -= 0.012;
  Stepper run(shot);
  PathCount count(run, &ghost);
  for (int k = 0; k < 60; ++k) count.step(run.stable_dt());
  EXPECT_GE(count.fewest, 2);
  const int below = count_below(ghost.cloth, count.last(), ghost.start.cloth_position, 1);
  EXPECT_GE(count.crossings, below);
  EXPECT_GT(below, 0);
  EXPECT_EQ((count.crossings - below) % 2, 0);
}

// A ghost that sinks into the falling block, 0.2 mm a substep, meets particles in every one of
// them.
TEST(CrossingObserver, CountsSubstepBySubstep) {
  Shot shot = jet_at_sheet(V3d(0, -1, 0), 3);
  sim::Scene ghost = sim::build_scene(shot);
  for (float& y : ghost.start.cloth_position.y) y += 0.05f;
  Stepper run(shot);
  PathCount count(run, &ghost, 2e-4f);
  for (int k = 0; k < 60; ++k) count.step(run.stable_dt());
  EXPECT_GE(count.fewest, 2);
  EXPECT_GT(count.late_crossings, 100);
  EXPECT_GT(count.crossings - count.late_crossings, 50);
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
