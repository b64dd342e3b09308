// Shells that meet themselves, each other and obstacles: piles, heaps, twists and wringing.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/contract/files/mesh_file.h"
#include "tests/contract/shells_mesh.h"
#include "tests/sim/obstacle_scenes.h"
#include "tests/stress/shell_scenes.h"
#include "tests/stress/shell_watch.h"

namespace drench::stress_tests {
namespace {

/// Pins or plates do work.
constexpr ShellGates pulled{.energy = no_rule};
/// Rows of contact are soft beside a sheet that pins or plates pull (docs/stress.md): what is
/// driven may jam and blow up, which the solver tells. It does not cross.
constexpr ShellGates driven{.speed = not_gated, .energy = no_rule, .nearest = 0, .blow_ups = 1};

std::vector<int> one_or(const std::vector<int>& more) {
  return long_form() ? more : std::vector{more[0]};
}
std::vector<double> one_or(const std::vector<double>& more) {
  return long_form() ? more : std::vector{more[0]};
}

class ShellPile : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Layers, ShellPile, testing::ValuesIn(one_or(std::vector{10, 50})));

TEST_P(ShellPile, FallsAndStaysApart) {
  ShellWatch watch(pile(GetParam(), GetParam() > 10 ? 6 : 10));
  watch.until(long_form() ? 2 : GetParam() > 10 ? 0.2 : 0.4);
  report("pile of shells", fmt::format("{} layers", GetParam()), watch, {},
         fmt::format("{:.3f} m/s at the end", watch.last_speed()));
}

TEST(ShellHeap, StandingSheetFoldsUp) {
  ShellWatch watch(standing(long_form() ? 56 : 28));
  watch.until(long_form() ? 2 : 1);
  ShellGates gates;
  if (long_form()) gates.energy = not_gated;
  report("heap", "sheet that stands on an edge", watch, gates);
}

class ShellTwist : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Turns, ShellTwist, testing::ValuesIn(one_or(std::vector{10., 30.})));

TEST_P(ShellTwist, NeitherBlowsUpNorCrosses) {
  const double seconds = long_form() ? 4 : 1;
  ShellWatch watch(twisted_strip(1, 0.02, V2i(100, 2), GetParam(), 0.3, seconds));
  watch.until(seconds);
  report("twist", fmt::format("strip, {:g} turns", GetParam()), watch,
         GetParam() > 10 ? driven : pulled);
}

TEST(ShellWrung, TowelNeitherBlowsUpNorCrosses) {
  const double seconds = long_form() ? 4 : 1;
  ShellWatch watch(
      twisted_strip(0.4, 0.2, long_form() ? V2i(64, 32) : V2i(32, 16), 3, 0.15, seconds));
  watch.until(seconds);
  report("twist", "towel, wrung by 3 turns", watch, driven);
}

// Held in its middle, which moves down through a ring that the sheet just fits through.
TEST(ShellRing, SheetIsPulledThrough) {
  if (!long_form()) GTEST_SKIP() << "36 CPU s: DRENCH_STRESS=long";
  const test::TemporaryFolder folder;
  Shot shot = water(0.02);
  write_mesh(folder / "ring.ply", test::torus(0.05F, 0.012F, 48, 24));
  Obstacle& ring = add_obstacle(shot, ObstacleType::mesh, V3d(0));
  ring.mesh_file = folder / "ring.ply";
  const int cells = long_form() ? 40 : 24;
  Cloth& sheet =
      add_shell(shot, V3d(-0.15, 0.02, -0.15), V3d(0.3, 0, 0), V3d(0, 0, 0.3), V2i(cells, cells));
  ClothPin& pin = sheet.pin.emplace_back();
  pin.vertices = {uint32_t(cells / 2 * (cells + 1) + cells / 2)};
  pin.position.keys = {{frame_at(shot, 0), V3d(0)}, {frame_at(shot, 1), V3d(0, -0.35, 0)}};
  ShellWatch watch(shot, {}, make_level_set);
  watch.until(1);
  double highest = -1;
  for (const float y : watch.state().cloth_position.y)
    highest = std::max(highest, watch.run.scene.frame.to_world(1, double(y)));
  report("ring", "sheet of 0.3 m through 76 mm", watch, driven,
         fmt::format("highest {:.3f} m at the end", highest));
}

// A standing sheet folds up on the floor, and a plate comes down on the heap.
class ShellSqueezed : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Gaps, ShellSqueezed,
                         testing::ValuesIn(one_or(std::vector{0.03, 0.015, 0.004})));

TEST_P(ShellSqueezed, HeapBetweenPlates) {
  Shot shot = standing(21);
  const double thick = 0.05;
  Obstacle& floor = add_obstacle(shot, ObstacleType::box, V3d(0, -0.025, 0));
  floor.size = V3d(0.9, thick, 0.9);
  Obstacle& plate = add_obstacle(shot, ObstacleType::box, V3d(0));
  plate.size = V3d(0.9, thick, 0.9);
  const auto height = [&](double gap) { return V3d(0, gap + thick / 2, 0); };
  plate.position.keys = {{frame_at(shot, 0), height(0.4)},
                         {frame_at(shot, 0.5), height(0.4)},
                         {frame_at(shot, 1), height(GetParam())},
                         {frame_at(shot, 1.1), height(GetParam())}};
  shot.domain.min.y = -0.1;
  ShellWatch watch(shot, {.driven = 0.8});
  watch.until(1.1);
  report("squeezed", fmt::format("heap between plates {:g} mm apart", 1e3 * GetParam()), watch,
         GetParam() < 0.03 ? driven : pulled);
}

}  // namespace
}  // namespace drench::stress_tests
