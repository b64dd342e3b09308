// Seams between sheets: what they bear, how they are drawn together, and that contact leaves them
// alone.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/said.h"
#include "tests/sim/same_state.h"

namespace drench::sim_tests {
namespace {

constexpr double gravity = 9.81;

Cloth& add_cloth(Shot& shot, V3d corner, V3d u, V3d v, V2i cells) {
  Cloth& c = shot.cloth.emplace_back();
  c.name = "sheet" + std::to_string(shot.cloth.size());
  c.model = ClothModel::shell, c.corner = corner, c.u = u, c.v = v, c.cells = cells;
  c.young_warp = c.young_weft = 1e5, c.shear_modulus = 5e4, c.poisson = 0;
  c.bend_warp = c.bend_weft = c.bend_bias = 1e-5, c.stretch_limit = 100;
  c.thickness = 0.002;
  return c;
}

ClothSeam& sew(Cloth& cloth, GridEdge edge, const std::string& to, GridEdge to_edge) {
  ClothSeam& seam = cloth.seam.emplace_back();
  seam.edge = edge, seam.to = to, seam.to_edge = to_edge;
  return seam;
}

double gap_of(const sim::SeamSpring& s, const sim::HostState& state) {
  return (at(state.cloth_position, size_t(s.b)) - at(state.cloth_position, size_t(s.a))).length();
}

/// A strip held at its upper edge, and one below that is sewn to it, `gap` m apart.
Shot sewn_strips(double gap) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -gravity, 0);
  for (int k = 0; k < 2; ++k) {
    Cloth& c = add_cloth(shot, V3d(0, 0.8 - k * (0.15 + gap), 0), V3d(0.1, 0, 0), V3d(0, -0.15, 0),
                         {4, 6});
    c.areal_density = 2, c.damping = 5;
  }
  shot.cloth[0].pin.emplace_back().vertices = {0, 1, 2, 3, 4};
  sew(shot.cloth[0], GridEdge::v1, "sheet2", GridEdge::v0);
  return shot;
}

// Five springs of k bear the lower strip's weight: each is longer than at rest by W / (5 k).
TEST(Seam, BearsTheWeightOfWhatHangsOnIt) {
  Shot shot = sewn_strips(0.002);
  const double stiffness = 50, weight = 2 * 0.1 * 0.15 * gravity;
  shot.cloth[0].seam[0].stiffness = stiffness;
  Stepper run(shot);
  ASSERT_EQ(run.scene.cloth.seam.size(), 5u);
  while (run.time < 3) run.step(4e-3);
  const sim::HostState state = run.solver->save();
  double force = 0;
  for (const sim::SeamSpring& s : run.scene.cloth.seam) {
    EXPECT_FLOAT_EQ(s.rest_length, 0.002f);  // half of both thicknesses
    EXPECT_NEAR(gap_of(s, state), 0.002 + weight / (5 * stiffness), 2e-5);
    force += stiffness * (gap_of(s, state) - s.rest_length);
  }
  EXPECT_NEAR(force, weight, 0.002 * weight);
}

// With the stiffness that it has by itself a seam hardly opens, and contact, which begins at its
// rest length, does not shake it: all rests. One shorter than that is no fight, either.
TEST(Seam, HoldsByItselfAndRests) {
  for (const double rest : {-1., 0.0005, 0.}) {
    Shot shot = sewn_strips(0.002);
    shot.cloth[0].seam[0].rest_length = rest;
    Stepper run(shot);
    while (run.time < 3) run.step(4e-3);
    float fastest = 0;
    for (; run.time < 4; fastest = std::max(fastest, run.limits.max_speed)) run.step(4e-3);
    const sim::HostState state = run.solver->save();
    for (const sim::SeamSpring& s : run.scene.cloth.seam)
      EXPECT_NEAR(gap_of(s, state), rest < 0 ? 0.002 : rest, 2e-5) << rest;
    EXPECT_LT(fastest, 1e-3) << rest;
  }
}

// Two free sheets 0.1 m apart, drawn together in half a second: halfway in half of it, and what one
// gets the other loses.
TEST(Seam, IsDrawnTogetherInItsTime) {
  Shot shot = empty_shot();
  for (int k = 0; k < 2; ++k)
    add_cloth(shot, V3d(k * 0.3, 0, 0), V3d(0.2, 0, 0), V3d(0, 0, 0.2), {6, 6});
  sew(shot.cloth[0], GridEdge::u1, "sheet2", GridEdge::u0).time = 0.5;
  EXPECT_EQ(warnings(shot), std::vector<std::string>{});
  Stepper run(shot);
  const auto widest = [&] {
    const sim::HostState state = run.solver->save();
    double most = 0;
    for (const sim::SeamSpring& s : run.scene.cloth.seam) most = std::max(most, gap_of(s, state));
    return most;
  };
  while (run.time < 0.25) run.step_towards(0.25, 2e-3);
  EXPECT_NEAR(widest(), (0.1 + 0.002) / 2, 0.002);
  while (run.time < 0.5) run.step_towards(0.5, 2e-3);
  EXPECT_NEAR(widest(), 0.002, 0.001);
  const sim::HostState state = run.solver->save();
  const double mass = 0.2 * 0.04;
  EXPECT_LT(total_momentum(run.scene, state).length(), 2e-4 * mass * 0.1);
  shot.cloth[0].seam[0].time = 0;
  ASSERT_EQ(warnings(shot).size(), 1u);
  expect_words(warnings(shot)[0], {"sheet1", "seam 1", "0.098 m open", "time"});
}

