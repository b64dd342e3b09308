// Where sheets may start, beside walls and fluid.

#include <gtest/gtest.h>

#include "tests/sim/said.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

constexpr double a = 0.025;  // m

/// A tank of 0.5 m, half full.
Shot tank_shot() {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.spacing = a, shot.fluid.solver = FluidSolver::incompressible;
  shot.domain.min = V3d(-0.25, 0, -0.25), shot.domain.max = V3d(0.25, 0.5, 0.25);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(-0.25, 0, -0.25), {20, 8, 20});
  return shot;
}

// Vertices stand on floats: springs have the lengths between these, whatever the compiler inlines,
// so that a sheet starts without tension.
TEST(ClothStart, HasTheRestLengthsThatItsVerticesStandAt) {
  Shot shot = empty_shot();
  Cloth& sheet = add_sheet(shot, 0.4, 0.1, 12);
  sheet.u = V3d(0.4, 0.1, 0), sheet.v = V3d(0, -0.2, 0.3);
  const sim::Scene scene = sim::build_scene(shot);
  const sim::ClothTopology& t = scene.cloth;
  for (size_t v = 0; v + 1 < t.spring_start.size(); ++v) {
    for (int s = t.spring_start[v]; s < t.spring_start[v + 1]; ++s) {
      const V3d d = at(scene.start.cloth_position, size_t(t.spring_end[size_t(s)])) -
                    at(scene.start.cloth_position, v);
      ASSERT_EQ(t.rest_length[size_t(s)], float(d.length())) << v << " " << s;
    }
  }
}

// Walls would sweep it in within the first step: an error where it would hit fluid, else a warning.
TEST(ClothStart, BeyondAWallIsRefusedBesideFluidAndSaidWithout) {
  Shot shot = empty_shot();
  shot.domain.axis[0] = Axis::walls;  // at 1 m
  Cloth& sheet = add_sheet(shot, 0.4, 0, 8);
  EXPECT_EQ(warnings(shot), std::vector<std::string>{});
  sheet.corner.x = 0.61;
  ASSERT_EQ(warnings(shot).size(), 1u);
  expect_words(warnings(shot)[0], {"starts beyond the domain's walls", "1.01 m in x"});
  add_box(shot, V3d(-0.5), {4, 4, 4});
  ClothPin all;
  all.box = {V3d(-2), V3d(2)};
  shot.cloth[0].pin = {all};  // what is pinned stays
  EXPECT_EQ(refusal(shot), "");
  shot.cloth[0].pin.clear();
  EXPECT_NE(refusal(shot).find("starts beyond the domain's walls"), std::string::npos);
  shot.domain.axis[0] = Axis::open;
  EXPECT_EQ(refusal(shot), "");
}

// Walls keep a sheet a quarter spacing off, which is a quarter before the first particles: there is
// no room below these. On the floor it threw the pool up to twice its energy.
TEST(ClothStart, UnderAPoolOnItsFloorOrWallIsRefused) {
  for (const double height : {0., 0.1 * a, 0.25 * a}) {
    Shot shot = tank_shot();
    add_sheet(shot, 0.4, height, 16);
    EXPECT_NE(refusal(shot).find("fluid starts inside cloth"), std::string::npos) << height;
  }
  Shot wall = tank_shot();
  Cloth& curtain = add_sheet(wall, 0.4, 0, 16);
  curtain.corner = V3d(-0.25, 0.02, -0.2), curtain.u = V3d(0, 0.4, 0), curtain.v = V3d(0, 0, 0.4);
  EXPECT_NE(refusal(wall).find("fluid starts inside cloth"), std::string::npos);
  Shot above = tank_shot();
  add_sheet(above, 0.4, 8 * a + 0.5 * a, 16);
  EXPECT_EQ(refusal(above), "");
}

// Only where there are particles is a sheet compared with them: kilometres of it cost nothing.
TEST(ClothStart, OfASheetFarLargerThanTheFluidIsKnownAtOnce) {
  Shot shot = tank_shot();
  shot.domain.axis = {Axis::open, Axis::open, Axis::open};
  Cloth& sheet = add_sheet(shot, 40000, 0, 8);
  sheet.u.y = 30000, sheet.v.y = 20000, sheet.corner.y = -25000 + 0.1;  // its middle is in the pool
  EXPECT_NE(refusal(shot).find("fluid starts inside cloth"), std::string::npos);
  shot.cloth[0].corner.y = 2;
  EXPECT_EQ(refusal(shot), "");
}

}  // namespace
}  // namespace drench::sim_tests
