// Dielectric bodies in one place: glass in water, water in glass, a camera within.

#include <gtest/gtest.h>

#include "tests/render/support.h"

namespace drench::render::test {
namespace {

constexpr double water_index = 1.333, glass_index = 1.5;

double one_face(double a, double b) { return std::pow((a - b) / (a + b), 2); }

ObstacleFrame glass(const TriangleMesh& mesh) { return {"glass", mesh}; }

/// Water from -1.2 to -0.3 m and glass from -0.5 to 0, both 20 m wide, so that both lie in a layer
/// of 0.2 m; seen straight from above, under a panel above or below.
struct Layers {
  Shot shot = plain_shot(1024);
  FrameGeometry geometry;
  double depth_of_glass;  // as the priorities have it

  Layers(int water_priority, Facing light) : depth_of_glass(water_priority > 0 ? 0.3 : 0.5) {
    shot.material = {dielectric("water", water_index, V3f(0.3f, 0.8f, 0)),
                     dielectric("glass", glass_index, V3f(1.1f, 0.2f, 0))};
    shot.material[0].priority = water_priority;
    shot.obstacle.emplace_back();
    shot.obstacle.back().name = shot.obstacle.back().material = "glass";
    aim_narrow(shot, {0, 5, 0}, {0, 0, 0});
    shot.light = {panel({0, light == Facing::down ? 10. : -10., 0}, 3, 3, 1, light)};
    geometry.fluid = box_mesh({-10, -1.2f, -10}, {10, -0.3f, 10});
    geometry.obstacle = {glass(box_mesh({-10, -0.5f, -10}, {10, 0, 10}))};
  }

  /// Of all reflections between the three faces; one way through glass and through water keeps g
  /// and w.
  double expected(int channel, Facing light) const {
    const double top = one_face(1, glass_index), middle = one_face(glass_index, water_index),
                 bottom = one_face(water_index, 1);
    const double g = std::exp(-shot.material[1].absorption[channel] * depth_of_glass),
                 w = std::exp(-shot.material[0].absorption[channel] * (1.2 - depth_of_glass));
    const double below = 1 / (1 - middle * bottom * w * w);
    const double reflected = middle + std::pow((1 - middle) * w, 2) * bottom * below,
                 passed = (1 - middle) * (1 - bottom) * w * below;
    const double above = 1 / (1 - top * reflected * g * g);
    return light == Facing::down ? top + std::pow((1 - top) * g, 2) * reflected * above
                                 : (1 - top) * g * passed * above;
  }
};

TEST(NestedBodies, AreLayersOfTheHigherOne) {
  for (const int priority : {-3, 0, 1})
    for (const Facing light : {Facing::down, Facing::up}) {
      const Layers layers(priority, light);
      const Film film = render_frame(layers.shot, 1001, layers.geometry);
      for (int c = 0; c < 3; ++c) {
        const Mean mean = channel_mean(film, c);
        EXPECT_LT(mean.error, 0.002);
        EXPECT_NEAR(mean.value, layers.expected(c, light), bound(mean)) << priority << ' ' << c;
      }
    }
}

/// A ball of glass that sinks into a pool over the ground.
struct Sunk {
  Shot shot = plain_shot(64);
  FrameGeometry geometry;

  Sunk() {
    shot.material = {dielectric("water", water_index), dielectric("glass", glass_index)};
    shot.obstacle.emplace_back();
    shot.obstacle.back().name = shot.obstacle.back().material = "glass";
    geometry.fluid = box_mesh({-3, -0.1f, -3}, {3, 0.8f, 3});
    TriangleMesh ball = sphere_mesh(4);
    for (V3f& p : ball.position) p = p * 0.35f + V3f(0, 0.9f, 0);
    geometry.obstacle = {glass(ball)};
    shot.camera.fov_deg = 30.0;
  }
};

// Where all that is seen shines alike, glass and water are invisible, from above and from within.
TEST(NestedBodies, LoseNoLight) {
  for (const V3d& from : {V3d(0, 3, 3), V3d(0.1, 1.2, 0), V3d(0.1, 0.6, 0), V3d(1, 0.4, 1)}) {
    Sunk scene;
    scene.shot.light = {sky(1)};
    scene.shot.camera.position = from;
    scene.shot.camera.target = V3d(0, 0.85, 0.02);
    const Film film = render_frame(scene.shot, 1001, scene.geometry);
    for (int c = 0; c < 3; ++c) {
      const Mean mean = channel_mean(film, c);
      EXPECT_NEAR(mean.value, 1, bound(mean) + 1e-4) << from << ' ' << c;
    }
  }
}

// Photons start on every body; one that goes on through another lies where paths would end.
TEST(NestedBodies, HaveTheCausticsThatPathsGive) {
  Sunk scene;
  add_ground(scene.shot, 0.5f, 6);
  scene.shot.render.samples = 512;
  scene.shot.camera.position = V3d(2.5, 2.5, 0);  // past the ball to the ground behind it
  scene.shot.camera.target = V3d(-0.69, 0, -0.13);
  scene.shot.camera.fov_deg = 8.0;
  scene.shot.light = {panel({0.4, 3, 0.3}, 0.3, 0.3, 40), sky(0.2f)};
  const Mean paths = mean_over_seeds(scene.shot, scene.geometry, {}, 16);
  scene.shot.render.photons = 6;
  const Mean photons = mean_over_seeds(scene.shot, scene.geometry, {}, 16);
  EXPECT_LT(paths.error, 0.01 * paths.value);
  EXPECT_NEAR(photons.value, paths.value,
              4 * std::hypot(photons.error, paths.error) + 0.005 * paths.value);
}

TEST(NestedBodies, AreRefusedBeyondTheirNumber) {
  Sunk scene;
  scene.geometry.obstacle.assign(32, scene.geometry.obstacle[0]);
  try {
    render_frame(scene.shot, 1001, scene.geometry);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("33 obstacles and fluids"), std::string::npos);
  }
}

}  // namespace
}  // namespace drench::render::test