// Ends that are nearer belong together, whichever way the grids run.
TEST(Seam, PairsTheEndsOfEdgesThatAreNearer) {
  Shot shot = empty_shot();
  add_cloth(shot, V3d(0, 0, 0), V3d(0.2, 0, 0), V3d(0, 0, 0.2), {4, 6});
  add_cloth(shot, V3d(0.41, 0, 0.2), V3d(-0.2, 0, 0), V3d(0, 0, -0.2), {4, 6});
  sew(shot.cloth[0], GridEdge::u1, "sheet2", GridEdge::u1);
  const sim::Scene scene = sim::build_scene(shot);
  ASSERT_EQ(scene.cloth.seam.size(), 7u);
  for (const sim::SeamSpring& s : scene.cloth.seam) EXPECT_NEAR(gap_of(s, scene.start), 0.01, 1e-6);
}

// Panels are modelled edge to edge: sewn they may start so, and hang together.
TEST(Seam, MayStartClosed) {
  Shot shot = sewn_strips(0);
  EXPECT_EQ(refusal(shot), "");
  Stepper run(shot);
  while (run.time < 1) run.step(4e-3);
  const sim::HostState state = run.solver->save();
  for (const sim::SeamSpring& s : run.scene.cloth.seam) EXPECT_LT(gap_of(s, state), 0.0022);
  shot.cloth[0].seam.clear();
  expect_words(refusal(shot), {"cloth starts", "sheet1", "sheet2"});
}

/// Two sheets under water that a seam draws together.
Shot sewn_pool(double shift) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -gravity, 0), shot.fluid.solver = FluidSolver::incompressible;
  shot.domain.min = V3d(shift - 0.3, -0.2, -0.3), shot.domain.max = V3d(shift + 0.3, 0.6, 0.3);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(shift - 0.08, 0.03, -0.08), {16, 8, 16}, V3d(0, -1, 0));
  for (int k = 0; k < 2; ++k) {
    add_cloth(shot, V3d(shift - 0.152 + 0.154 * k, 0, -0.15), V3d(0.15, 0, 0), V3d(0, 0, 0.3),
              {8, 16});
  }
  ClothPin& pin = shot.cloth[0].pin.emplace_back();
  pin.box = {V3d(shift - 0.153, -1, -1), V3d(shift - 0.151, 1, 1)};
  shot.cloth[1].pin.emplace_back().box = {V3d(shift + 0.151, -1, -1), V3d(shift + 0.153, 1, 1)};
  ClothSeam& seam = sew(shot.cloth[0], GridEdge::u1, "sheet2", GridEdge::u0);
  seam.rest_length = 0.002, seam.time = 0.03;
  return shot;
}

TEST(Seam, HasTheSameBitsOnThreadsElsewhereAndResumed) {
  const Shot shot = sewn_pool(0);
  expect_same_bits_on_threads(shot, 40);
  expect_same_bits_when_resumed(shot, 60, 0);
  expect_same_state(after(shot, 40), after(sewn_pool(1e4), 40));
}

// A sleeve: a half cylinder of a sheet that its own edges close.
TEST(Seam, JoinsASheetToItself) {
  Shot shot = empty_shot();
  add_cloth(shot, V3d(0, 0, 0), V3d(0.2, 0, 0), V3d(0, 0, 0.1), {16, 4});
  ClothSeam& seam = sew(shot.cloth[0], GridEdge::u0, "", GridEdge::u1);
  seam.time = 1;
  Stepper run(shot);
  sim::HostState state = run.scene.start;
  for (size_t v = 0; v < state.cloth_position.size(); ++v) {  // a breath up, or it stays plane
    const double x = state.cloth_position.x[v] - state.cloth_position.x[0];
    state.cloth_velocity.y[v] = float(0.1 * std::sin(M_PI * x / 0.2));
  }
  run.load(state, {}, 0);
  while (run.time < 1.2) run.step_towards(1.2, 2e-3);
  state = run.solver->save();
  for (const sim::SeamSpring& s : run.scene.cloth.seam) EXPECT_LT(gap_of(s, state), 0.004);
  for (size_t v = 0; v < state.cloth_velocity.size(); ++v)
    ASSERT_LT(at(state.cloth_velocity, v).length(), 1) << v;
}

}  // namespace
}  // namespace drench::sim_tests
