// Field of view, motion blur and depth of field against geometry.

#include <gtest/gtest.h>

#include "render/film/filter.h"
#include "render/integrator/path.h"
#include "render/scene/camera.h"
#include "render/scene/scene.h"
#include "tests/render/strip.h"

namespace drench::render::test {
namespace {

TEST(Camera, SpansItsHorizontalFieldOfView) {
  Camera camera;
  camera.position = V3d(0, 0, 0);
  camera.target = V3d(0, 0, -1);
  camera.fov_deg = 60.0;
  const ShutterCamera shutter(camera, 1001, 1001, 200, 100);
  const V3f left = shutter.ray<CameraMotion::still, Lens::pinhole>({0, 50}, {0, 0}, 0).direction;
  const V3f top = shutter.ray<CameraMotion::still, Lens::pinhole>({100, 0}, {0, 0}, 0).direction;
  EXPECT_NEAR(std::atan2(-left.x, -left.z) * 180 / pi64, 30, 1e-4);
  EXPECT_NEAR(top.y / -top.z, std::tan(pi64 / 6) / 2, 1e-6);
}

TEST(MotionBlur, SpreadsAMovingStripIntoATrapezoid) {
  constexpr double width = 6, travel_distance = 20;
  const Strip strip(width, travel_distance);
  const std::vector<double> dark =
      darkness_of_columns(render_frame(strip.shot, 1001, strip.geometry));
  // Coverage at x over the shutter, then the pixel filter's quantiles.
  const PixelFilter filter;
  const auto coverage = [&](double x) {
    const double from = std::max(x - width / 2, -travel_distance / 2),
                 to = std::min(x + width / 2, travel_distance / 2);
    return std::max(0., to - from) / travel_distance;
  };
  double sum = 0;
  for (int column = 0; column < 64; ++column) {
    double expected = 0;
    for (int q = 0; q < 512; ++q)
      expected += coverage(column + 0.5 - 32 + filter.offset({(q + 0.5f) / 512, 0.5f}).x) / 512;
    // 16 rows of 256 stratified samples: error well below 1/256 of a sample set.
    EXPECT_NEAR(dark[column], expected, 0.01) << column;
    sum += dark[column];
  }
  EXPECT_NEAR(sum, width, 0.01 * width);  // blur moves light, it makes none
}

TEST(MotionBlur, IsCentredOnTheFrame) {
  const Strip strip(4, 16);
  const std::vector<double> dark =
      darkness_of_columns(render_frame(strip.shot, 1001, strip.geometry));
  double sum = 0, moment = 0;
  for (int x = 0; x < 64; ++x) {
    sum += dark[x];
    moment += dark[x] * (x + 0.5 - 32);
  }
  EXPECT_NEAR(moment / sum, 0, 0.05);
}

TEST(MotionBlur, IsLeftOutBelowATenthOfAPixel) {
  const auto features = [](double travel) {
    const Strip strip(4, travel);
    return Scene(strip.shot, 1001, strip.geometry, {}).features();
  };
  EXPECT_EQ(features(0.05) & Feature::motion_blur, 0u);
  EXPECT_NE(features(0.2) & Feature::motion_blur, 0u);
}

TEST(MotionBlur, OfTheCameraEqualsThatOfTheScene) {
  // The camera moving left and the strip moving right give one picture (parallel to the film).
  Strip strip(6, 12), still(6, 0);
  const double reach = 12 * Strip::pixel / 2;
  for (Animated<V3d>* key : {&still.shot.camera.position, &still.shot.camera.target}) {
    const V3d middle = key->keys.front().second;
    key->keys = {{1000.75, middle + V3d(reach, 0, 0)}, {1001.25, middle - V3d(reach, 0, 0)}};
  }
  const auto a = darkness_of_columns(render_frame(strip.shot, 1001, strip.geometry));
  const auto b = darkness_of_columns(render_frame(still.shot, 1001, still.geometry));
  for (int x = 0; x < 64; ++x) EXPECT_NEAR(a[x], b[x], 0.01) << x;
}

TEST(ThinLens, SpreadsAPointOverItsCircleOfConfusion) {
  // A point at distance d, focus f, lens radius a: a disc of radius a |1/f - 1/d| at distance 1,
  // whose mean square radius is half its square. A sphere of radius s adds s^2/2 d^-2 the same way.
  Shot shot = plain_shot(1024, 64);
  const double d = 4, f = 2, lens = 0.1, s = 0.01;
  shot.camera.position = V3d(0, 0, 0);
  shot.camera.target = V3d(0, 0, -d);
  shot.camera.focus_distance = f;
  shot.camera.lens_radius = lens;
  shot.camera.fov_deg = 2 * std::atan(0.05) * 180 / pi64;
  Light sphere;
  sphere.type = LightType::sphere;
  sphere.center = {0, 0, -d};
  sphere.radius = s;
  sphere.radiance = V3f(1000);
  shot.light = {sphere};
  const Film film = render_frame(shot, 1001, {});
  double sum = 0, square = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const double value = film.rgba[4 * size_t(y * 64 + x)];
      sum += value;
      square += value * (std::pow(x + 0.5 - 32, 2) + std::pow(y + 0.5 - 32, 2));
    }
  const double pixels = 32 / 0.05;
  const PixelFilter filter;
  double filter_square = 0;
  for (int q = 0; q < 4096; ++q)
    filter_square += std::pow(filter.offset({(q + 0.5f) / 4096, 0.5f}).x, 2) / 4096;
  const double blur = pixels * lens * (1 / f - 1 / d), disc = pixels * s / d;
  const double expected = blur * blur / 2 + disc * disc / 2 + 2 * filter_square;
  EXPECT_NEAR(square / sum, expected, 0.01 * expected);
}

}  // namespace
}  // namespace drench::render::test
