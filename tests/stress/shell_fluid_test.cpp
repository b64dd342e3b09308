// Shells and water: a pinned sheet, piles and folds that are poured on, and bags.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sim/simulator.h"
#include "tests/contract/sphere_mesh.h"
#include "tests/stress/shell_scenes.h"
#include "tests/stress/shell_watch.h"

namespace drench::stress_tests {
namespace {

/// The net of springs of fall_on_sheet as a shell.
Shot fall_on_shell() {
  Shot shot = fall_on_sheet(100);
  Cloth& sheet = shot.cloth[0];
  sheet.model = ClothModel::shell, sheet.areal_density = 0.2;
  return shot;
}

class ShellUnderWater : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Moduli, ShellUnderWater,
                         testing::Values(1., 1e1, 1e2, 1e3, 1e4, 1e5, 1e6));

TEST_P(ShellUnderWater, NeitherBlowsUpNorLeaks) {
  Shot shot = fall_on_shell();
  set_moduli(shot.cloth[0], GetParam(), 1.5e-5);
  ShellWatch watch(shot);
  watch.until(long_form() ? 3 : 0.3);
  ShellGates gates;
  if (GetParam() > 1e5) gates.energy = 1;  // the one linear step of a flat sheet
  report("water on a shell", fmt::format("{:g} N/m", GetParam()), watch, gates);
}

class ShellPileUnderWater : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Layers, ShellPileUnderWater,
                         testing::ValuesIn(long_form() ? std::vector{2, 10} : std::vector{2}));

TEST_P(ShellPileUnderWater, HoldsWhatIsPouredOnIt) {
  Shot shot = fall_on_shell();
  const Cloth one = shot.cloth[0];
  shot.cloth.clear();
  for (int k = 0; k < GetParam(); ++k) {
    Cloth& sheet = shot.cloth.emplace_back(one);
    sheet.name = fmt::format("layer{}", k), sheet.corner.y = -1.2 * k * one.thickness;
  }
  ShellWatch watch(shot);
  watch.until(long_form() ? 1 : 0.3);
  report("water on shells", fmt::format("{} pinned layers", GetParam()), watch, {.nearest = 0});
}

/// Water that falls on a sheet which lies on the floor, or on a table, and gets under its edges.
class ShellWashed : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Table, ShellWashed, testing::Bool());

TEST_P(ShellWashed, IsNotThrown) {
  const bool table = GetParam();
  for (int k = 0; k < (long_form() ? 24 : 4); ++k) {
    Shot shot = water(0.02);
    shot.domain.min = V3d(-0.2, table ? -0.1 : 0, -0.2), shot.domain.max = V3d(0.2, 1, 0.2);
    shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
    if (table) {
      Obstacle& box = shot.obstacle.emplace_back();
      box.size = V3d(0.36, 0.06, 0.36), box.position = V3d(0, -0.03, 0);
    }
    Cloth& sheet =
        add_shell(shot, V3d(-0.1, 0.006, -0.1), V3d(0.2, 0, 0), V3d(0, 0, 0.2), V2i(8, 8));
    sheet.thickness = 0.002;
    add_box(shot, V3d(-0.04, 0.05 + 0.002 * k, -0.04), {4, 5, 4});
    ShellWatch watch(shot);
    watch.until(1);
    report("washed",
           fmt::format("{}, water from {} mm", table ? "on a table" : "on the floor", 50 + 2 * k),
           watch, {.energy = not_gated});  // what is squeezed on the floor strains it for a step
  }
}

/// Water that is poured on a sheet on the floor, or on a box, from one of twelve moments on.
Shot poured(bool box, int moment) {
  Shot shot = water(0.02);
  shot.timeline.first = 1, shot.timeline.last = 20, shot.timeline.fps = 12;
  shot.domain.min = V3d(-0.2, box ? -1.1 : -1, -0.2), shot.domain.max = V3d(0.2, 1, 0.2);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  if (box) {
    Obstacle& table = shot.obstacle.emplace_back();
    table.size = V3d(0.36, 0.06, 0.36), table.position = V3d(0, -1.03, 0);
  }
  Cloth& sheet = add_shell(shot, V3d(-0.1, -0.98, -0.1), V3d(0.2, 0, 0), V3d(0, 0, 0.2), V2i(8, 8));
  sheet.thickness = 0.002, sheet.damping = 5;
  FluidEmitter& jet = shot.fluid.emitter.emplace_back();
  jet.center = V3d(0, -0.9, 0), jet.radius = 0.04, jet.direction = V3d(0, -1, 0), jet.speed = 0.5;
  jet.start = 0.2 + 0.01 * moment, jet.stop = 0.5;
  return shot;
}

