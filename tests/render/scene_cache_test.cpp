// What frames share: the same pictures as without, objects that stand are built once, and what
// piles up is let go.

#include <gtest/gtest.h>

#include "render/scene/scene_cache.h"
#include "tests/render/support.h"

namespace drench::render::test {
namespace {

struct Still {
  Shot shot = plain_shot(8, 48);
  FrameGeometry geometry;
  RenderOptions shared;

  Still() {
    add_ground(shot, 0.5f);
    shot.material.push_back(dielectric("water", 1.333, V3f(1, 0.2f, 0.1f)));
    Material varnish = diffuse("varnish", 0.6f);
    varnish.type = MaterialType::coated;
    varnish.roughness = 0.3;
    shot.material.push_back(varnish);
    shot.obstacle.emplace_back();
    shot.obstacle[0].name = "box", shot.obstacle[0].material = "varnish";
    shot.camera.position = V3d(0, 2.5, 5);
    shot.camera.target = V3d(0, 0.5, 0);
    shot.render.motion_blur = true;
    shot.light = {panel({-1, 4, 0}, 0.6, 0.5, 3), sky(0.5f)};
    geometry.fluid = sphere_mesh(3);
    geometry.obstacle = {{"box", box_mesh({0.8f, 0, 0}, {1.4f, 0.8f, 0.6f})}};
    shared.cache = std::make_shared<SceneCache>();
  }
  void move_fluid(float y) {
    for (V3f& p : geometry.fluid.position) p.y += y;
    for (V3f& v : geometry.fluid.velocity) v = {0, 24 * y, 0};
  }
};

TEST(SceneCache, LeaveThePictureAsItIs) {
  Still scene;
  for (const int frame : {1001, 1002, 1003}) {
    scene.move_fluid(0.2f);
    if (frame == 1003) translate(scene.geometry.obstacle[0].mesh, {-0.3f, 0, 0});
    const Film alone = render_frame(scene.shot, frame, scene.geometry);
    EXPECT_EQ(render_frame(scene.shot, frame, scene.geometry, scene.shared).rgba, alone.rgba);
  }
}

TEST(SceneCache, HoldObjectsThatStandBetweenFrames) {
  Still scene;
  scene.move_fluid(0.2f);
  SceneCache& cache = *scene.shared.cache;
  Digest box;
  {
    const Scene frame(scene.shot, 1001, scene.geometry, scene.shared);
    EXPECT_EQ(frame.object(0).contents, Digest{});  // the fluid moves
    box = frame.object(1).contents;
    EXPECT_FALSE(cache.take(box));  // at work
  }
  std::optional<SceneObject> kept = cache.take(box);
  ASSERT_TRUE(kept);
  EXPECT_FALSE(cache.take(box));
  RTCScene built = kept->scene.get();
  cache.give_back(std::move(*kept));
  const Scene next(scene.shot, 1002, scene.geometry, scene.shared);
  EXPECT_EQ(next.object(1).scene.get(), built);
  EXPECT_FALSE(cache.take(box));
}

TEST(SceneCache, LetGoOfWhatCreeps) {
  Still scene;
  std::vector<Digest> contents;
  for (int frame = 1001; frame <= 1006; ++frame) {
    translate(scene.geometry.obstacle[0].mesh, {1e-4f, 0, 0});
    contents.push_back(Scene(scene.shot, frame, scene.geometry, scene.shared).object(1).contents);
  }
  for (size_t k = 0; k < contents.size(); ++k)
    EXPECT_EQ(scene.shared.cache->take(contents[k]).has_value(), k >= 2) << k;
}

}  // namespace
}  // namespace drench::render::test
