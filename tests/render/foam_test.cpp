// Foam as spheres: coverage, brightness, blur and shadows against closed forms.

#include <gtest/gtest.h>

#include <random>

#include "tests/render/support.h"

namespace drench::render::test {
namespace {

FoamFrame spheres(const std::vector<V3f>& centers, float radius) {
  FoamFrame foam;
  for (const V3f& c : centers) {
    foam.position.push_back(c);
    foam.velocity.push_back(V3f(0));
    foam.id.push_back(uint32_t(foam.id.size()));
    foam.age.push_back(0);
    foam.radius.push_back(radius);
    foam.kind.push_back(FoamKind::spray);
  }
  return foam;
}

/// A camera at z = 2 that looks at the origin through 40 degrees; nothing else.
Shot foam_shot(int samples, int size) {
  Shot shot = plain_shot(samples, size);
  shot.camera.position = V3d(0, 0, 2);
  shot.camera.target = V3d(0, 0, 0);
  shot.camera.fov_deg = 40.0;
  return shot;
}

FrameGeometry with_foam(FoamFrame foam) {
  FrameGeometry geometry;
  geometry.foam = std::move(foam);
  return geometry;
}

// A sphere on the axis fills a disc of tan(asin(r / d)) at distance 1, where the picture is
// 2 tan(20 deg) wide.
double coverage(double radius, double distance) {
  const double sine = radius / distance, tan2 = sine * sine / (1 - sine * sine);
  const double half = std::tan(20 * pi64 / 180);
  return pi64 * tan2 / (4 * half * half);
}

TEST(FoamPicture, OfOneSphereCoversItsDisc) {
  for (const float radius : {0.1f, 0.3f, 0.6f}) {
    const Shot shot = foam_shot(64, 64);
    const Film film = render_frame(shot, 1001, with_foam(spheres({V3f(0)}, radius)));
    // Stratified samples of a disc: far less noise than the 0.5 % allowed.
    EXPECT_NEAR(channel_mean(film, 3).value, coverage(radius, 2), 0.005 * coverage(radius, 2))
        << radius;
  }
}

TEST(FoamPicture, IsEmptyWithoutFoam) {
  const Shot shot = foam_shot(4, 16);
  const Film film = render_frame(shot, 1001, with_foam({}));
  for (const float value : film.rgba) EXPECT_EQ(value, 0);
}

// A convex white body alone under an even sky of radiance 1 shows its reflectance, 0.9.
TEST(FoamPicture, IsAsBrightAsItsReflectanceUnderAnEvenSky) {
  Shot shot = foam_shot(256, 16);
  shot.light = {sky(1)};
  aim_narrow(shot, V3d(0, 0, 2), V3d(0.02, 0.03, 0));
  const Film film = render_frame(shot, 1001, with_foam(spheres({V3f(0)}, 0.2f)));
  for (int c = 0; c < 3; ++c) {
    const Mean mean = channel_mean(film, c);
    EXPECT_NEAR(mean.value, 0.9, bound(mean));
  }
}

// Far from the origin, where coordinates are coarse, no sphere may shade itself.
TEST(FoamPicture, DoesNotShadeItselfFarFromTheOrigin) {
  Shot shot = foam_shot(256, 16);
  shot.light = {sky(1)};
  const V3d far(90, 40, -70);
  aim_narrow(shot, far + V3d(0, 0, 0.05), far + V3d(0.0002, 0.0003, 0), 0.5);
  const Film film = render_frame(shot, 1001, with_foam(spheres({V3f(far)}, 0.001f)));
  const Mean mean = channel_mean(film, 0);
  EXPECT_NEAR(mean.value, 0.9, bound(mean) + 2e-3);
}

// Moved across the picture within the shutter: the same coverage, spread along the way.
TEST(FoamPicture, IsBlurredByItsVelocity) {
  Shot shot = foam_shot(256, 64);
  shot.render.motion_blur = true;  // a quarter of a frame to both sides
  FoamFrame foam = spheres({V3f(0)}, 0.05f);
  foam.velocity[0] = V3f(0.8f * 24, 0, 0);  // 0.4 m in the shutter
  const Film film = render_frame(shot, 1001, with_foam(foam));
  // Off the axis a sphere's picture is an ellipse, longer by 1 / cos: at 0.2 of 2 m by 0.5 %, a
  // third of that in the mean, and the distance grows as much.
  EXPECT_NEAR(channel_mean(film, 3).value, coverage(0.05, 2), 0.015 * coverage(0.05, 2));
  const auto alpha = [&](double x) {
    const double half = 2 * std::tan(20 * pi64 / 180);
    const int column = int((x / half + 1) * 32), row = 32;
    return film.rgba[4 * size_t(row * 64 + column) + 3];
  };
  EXPECT_NEAR(alpha(0), 0.1 / 0.4, 0.06);  // a quarter of the time
  EXPECT_GT(alpha(0.19), 0.05);
  EXPECT_GT(alpha(-0.19), 0.05);
  EXPECT_EQ(alpha(0.3), 0);
}

// A ball of radius r at height h over the ground hides a disc of the sky from the point below it:
// (r / h)^2 of the irradiance.
TEST(FoamPicture, ShadesTheGround) {
  Shot shot = plain_shot(1024, 16);
  shot.light = {sky(1)};
  add_ground(shot, 0.5f);
  aim_narrow(shot, V3d(3, 0.02, 0), V3d(0, 0, 0));
  FoamFrame foam = spheres({V3f(0, 1, 0)}, 0.5f);
  Shot dark = shot;
  dark.render.depth = 1;  // without the light that the ball throws back
  const Mean mean = channel_mean(render_frame(dark, 1001, with_foam(foam)), 1);
  EXPECT_NEAR(mean.value, 0.5 * (1 - 0.25), bound(mean));
}

// Bubbles under a level surface: seen, and dimmer than in air by what the interface sends back.
TEST(FoamPicture, IsSeenUnderWater) {
  Shot shot = plain_shot(256, 16);
  shot.light = {sky(1)};
  shot.material.push_back(dielectric("water", 1.333));
  aim_narrow(shot, V3d(0, 3, 0), V3d(0, 0, 0));
  FrameGeometry geometry = with_foam(spheres({V3f(0, -0.5f, 0)}, 0.1f));
  geometry.fluid = box_mesh(V3f(-20, -20, -20), V3f(20, 0, 20));
  const double seen = channel_mean(render_frame(shot, 1001, geometry), 1).value;
  EXPECT_GT(seen, 0.5);
  EXPECT_LT(seen, 1);
}

TEST(FoamPicture, HasTheSameBitsTwiceAndManySpheresAreOneObject) {
  std::mt19937 random(5);
  std::vector<V3f> centers;
  const auto even = [&] { return float(random()) / 4294967296.f - 0.5f; };
  for (int k = 0; k < 100000; ++k) centers.emplace_back(even(), even(), even());
  Shot shot = foam_shot(2, 32);
  shot.light = {sky(1)};
  const FrameGeometry geometry = with_foam(spheres(centers, 0.002f));
  const Film one = render_frame(shot, 1001, geometry), two = render_frame(shot, 1001, geometry);
  EXPECT_EQ(one.rgba, two.rgba);
  EXPECT_GT(channel_mean(one, 3).value, 0.1);
}

TEST(FoamPicture, RefusesWhatCannotBeDrawn) {
  const Shot shot = foam_shot(1, 16);
  FoamFrame foam = spheres({V3f(0), V3f(1)}, 0.1f);
  foam.radius[1] = 0;
  try {
    render_frame(shot, 1001, with_foam(foam));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("particle 1"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace drench::render::test
