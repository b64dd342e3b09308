// Lights against closed forms of irradiance, and the estimators against each other.

#include <gtest/gtest.h>

#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

constexpr float reflectance = 0.5f;

/// Radiance that a diffuse ground shows under an irradiance.
double shown(double irradiance) { return reflectance * irradiance / pi64; }

/// A shot that sees the ground's origin from the side.
Shot ground_shot(int samples) {
  Shot shot = plain_shot(samples);
  add_ground(shot, reflectance);
  aim_narrow(shot, {3, 2, 0}, {0, 0, 0});
  return shot;
}

TEST(RectangleLight, GivesFormFactorOfParallelUnitSquares) {
  // F between unit squares 1 m apart is 0.19982 (Howell, configuration C-11). Seen from far above
  // the picture is the square's plane to scale, so the picture's sum is the power it sends back.
  Shot shot = plain_shot(64, 32);
  add_ground(shot, reflectance, 0.5);
  aim_narrow(shot, {0, 1000, 0}, {0, 0, 0}, 2 * std::atan(1. / 1000) * 180 / pi64);
  shot.light = {panel({0, 1, 0}, 0.5, 0.5, 3)};
  RenderOptions options;
  const Mean mean = mean_over_seeds(shot, {}, options, 16);
  const double seen_area = 4, expected = reflectance * 3 * 0.199825 / seen_area;
  EXPECT_NEAR(mean.value, expected, 4 * mean.error + 1e-4 * expected);
}

TEST(SphereLight, GivesIrradianceOfItsSolidAngle) {
  // E = pi L (r/D)^2 on a plane facing the centre.
  Shot shot = ground_shot(64);
  Light sphere;
  sphere.type = LightType::sphere;
  sphere.center = {0, 1.5, 0};
  sphere.radius = 0.5;
  sphere.radiance = V3f(2);
  shot.light = {sphere};
  const Mean mean = channel_mean(render_frame(shot, 1001, {}), 0);
  EXPECT_NEAR(mean.value, shown(pi64 * 2 * (0.5 * 0.5) / (1.5 * 1.5)), bound(mean));
}

Light disk(const V3d& center, const V3d& direction, double radius, float radiance) {
  Light light;
  light.type = LightType::disk;
  light.center = center;
  light.direction = direction;
  light.radius = radius;
  light.radiance = V3f(radiance);
  return light;
}

TEST(DiskLight, GivesItsIrradianceOnTheAxis) {
  // E = pi L r^2 / (r^2 + D^2), and nothing on the side it turns away from.
  Shot shot = ground_shot(256);
  shot.light = {disk({0, 1.5, 0}, {0, -2, 0}, 0.8, 2)};
  const Mean mean = channel_mean(render_frame(shot, 1001, {}), 0);
  EXPECT_NEAR(mean.value, shown(pi64 * 2 * 0.64 / (0.64 + 1.5 * 1.5)), bound(mean));
  shot.light[0].direction = {0, 1, 0};
  EXPECT_EQ(channel_mean(render_frame(shot, 1001, {}), 0).value, 0);
}

TEST(SunLight, GivesItsIrradianceTimesCosine) {
  Shot shot = ground_shot(64);
  Light sun;
  sun.type = LightType::sun;
  sun.direction = {std::sin(1.0), -std::cos(1.0), 0};
  sun.radiance = {10, 20, 30};
  shot.light = {sun};
  const Film film = render_frame(shot, 1001, {});
  for (int c = 0; c < 3; ++c) {
    const Mean mean = channel_mean(film, c);
    // A disc of half angle a has mean cosine cos(1) (1 + O(a^2)), a = 4.6e-3.
    EXPECT_NEAR(mean.value, shown(10 * (c + 1) * std::cos(1.0)), bound(mean) + 3e-5 * mean.value);
  }
}

TEST(SkyLight, GivesPiTimesItsRadiance) {
  for (const auto sampling : {EnvironmentSampling::never, EnvironmentSampling::always}) {
    Shot shot = ground_shot(256);
    shot.light = {sky(0.7f)};
    RenderOptions options;
    options.environment = sampling;
    const Mean mean = channel_mean(render_frame(shot, 1001, {}, options), 0);
    EXPECT_NEAR(mean.value, shown(pi64 * 0.7), bound(mean));
  }
}

