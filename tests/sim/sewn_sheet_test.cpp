// Sheets whose file has several vertices at one point, as exporters split them at seams of the
// texture: one sheet all the same.

#include <gtest/gtest.h>

#include <numeric>

#include "pipeline/contract/log.h"
#include "sim/setup/scene.h"
#include "sim/simulator.h"
#include "tests/sim/support.h"
#include "tests/temporary_folder.h"

namespace drench::sim_tests {
namespace {

using test::TemporaryFolder;

constexpr int cells = 4;  // of a square sheet of 0.4 m, each way

/// A sheet in x, z as an OBJ. `split` writes the line x = 0.2 twice, `apart` m from itself; `stray`
/// puts a vertex that nothing uses before all others.
std::string sheet_text(bool split, double apart, bool stray) {
  std::string text = stray ? "v 9 9 9\n" : "";
  int next = stray ? 2 : 1;
  int left[cells + 1][cells + 1], right[cells + 1][cells + 1];
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const auto put = [&](double x) {
        text += "v " + std::to_string(x) + " 0 " + std::to_string(0.1 * j) + "\n";
        return next++;
      };
      left[i][j] = right[i][j] = put(0.1 * i);
      if (split && i == cells / 2) right[i][j] = put(0.1 * i + apart);
    }
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const auto& side = i < cells / 2 ? left : right;
      text += "f";
      for (const auto& [a, b] : {std::pair{i, j}, {i, j + 1}, {i + 1, j + 1}, {i + 1, j}})
        text += " " + std::to_string(side[a][b]);
      text += "\n";
    }
  }
  return text;
}

Cloth cloth_of(const TemporaryFolder& folder, const std::string& text) {
  test::write_quickly(folder / "sheet.obj", text);
  Cloth cloth;
  cloth.name = "banner", cloth.mesh_file = folder / "sheet.obj";
  return cloth;
}

double mass_of(const sim::Sheet& sheet) {
  return std::accumulate(sheet.mass.begin(), sheet.mass.end(), 0.0);
}

TEST(SewnSheet, HasOneNodeForAPointAndSaysSo) {
  const TemporaryFolder folder;
  const sim::Sheet whole = sim::build_sheet(cloth_of(folder, sheet_text(false, 0, false)));
  forget_warnings();
  const sim::Sheet sewn = sim::build_sheet(cloth_of(folder, sheet_text(true, 0, false)));
  EXPECT_EQ(sewn.position.size(), whole.position.size() + cells + 1);
  EXPECT_EQ(sewn.point.size(), whole.point.size());
  EXPECT_EQ(sewn.spring.size(), whole.spring.size());
  EXPECT_NEAR(mass_of(sewn), mass_of(whole), 1e-12);
  ASSERT_EQ(logged_warnings().size(), 1u);
  EXPECT_NE(logged_warnings()[0].text.find("5 vertices"), std::string::npos);
  forget_warnings();
}

TEST(SewnSheet, IsSewnWithinTheDistanceOnly) {
  const TemporaryFolder folder;
  const size_t points = (cells + 1) * (cells + 1);
  Cloth cloth = cloth_of(folder, sheet_text(true, 1e-6, false));
  EXPECT_EQ(sim::build_sheet(cloth).point.size(), points);
  cloth.weld = 0;
  EXPECT_EQ(sim::build_sheet(cloth).point.size(), points + cells + 1);
  cloth = cloth_of(folder, sheet_text(true, 1e-3, false));
  EXPECT_EQ(sim::build_sheet(cloth).point.size(), points + cells + 1);
  cloth.weld = 2e-3;
  EXPECT_EQ(sim::build_sheet(cloth).point.size(), points);
  forget_warnings();
}

TEST(SewnSheet, PinsNameVerticesOfTheFile) {
  const TemporaryFolder folder;
  Cloth cloth = cloth_of(folder, sheet_text(false, 0, true));
  cloth.pin.push_back(ClothPin{{1, 26 - 1}, {}});  // the first and the last corner
  const sim::Sheet sheet = sim::build_sheet(cloth);
  ASSERT_EQ(sheet.position.size(), 25u);
  EXPECT_TRUE(sheet.pinned[0]);
  EXPECT_TRUE(sheet.pinned[24]);
  EXPECT_EQ(std::count(sheet.pinned.begin(), sheet.pinned.end(), true), 2);
  cloth.pin[0] = ClothPin{{0}, {}};  // the stray one
  EXPECT_THROW(sim::build_sheet(cloth), Error);
  forget_warnings();
}

// Held at one edge and let go for 5 frames, the lowest point of a sewn sheet is that of a whole
// one, to the bit: the same nodes in the same order.
TEST(SewnSheet, FallsAsAWholeOne) {
  const TemporaryFolder folder;
  std::vector<float> lowest;
  for (const bool split : {false, true}) {
    Shot shot = empty_shot();
    shot.gravity = V3d(0, -9.81, 0);
    shot.cloth.push_back(cloth_of(folder, sheet_text(split, 0, false)));
    ClothPin pin;
    pin.box = {{V3d(-0.01), V3d(0.01, 0.01, 0.41)}};
    shot.cloth[0].pin.push_back(pin);
    Simulator simulator(shot, {});
    for (int k = 0; k < 5; ++k) simulator.advance_frame();
    const TriangleMesh mesh = simulator.cloth()[0].mesh;
    EXPECT_EQ(mesh.point.empty(), !split);
    float low = 0;
    for (const Imath::V3f& p : mesh.position) low = std::min(low, p.y);
    lowest.push_back(low);
  }
  EXPECT_LT(lowest[0], -0.05f);
  EXPECT_EQ(lowest[0], lowest[1]);
  forget_warnings();
}

}  // namespace
}  // namespace drench::sim_tests
