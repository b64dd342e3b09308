// The same picture for any number of threads, and with skipped features switched on.

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "render/integrator/path.h"
#include "render/scene/scene.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

struct Everything {
  Shot shot = plain_shot(8, 72);
  FrameGeometry geometry;

  Everything() {
    add_ground(shot, 0.5f);
    shot.material.push_back(dielectric("water", 1.333, V3f(1, 0.2f, 0.1f)));
    shot.camera.position = V3d(0, 2.5, 5);
    shot.camera.target = V3d(0, 0.5, 0);
    Light sun;
    sun.type = LightType::sun;
    sun.direction = {1, -1, -1};
    sun.angle_deg = 10;
    shot.light = {panel({-1, 4, 0}, 0.6, 0.5, 3), sun, sky(0.5f)};
    geometry.fluid = sphere_mesh(4);
    translate(geometry.fluid, {0.2f, 0.5f, 0});
    geometry.cloth = {{"cloth", sheet_mesh(24, [](float x, float z) {
                         return 1.7f + 0.1f * std::sin(3 * x) * std::cos(2 * z);
                       })}};
  }
  void move() {
    shot.render.motion_blur = true;
    shot.camera.lens_radius = 0.02;
    for (V3f& v : geometry.fluid.velocity) v = {0, -2, 0};
    for (V3f& v : geometry.cloth[0].mesh.velocity) v = {1, 0, 0};
  }
};

Film on_threads(int threads, const Everything& scene) {
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 16);
  tbb::task_arena arena(threads);
  Film film;
  arena.execute([&] { film = render_frame(scene.shot, 1001, scene.geometry); });
  return film;
}

TEST(RenderedBits, AreTheSameForAnyNumberOfThreads) {
  Everything scene;
  scene.move();
  scene.shot.render.photons = 1;
  const Film one = on_threads(1, scene);
  EXPECT_GT(channel_mean(one, 0).value, 0.05);
  for (int threads : {2, 16}) EXPECT_EQ(on_threads(threads, scene).rgba, one.rgba) << threads;
}

TEST(RenderedBits, OfLampsSeenThroughCalmWaterAreTheSameForAnyNumberOfThreads) {
  Everything scene;
  scene.shot.render.photons = 1;
  scene.geometry.cloth.clear();
  scene.geometry.fluid = box_mesh({-3, -0.1f, -3}, {3, 0.4f, 3});
  RenderStats stats;
  render_frame(scene.shot, 1001, scene.geometry, &stats);
  ASSERT_GT(stats.walked, 0.82);  // so that walks are chosen: a fifth may be left
  const Film one = on_threads(1, scene);
  for (int threads : {2, 16}) EXPECT_EQ(on_threads(threads, scene).rgba, one.rgba) << threads;
}

/// With every light and every feature of the camera.
struct EveryLightAndLens : Everything {
  TemporaryFolder folder;

  EveryLightAndLens() {
    move();
    shot.render.photons = 1;
    shot.camera.blades = 5;
    shot.camera.squeeze = 1.8;
    shot.camera.shutter_opening = shot.camera.shutter_closing = 0.3;
    shot.camera.rolling_shutter = 0.7;
    Light disk;
    disk.type = LightType::disk;
    disk.center = {1, 3, 1};
    shot.light.push_back(disk);
    Film map{64, 32, std::vector<float>(64 * 32 * 4, 0.3f)};
    for (int c = 0; c < 3; ++c) map.rgba[4 * (8 * 64 + 20) + c] = 400;
    write_exr(folder / "map.exr", map, {});
    shot.light[2].map = folder / "map.exr";
    shot.material.push_back(diffuse("lamp", 0.2f));
    shot.material.back().emission = V3f(3);
    Obstacle lamp;
    lamp.material = "lamp";
    shot.obstacle = {lamp};
    TriangleMesh box = box_mesh({-1.5f, 0.5f, 0.5f}, {-1, 0.8f, 1});
    for (V3f& v : box.velocity) v = {3, 1, 0};
    geometry.obstacle = {{lamp.name, box}};
  }
};

TEST(RenderedBits, OfEveryLightAndLensAreTheSameForAnyNumberOfThreads) {
  const EveryLightAndLens scene;
  const Scene built(scene.shot, 1001, scene.geometry, {});
  EXPECT_EQ(built.lights().suns().size(), 2u);
  EXPECT_EQ(built.lights().meshes().size(), 1u);
  const Film one = on_threads(1, scene);
  for (int threads : {2, 16}) EXPECT_EQ(on_threads(threads, scene).rgba, one.rgba) << threads;
}

TEST(RenderedBits, DoNotChangeWhenUnusedFeaturesAreSwitchedOn) {
  RenderOptions forced;
  forced.force_features = Feature::combinations - 1;
  Everything scene;
  const Film with_water = render_frame(scene.shot, 1001, scene.geometry);
  EXPECT_EQ(render_frame(scene.shot, 1001, scene.geometry, forced).rgba, with_water.rgba);
  scene.geometry.fluid = {};
  scene.shot.light = {sky(0.5f)};
  const Film dry = render_frame(scene.shot, 1001, scene.geometry);
  EXPECT_EQ(render_frame(scene.shot, 1001, scene.geometry, forced).rgba, dry.rgba);
  EXPECT_NE(dry.rgba, with_water.rgba);
}

TEST(RenderedBits, DoNotChangeWithAnIdleFeature) {
  // A velocity of zero, a lens of radius zero, an empty sheet: the same variant, the same picture.
  Everything scene;
  const Film plain = render_frame(scene.shot, 1001, scene.geometry);
  scene.shot.render.motion_blur = true;
  scene.shot.camera.lens_radius = 0.0;
  scene.geometry.cloth.push_back({"empty", {}});
  EXPECT_EQ(Scene(scene.shot, 1001, scene.geometry, {}).features(),
            unsigned(Feature::dielectric | Feature::sampled_lights));
  EXPECT_EQ(render_frame(scene.shot, 1001, scene.geometry).rgba, plain.rgba);
}

TEST(RenderedBits, ChangeWithTheSeedAndTheFrame) {
  Everything scene;
  const Film first = render_frame(scene.shot, 1001, scene.geometry);
  EXPECT_NE(render_frame(scene.shot, 1002, scene.geometry).rgba, first.rgba);
  scene.shot.render.seed = 2;
  EXPECT_NE(render_frame(scene.shot, 1001, scene.geometry).rgba, first.rgba);
}

TEST(Progress, RisesToOneAndMayStopTheRender) {
  const Everything scene;
  std::vector<double> fractions;
  render_frame(scene.shot, 1001, scene.geometry, nullptr,
               [&](double fraction) { fractions.push_back(fraction); });
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_EQ(fractions.back(), 1);
  EXPECT_GT(fractions.size(), 4u);
  EXPECT_THROW(render_frame(scene.shot, 1001, scene.geometry, nullptr,
                            [](double) { throw Stopped("enough"); }),
               Stopped);
}

TEST(RenderStats, CountWhatWasTraced) {
  const Everything scene;
  RenderStats stats;
  render_frame(scene.shot, 1001, scene.geometry, &stats);
  EXPECT_EQ(stats.camera_samples, 72u * 72 * 8);
  EXPECT_GE(stats.rays, stats.camera_samples);
  EXPECT_GT(stats.cpu_s, 0);
}

}  // namespace
}  // namespace drench::render::test