TEST(SkyLight, IsSeenThroughTheFilmWhereNothingStandsBefore) {
  Shot shot = plain_shot(4);
  shot.light = {sky(0.25f)};
  const Film film = render_frame(shot, 1001, {});
  EXPECT_FLOAT_EQ(film.rgba[0], 0.25f);
  EXPECT_FLOAT_EQ(film.rgba[3], 1.f);
  shot.light = {};
  EXPECT_FLOAT_EQ(render_frame(shot, 1001, {}).rgba[3], 0.f);
}

TEST(RectangleLight, IsHiddenByWhatStandsBeforeIt) {
  Shot shot = ground_shot(16);
  shot.light = {panel({0, 2, 0}, 0.2, 0.2, 5)};
  TriangleMesh sheet = sheet_mesh(2, [](float, float) { return 1.f; });
  shot.material.push_back(diffuse("cotton", 0));
  EXPECT_GT(channel_mean(render_frame(shot, 1001, {}), 0).value, 0);
  EXPECT_EQ(channel_mean(render_frame(shot, 1001, {{}, {{"cloth", sheet}}}), 0).value, 0);
}

/// A scene of every kind of light, none of it small, over ground and translucent cloth.
struct EveryLight {
  Shot shot = plain_shot(64, 16);
  FrameGeometry geometry;

  explicit EveryLight(const std::filesystem::path& map) {
    add_ground(shot, 0.6f, 3);
    shot.camera.position = V3d(0, 2, 4);
    shot.camera.target = V3d(0, 0.3, 0);
    Light sphere, sun, environment = sky(0.5f);
    sphere.type = LightType::sphere;
    sphere.center = {1.2, 1.5, 0};
    sphere.radius = 0.4;
    sphere.radiance = V3f(4);
    sun.type = LightType::sun;
    sun.direction = {1, -1, -1};
    sun.angle_deg = 40;
    sun.radiance = V3f(1);
    environment.map = map;
    environment.rotation_deg = 30;
    shot.light = {panel({-1, 1.8, 0}, 0.6, 0.5, 3), sphere, sun, environment,
                  disk({0.2, 1.6, -1.2}, {0.2, -1, 0.5}, 0.5, 3)};
    geometry.cloth = {{"cloth", sheet_mesh(16, [](float x, float z) {
                         return 0.6f + 0.1f * std::sin(3 * x) * std::cos(2 * z);
                       })}};
  }
};

/// A map with a bright patch in a dim gradient.
std::filesystem::path write_map(const TemporaryFolder& folder) {
  Film film{32, 16, {}};
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 32; ++x)
      for (float value : {0.5f, 0.6f, 0.8f, 1.f}) {
        const bool bright = x >= 8 && x < 12 && y >= 3 && y < 6;
        film.rgba.push_back(value * (bright ? 8.f : 0.2f + 0.02f * float(15 - y)));
      }
  const auto path = folder / "map.exr";
  write_exr(path, film, {});
  return path;
}

TEST(Estimators, AgreeOnEveryKindOfLight) {
  const TemporaryFolder folder;
  const EveryLight scene(write_map(folder));
  expect_estimators_agree(scene.shot, scene.geometry);
}

TEST(EnvironmentMap, ShowsRotatedColumnsAndUpwardRows) {
  // Top row red, left half of the rest green, right half blue: -Z is the middle column.
  Film film{8, 4, {}};
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 8; ++x) {
      const V3f rgb = y == 0 ? V3f(1, 0, 0) : x < 4 ? V3f(0, 1, 0) : V3f(0, 0, 1);
      film.rgba.insert(film.rgba.end(), {rgb.x, rgb.y, rgb.z, 1});
    }
  const TemporaryFolder folder;
  const auto path = folder / "axes.exr";
  write_exr(path, film, {});
  Shot shot = plain_shot(4, 4);
  shot.light = {sky(1)};
  shot.light[0].map = path;
  const auto seen = [&](const V3d& direction) {
    aim_narrow(shot, {0, 0, 0}, direction);
    const Film picture = render_frame(shot, 1001, {});
    return V3f(picture.rgba[0], picture.rgba[1], picture.rgba[2]);
  };
  EXPECT_LT((seen({0, 1, 0}) - V3f(1, 0, 0)).length(), 1e-3);
  EXPECT_LT((seen({-1, -0.2, 0}) - V3f(0, 1, 0)).length(), 1e-3);
  EXPECT_LT((seen({1, -0.2, 0}) - V3f(0, 0, 1)).length(), 1e-3);
  shot.light[0].rotation_deg = 180;
  EXPECT_LT((seen({1, -0.2, 0}) - V3f(0, 1, 0)).length(), 1e-3);
}

}  // namespace
}  // namespace drench::render::test
