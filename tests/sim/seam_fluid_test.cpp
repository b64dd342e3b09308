// Seams and water: what is sewn holds it as one sheet does, what is open lets it pass.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/sim/same_state.h"

namespace drench::sim_tests {
namespace {

constexpr double a = 0.01, thickness = 0.002;  // m

Cloth& add_shell(Shot& shot, V3d corner, V3d u, V3d v, V2i cells) {
  Cloth& c = shot.cloth.emplace_back();
  c.name = "sheet" + std::to_string(shot.cloth.size());
  c.model = ClothModel::shell, c.corner = corner, c.u = u, c.v = v, c.cells = cells;
  c.thickness = thickness, c.areal_density = 0.2;
  return c;
}

Shot wet_shot() {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = a;
  shot.domain.min = V3d(-0.2, -0.2, 0), shot.domain.max = V3d(0.2, 0.2, 6 * a);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::periodic};
  return shot;
}

/// A trough along a periodic axis, of two sheets with all vertices pinned, `gap` m apart at the
/// bottom, where a seam sews them; water falls into it.
Shot trough(double gap) {
  Shot shot = wet_shot();
  add_box(shot, V3d(-3 * a, 0.05, 0), {6, 5, 6});
  for (const int side : {-1, 1}) {
    Cloth& sheet = add_shell(shot, V3d(0.5 * side * gap, 0, 0), V3d(side * 0.15, 0.15, 0),
                             V3d(0, 0, 6 * a), V2i(18, 6));
    sheet.pin.emplace_back().box = {V3d(-1), V3d(1)};
  }
  ClothSeam& seam = shot.cloth[0].seam.emplace_back();
  seam.edge = seam.to_edge = GridEdge::u0, seam.to = "sheet2";
  return shot;
}

int below(const Stepper& run, double height) {
  const sim::HostState state = run.solver->save();
  int count = 0;
  for (const float y : state.position.y) count += y + run.scene.frame.origin[1] < height;
  return count;
}

/// How much of the water has left a trough after half a second.
double leaked(const Shot& shot) {
  Stepper run(shot);
  run.advance(0.5);
  return below(run, -a) / 180.;
}

/// Two squares that are sewn along all edges, `apart` m, with a layer of water between them.
Shot pillow(double apart, V3d gravity) {
  Shot shot = wet_shot();
  shot.domain.min = V3d(-0.2), shot.domain.max = V3d(0.2);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  shot.gravity = gravity;
  for (const int k : {0, 1}) {
    add_shell(shot, V3d(-0.1, (k - 0.5) * apart, -0.1), V3d(0.2, 0, 0), V3d(0, 0, 0.2), {10, 10});
  }
  for (const GridEdge edge : {GridEdge::u0, GridEdge::u1, GridEdge::v0, GridEdge::v1}) {
    ClothSeam& seam = shot.cloth[0].seam.emplace_back();
    seam.edge = seam.to_edge = edge, seam.to = "sheet2", seam.time = 0.05;
  }
  add_box(shot, V3d(-6 * a, -a / 2, -6 * a), {12, 1, 12});
  return shot;
}

/// Turns of the sheets and strips around a point: 1 inside what they close, 0 outside (van Oosterom
/// and Strackee 1983).
double turns_around(const sim::ClothTopology& t, const sim::HostState& state, const V3d& p) {
  double angle = 0;
  for (const auto* corner : {&t.corner, &t.strips.corner}) {
    for (size_t k = 0; k < corner->size(); k += 3) {
      V3d x[3];
      for (size_t e = 0; e < 3; ++e) x[e] = at(state.cloth_position, size_t((*corner)[k + e])) - p;
      const double la = x[0].length(), lb = x[1].length(), lc = x[2].length();
      const bool flipped = corner == &t.corner && t.sheet[k / 3] == 1;  // both face up
      angle += (flipped ? -2 : 2) * std::atan2(x[0].dot(x[1].cross(x[2])),
                                               la * lb * lc + x[0].dot(x[1]) * lc +
                                                   x[1].dot(x[2]) * la + x[2].dot(x[0]) * lb);
    }
  }
  return std::abs(angle) / (4 * M_PI);
}

// A pillow of triangles and strips is a closed surface of genus 0: every edge has two sides, and
// V - E + F = V - F / 2 = 2.
TEST(SeamInWater, StripsCloseAPillow) {
  const sim::Scene scene = sim::build_scene(pillow(0.025, V3d(0)));
  const sim::ClothTopology& t = scene.cloth;
  const size_t faces = size_t(t.triangles()) + t.strips.beside.size();
  ASSERT_EQ(t.strips.neighbour.size(), 3 * faces);
  for (const int other : t.strips.neighbour) EXPECT_GE(other, 0);
  std::map<std::pair<int, int>, int> sides;
  for (const auto* corner : {&t.corner, &t.strips.corner}) {
    for (size_t k = 0; k < corner->size(); ++k) {
      const int v = (*corner)[k], w = (*corner)[k % 3 == 2 ? k - 2 : k + 1];
      ++sides[std::minmax(v, w)];
    }
  }
  for (const auto& [edge, count] : sides) EXPECT_EQ(count, 2) << edge.first << ' ' << edge.second;
  EXPECT_EQ(t.vertices() - int(faces) / 2, 2);
}

// Half a spacing and the thickness, 7 mm, is what a particle may come through.
TEST(SeamInWater, IsTightOnceItIsClosed) {
  for (const double gap : {1e-6, 0.002, 0.006}) EXPECT_EQ(leaked(trough(gap)), 0) << gap;
}

TEST(SeamInWater, IsOpenUntilItCloses) {
  EXPECT_GT(leaked(trough(0.025)), 0.5);
  Shot shot = trough(0.006);
  shot.cloth[0].seam.clear();
  EXPECT_GT(leaked(shot), 0.05);
}

// Pins bring the sides of the trough together, from 25 mm to 2 mm in 0.15 s, when some of the water
// has come through. From then on nothing does.
TEST(SeamInWater, KeepsWhatIsLeftWhenItCloses) {
  Shot shot = trough(0.025);
  const double first = shot.timeline.first, frames = 0.15 * shot.timeline.fps;
  for (const int k : {0, 1}) {
    shot.cloth[size_t(k)].pin[0].position.keys = {{first, V3d(0)},
                                                  {first + frames, V3d((0.5 - k) * 0.023, 0, 0)}};
  }
  Stepper run(shot);
  run.advance(0.35);
  const int passed = below(run, -a);
  EXPECT_GT(passed, 10);
  EXPECT_LT(passed, 150);
  run.advance(0.8);
  EXPECT_EQ(below(run, -a), passed);
}

TEST(SeamInWater, APillowKeepsItsWater) {
  Stepper run(pillow(0.025, V3d(0, -9.81, 0)));
  run.advance(0.4);
  const sim::HostState state = run.solver->save();
  ASSERT_EQ(state.position.size(), 144u);
  for (size_t i = 0; i < state.position.size(); ++i)
    EXPECT_NEAR(turns_around(run.scene.cloth, state, at(state.position, i)), 1, 0.05) << i;
}

// Water that slides into the seams of a free pillow takes it along. 7e-5 is left of the momentum;
// 1e-3 where the sheets answer the pressures by sweeps.
TEST(SeamInWater, KeepsMomentum) {
  Shot shot = pillow(0.01, V3d(0));
  shot.domain.min = V3d(-0.5), shot.domain.max = V3d(0.5);
  shot.domain.axis = {Axis::open, Axis::open, Axis::open};
  shot.fluid.box[0].velocity = V3d(0.2, 0, 0.1);
  for (Cloth& sheet : shot.cloth) sheet.damping = 0;
  Stepper run(shot);
  const V3d before = total_momentum(run.scene, run.solver->save());
  run.advance(0.35);
  const sim::HostState state = run.solver->save();
  EXPECT_LT((total_momentum(run.scene, state) - before).length(), 1e-3 * before.length());
  V3d sheets(0);
  for (size_t v = 0; v < state.cloth_velocity.size(); ++v)
    sheets += at(state.cloth_velocity, v) / double(state.cloth_velocity.size());
  EXPECT_GT(sheets.x, 0.1);  // m/s
}

TEST(SeamInWater, HasTheSameBitsResumed) {
  Shot shot = trough(0.025);
  shot.cloth[0].seam[0].time = 0.1;
  for (Cloth& sheet : shot.cloth) sheet.pin[0].box = {V3d(-1, 0.1499, -1), V3d(1)};
  expect_same_bits_when_resumed(shot, 80, 0);
}

}  // namespace
}  // namespace drench::sim_tests