class ShellPouredOn : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Box, ShellPouredOn, testing::Bool());

// It falls by 0.12 m: 1.5 m/s.
TEST_P(ShellPouredOn, IsNotThrown) {
  for (int moment = 0; moment < 12; ++moment) {
    Simulator run(poured(GetParam(), moment), {.device = Device::cpu});
    double fastest = 0;
    for (int frame = 1; frame < 20; ++frame)
      fastest = std::max(fastest, run.advance_frame().max_speed);
    EXPECT_LT(fastest, 4) << moment;
  }
}

// It has folded up on the floor when the water comes.
TEST(ShellHeap, PouredOnWhileFolded) {
  if (!long_form()) GTEST_SKIP() << "minutes: DRENCH_STRESS=long";
  Shot shot = standing(21);
  shot.domain.max.y = 1.5;
  add_box(shot, V3d(-0.1, 1.0, -0.1), {10, 6, 10});
  ShellWatch watch(shot);
  watch.until(long_form() ? 2 : 0.7);
  report("heap", "poured on while folded", watch,
         {.speed = not_gated, .energy = not_gated, .nearest = 0, .blow_ups = 1});
}

/// A ball of cotton of 0.1 m with as much water in it as fits half a spacing away.
Shot pouch(const test::TemporaryFolder& folder, V3d velocity) {
  const double radius = 0.1;
  Shot shot = water(radius / 7);
  shot.domain.axis[1] = Axis::walls;
  TriangleMesh mesh = test::unit_sphere(14, 20);
  for (V3f& x : mesh.position) x *= float(radius);
  Cloth& bag = add_mesh(shot, mesh, folder);
  bag.model = ClothModel::shell, bag.velocity = velocity;
  shot.fluid.sphere.push_back(
      {V3d(0), radius - 0.55 * shot.fluid.spacing - 0.5 * bag.thickness - 0.02 * radius, velocity});
  return shot;
}

TEST(ShellPouch, HungHoldsItsWater) {
  const test::TemporaryFolder folder;
  Shot shot = pouch(folder, V3d(0));
  shot.cloth[0].pin.push_back({{}, {{V3d(-0.05, 0.085, -0.05), V3d(0.05, 0.2, 0.05)}}});
  ShellWatch watch(shot);
  watch.until(long_form() ? 3 : 0.3);
  report("shell's pouch", "hung", watch, {.energy = no_rule});
}

TEST(ShellPouch, DroppedFromTwoMetresHoldsItsWater) {
  const test::TemporaryFolder folder;
  Shot shot = pouch(folder, V3d(0, -std::sqrt(2 * 9.81 * 2), 0));
  shot.domain.min.y = -0.13;
  ShellWatch watch(shot);
  watch.until(long_form() ? 1 : 0.1);
  report("shell's pouch", "dropped from 2 m", watch, {.speed = 3, .energy = no_rule});
}

/// Two squares that are sewn along all edges; water has been put between them, and they fall.
Shot pillow(double floor) {
  Shot shot = water(0.01);
  shot.domain.min = V3d(-0.5, floor, -0.5), shot.domain.max = V3d(0.5);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  for (const int k : {0, 1}) {
    Cloth& side =
        add_shell(shot, V3d(-0.1, 0.025 * k, -0.1), V3d(0.2, 0, 0), V3d(0, 0, 0.2), V2i(12, 12));
    side.thickness = 0.002;
  }
  for (const GridEdge edge : {GridEdge::u0, GridEdge::u1, GridEdge::v0, GridEdge::v1}) {
    ClothSeam& seam = shot.cloth[0].seam.emplace_back();
    seam.edge = seam.to_edge = edge, seam.to = shot.cloth[1].name, seam.time = 0.05;
  }
  add_box(shot, V3d(-0.06, 0.0075, -0.06), {12, 1, 12});
  return shot;
}

// How it lands is chance: from twelve heights with 56 to 123 % of the speed.
TEST(ShellPillow, HoldsItsWater) {
  for (int k = 0; k < (long_form() ? 12 : 3); ++k) {
    ShellWatch watch(pillow(-0.1 - 0.001 * k));
    watch.until(long_form() ? 2 : 0.4);
    report("pillow", fmt::format("sewn around water, falls on a floor {} mm lower", k), watch,
           {.speed = 2, .energy = no_rule, .nearest = 0});
  }
}

}  // namespace
}  // namespace drench::stress_tests
