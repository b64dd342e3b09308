// Bad input: one message that says what, where and what to do.

#include <gtest/gtest.h>

#include <limits>

#include "tests/render/support.h"

namespace drench::render::test {
namespace {

Shot small_shot() {
  Shot shot = plain_shot(1, 4);
  add_ground(shot, 0.5f);
  shot.light = {sky(1)};
  return shot;
}

/// The error of rendering, or "" if there was none.
std::string error_of(const Shot& shot, const FrameGeometry& geometry = {}) {
  try {
    render_frame(shot, 1001, geometry);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

::testing::AssertionResult says(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    if (text.find(word) == std::string::npos)
      return ::testing::AssertionFailure() << "'" << text << "' lacks '" << word << "'";
  return ::testing::AssertionSuccess();
}

TEST(BadInput, NothingIsSaidOfAGoodShot) { EXPECT_EQ(error_of(small_shot()), ""); }

TEST(BadInput, LightsWithoutExtentAreNamed) {
  Shot shot = small_shot();
  shot.light = {panel({0, 1, 0}, 1, 0, 1)};
  EXPECT_TRUE(says(error_of(shot), {"panel", "area"}));
  Light light;
  light.name = "bulb";
  light.type = LightType::sphere;
  light.radius = 0;
  shot.light = {light};
  EXPECT_TRUE(says(error_of(shot), {"bulb", "radius"}));
  light.type = LightType::sun;
  light.angle_deg = 0;
  shot.light = {light};
  EXPECT_TRUE(says(error_of(shot), {"bulb", "angle_deg"}));
  light.angle_deg = 1;
  light.direction = {0, 0, 0};
  shot.light = {light};
  EXPECT_TRUE(says(error_of(shot), {"bulb", "direction"}));
}

TEST(BadInput, NegativeLightAndASecondSkyAreRefused) {
  Shot shot = small_shot();
  shot.light = {sky(-1)};
  EXPECT_TRUE(says(error_of(shot), {"sky", "negative"}));
  shot.light = {sky(1), sky(2)};
  EXPECT_TRUE(says(error_of(shot), {"sky", "one environment"}));
}

TEST(BadInput, MissingMapAndTextureAreNamed) {
  Shot shot = small_shot();
  shot.light[0].map = "/nowhere/sky.exr";
  EXPECT_TRUE(says(error_of(shot), {"/nowhere/sky.exr"}));
  shot = small_shot();
  shot.material[0].texture = "/nowhere/floor.png";
  EXPECT_TRUE(says(error_of(shot), {"/nowhere/floor.png"}));
}

TEST(BadInput, UnknownMaterialIsNamed) {
  Shot shot = small_shot();
  shot.ground.material = "marble";
  EXPECT_TRUE(says(error_of(shot), {"marble", "[[material]]"}));
}

TEST(BadInput, OpenSurfaceOfADielectricIsRefused) {
  Shot shot = small_shot();
  shot.ground.material = "water";
  EXPECT_TRUE(says(error_of(shot), {"ground", "closed"}));
  shot = small_shot();
  Cloth cloth;
  cloth.name = "veil";
  cloth.material = "water";
  shot.cloth = {cloth};
  const FrameGeometry geometry{{}, {{"veil", sheet_mesh(1, [](float, float) { return 1.f; })}}};
  EXPECT_TRUE(says(error_of(shot, geometry), {"veil", "closed"}));
}

TEST(BadInput, CameraThatLooksNowhereIsRefused) {
  Shot shot = small_shot();
  shot.camera.target = shot.camera.position;
  EXPECT_TRUE(says(error_of(shot), {"camera", "target"}));
  shot.camera.position = V3d(0, 1, 0);
  shot.camera.target = V3d(0, 0, 0);
  EXPECT_TRUE(says(error_of(shot), {"camera", "up"}));
  shot = small_shot();
  shot.camera.fov_deg = 180.0;
  EXPECT_TRUE(says(error_of(shot), {"fov_deg"}));
}

TEST(BadInput, BrokenMeshIsRefused) {
  const TriangleMesh good = sheet_mesh(1, [](float, float) { return 1.f; });
  const Shot shot = small_shot();
  EXPECT_EQ(error_of(shot, {{}, {{"cloth", good}}}), "");
  TriangleMesh mesh = good;
  mesh.triangle[0].x = 99;
  EXPECT_TRUE(says(error_of(shot, {{}, {{"cloth", mesh}}}), {"cloth", "triangle 0"}));
  mesh = good;
  mesh.position[2].y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(says(error_of(shot, {{}, {{"cloth", mesh}}}), {"cloth", "vertex 2"}));
  mesh = good;
  mesh.velocity.pop_back();
  EXPECT_TRUE(says(error_of(shot, {{}, {{"cloth", mesh}}}), {"cloth", "velocities"}));
  mesh = good;
  mesh.position[1] = mesh.position[0];  // a degenerate triangle is met by no ray, and does no harm
  EXPECT_EQ(error_of(shot, {{}, {{"cloth", mesh}}}), "");
}

TEST(BadInput, ImpossibleSettingsAreRefused) {
  Shot shot = small_shot();
  shot.render.samples = 0;
  EXPECT_TRUE(says(error_of(shot), {"render.samples"}));
  shot = small_shot();
  shot.render.width = 1 << 20;
  EXPECT_TRUE(says(error_of(shot), {"render"}));
  shot = small_shot();
  shot.material[0].reflectance = V3f(1.5f);
  EXPECT_TRUE(says(error_of(shot), {"ground", "reflectance"}));
  shot = small_shot();
  shot.render.motion_blur = true;
  std::swap(shot.camera.shutter_open, shot.camera.shutter_close);
  EXPECT_TRUE(says(error_of(shot), {"shutter"}));
}

}  // namespace
}  // namespace drench::render::test
