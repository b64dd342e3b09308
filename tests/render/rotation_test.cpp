// Obstacles that turn while the shutter is open, against circles and cosines.

#include "render/scene/rotation.h"

#include <gtest/gtest.h>

#include "render/scene/scene.h"
#include "tests/render/support.h"

namespace drench::render::test {
namespace {

constexpr int picture_size = 64;
constexpr double pixel = 0.02, radius = 0.5, half_width = 0.03;  // m

/// A box about the origin that turns by so many degrees a frame, and the scene it is in.
struct Turning {
  Shot shot = plain_shot(256, picture_size);
  FrameGeometry geometry;

  Turning(const V3d& size, const V3d& degrees_a_frame) {
    shot.render.motion_blur = true;
    Obstacle box;
    box.name = "box";
    box.size = size;
    box.material = "box";
    box.rotation_deg.keys = {{991, degrees_a_frame * -10}, {1011, degrees_a_frame * 10}};
    shot.obstacle = {box};
    shot.material.push_back(diffuse("box", 0));
    look();
  }
  /// Takes it as it is in the middle of its course.
  void look() { geometry.obstacle = {{"box", obstacle_surface(shot, shot.obstacle[0], 1001)}}; }

  int keys() const { return int(Scene(shot, 1001, geometry, {}).object(0).key.size()); }
};

/// A blade across the origin in the plane of the picture, before the sky.
Turning blade(double degrees_a_frame) {
  Turning scene({2 * radius, 2 * half_width, 0.01}, {0, 0, degrees_a_frame});
  scene.shot.camera.position = V3d(0, 0, 10);
  scene.shot.camera.target = V3d(0, 0, 0);
  scene.shot.camera.fov_deg = 2 * std::atan(picture_size * pixel / 20) * 180 / pi64;
  scene.shot.light = {sky(1)};
  return scene;
}

/// Its tips stay on their circle, and each ring has the darkness of the blade's area in it, spread
/// over the angle that it sweeps. Straight courses would reach out by 8 % and miss both.
TEST(RotationalMotion, KeepsABladeInItsCircle) {
  const double sweep = 0.5 * 90;  // degrees: the shutter is open for half a frame
  const Turning scene = blade(90);
  ASSERT_EQ(scene.shot.camera.shutter_close - scene.shot.camera.shutter_open, 0.5);
  const Film film = render_frame(scene.shot, 1001, scene.geometry);
  double ring = 0, beyond = 0, square = 0;
  const double inner = 0.3, outer = 0.46;
  for (int y = 0; y < picture_size; ++y)
    for (int x = 0; x < picture_size; ++x) {
      const double dark = 1 - film.rgba[4 * size_t(y * picture_size + x)];
      const double px = (x + 0.5 - picture_size / 2.) * pixel,
                   py = (y + 0.5 - picture_size / 2.) * pixel;
      const double r = std::hypot(px, py), angle = std::atan(py / px) * 180 / pi64;
      if (r > inner && r < outer) ring += dark, square += dark * angle * angle;
      if (r > std::hypot(radius, half_width) + 2 * pixel) beyond += dark;
    }
  // Both arms; a straight bar between two circles, whose arcs are a little longer.
  const double expected = 2 * 2 * half_width * (outer - inner) / (pixel * pixel);
  EXPECT_NEAR(ring, expected, 0.02 * expected);
  EXPECT_EQ(beyond, 0);
  // Uniform over the sweep, and the blade's own width at these radii.
  const double width = 2 * half_width / ((inner + outer) / 2) * 180 / pi64;
  EXPECT_NEAR(std::sqrt(square / ring), std::sqrt((sweep * sweep + width * width) / 12), 0.4);
}

/// Keys of its place and velocities of its vertices say the same of what slides.
TEST(RotationalMotion, SlidesAsVelocitiesSay) {
  Turning keyed({0.5, 0.3, 0.2}, {0, 0, 0});
  keyed.shot.camera.position = V3d(0, 0.4, 10);
  keyed.shot.camera.target = V3d(0, 0, 0);
  keyed.shot.camera.fov_deg = 2 * std::atan(picture_size * pixel / 20) * 180 / pi64;
  keyed.shot.light = {sky(1)};
  keyed.shot.material.back().reflectance = V3f(0.5f);
  const V3d velocity(0.3, -0.2, 1);  // m a frame
  keyed.shot.obstacle[0].position.keys = {{991, velocity * -10}, {1011, velocity * 10}};
  keyed.look();

  Turning given = keyed;
  given.shot.obstacle[0].position.keys = {{1001, {0, 0, 0}}};
  given.look();
  TriangleMesh& mesh = given.geometry.obstacle[0].mesh;
  mesh.velocity.assign(mesh.position.size(), V3f(velocity * given.shot.timeline.fps));
  const Film a = render_frame(keyed.shot, 1001, keyed.geometry),
             b = render_frame(given.shot, 1001, given.geometry);
  double most = 0, moved = 0;
  given.shot.render.motion_blur = false;
  const Film still = render_frame(given.shot, 1001, given.geometry);
  for (size_t p = 0; p < a.rgba.size(); ++p) {
    most = std::max(most, double(std::abs(a.rgba[p] - b.rgba[p])));
    moved = std::max(moved, double(std::abs(a.rgba[p] - still.rgba[p])));
  }
  EXPECT_GT(moved, 0.3);
  EXPECT_LT(most, 1e-3);
}

/// A face that turns about an edge under a sun: the mean cosine over the shutter.
TEST(RotationalMotion, TurnsNormalsToo) {
  Turning scene({1, 1, 1}, {0, 0, 80});
  scene.shot.obstacle[0].rotation_deg.keys = {{991, {0, 0, -800 + 50}}, {1011, {0, 0, 800 + 50}}};
  scene.look();
  scene.shot.material.back().reflectance = V3f(0.5f);
  Light sun;
  sun.type = LightType::sun;
  sun.name = "sun";
  sun.direction = {0, -1, 0};
  sun.angle_deg = 0.1;
  sun.radiance = V3f(1);  // W/m^2 on a surface that faces it
  scene.shot.light = {sun};
  // Along the axis of its turn, at the middle of its right upper side.
  const double tilt = 50 * pi64 / 180, half = 20 * pi64 / 180;
  aim_narrow(scene.shot, V3d(-3 * std::sin(tilt), 3 * std::cos(tilt), 0), V3d(0, 0, 0));
  const Mean mean = mean_over_seeds(scene.shot, scene.geometry, {}, 4);
  const double expected = 0.5 / pi64 * std::cos(tilt) * std::sin(half) / half;
  EXPECT_NEAR(mean.value, expected, 4 * mean.error + 1e-3 * expected);
}

/// Paths that meet it and samples of it as a light.
TEST(RotationalMotion, OfWhatShinesAgreesForAllEstimators) {
  Turning scene({0.8, 0.1, 0.3}, {30, 0, 90});
  scene.shot.material.back().emission = V3f(5);
  scene.shot.render.width = scene.shot.render.height = 16;
  scene.shot.ground.height = -0.6;
  add_ground(scene.shot, 0.5f);
  scene.shot.camera.position = V3d(0.3, 3, 0.2);
  scene.shot.camera.target = V3d(0.3, -0.6, 0);
  scene.shot.camera.fov_deg = 30.0;
  expect_estimators_agree(scene.shot, scene.geometry);
}

TEST(RotationalMotion, TakesKeysOnlyWhereItsBendShows) {
  EXPECT_EQ(blade(0.5).keys(), 0);
  const int some = blade(30).keys(), many = blade(60).keys();
  EXPECT_GT(some, 2);
  EXPECT_GT(many, some);
  EXPECT_LE(blade(350).keys(), 17);

  Turning slides({0.5, 0.5, 0.5}, {0, 0, 0});
  slides.shot.obstacle[0].position.keys = {{991, {-5, 0, 0}}, {1011, {5, 0, 0}}};
  slides.look();
  EXPECT_EQ(slides.keys(), 0);
  slides.shot.obstacle[0].position.keys = {
      {991, {0, 0, 0}}, {1001, {0.4, 0, 0}}, {1002, {0, 0, 0}}};
  slides.look();
  EXPECT_GT(slides.keys(), 0) << "it turns back while the shutter is open";

  Turning still = blade(60);
  still.shot.render.motion_blur = false;
  EXPECT_EQ(still.keys(), 0);
}

}  // namespace
}  // namespace drench::render::test
