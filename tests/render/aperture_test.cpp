// The shape of what a lens blurs: blades and the squeeze of an anamorphic lens.

#include <gtest/gtest.h>

#include "render/film/filter.h"
#include "render/sampler.h"
#include "render/sampling.h"
#include "render/scene/camera.h"
#include "tests/render/support.h"

namespace drench::render::test {
namespace {

/// Points of the lens that rays leave from, in its radii, right and up.
std::vector<Imath::V2d> lens_points(const Camera& camera, uint32_t count) {
  const ShutterCamera shutter(camera, 1001, 1001, 64, 64);
  std::vector<Imath::V2d> out;
  for (uint32_t k = 0; k < count; ++k) {
    const Sampler sampler(PixelOrder::separate, 1, 0, 0, 17, k);
    const V3f p = shutter.ray<CameraMotion::still, Lens::thin>({32, 32}, sampler.two(1), 0).origin;
    out.push_back({p.x / camera.lens_radius.at(1001), p.y / camera.lens_radius.at(1001)});
  }
  return out;
}

Camera lens_camera() {
  Camera camera;
  camera.position = V3d(0, 0, 0);
  camera.target = V3d(0, 0, -4);
  camera.lens_radius = 0.1;
  camera.focus_distance = 2.0;
  return camera;
}

/// Distance from the middle in a direction to the edge of a polygon with a corner at `rotation`,
/// clockwise from up.
double edge_of_polygon(double x, double y, int blades, double rotation) {
  const double sector = 2 * pi64 / blades;
  double angle = std::fmod(std::atan2(x, y) - rotation, sector);
  if (angle < 0) angle += sector;
  return std::cos(sector / 2) / std::cos(angle - sector / 2);
}

TEST(Aperture, OfBladesIsFilledEvenly) {
  for (const int blades : {3, 6, 7}) {
    Camera camera = lens_camera();
    camera.blades = blades;
    camera.blade_rotation_deg = 20;
    camera.squeeze = 1.5;
    constexpr int rings = 8, sectors = 12, draws = 1 << 17;
    std::vector<int> count(rings * sectors);
    for (const Imath::V2d& p : lens_points(camera, draws)) {
      const double x = p.x * 1.5, y = p.y;
      const double edge = edge_of_polygon(x, y, blades, 20 * pi64 / 180);
      const double part = (x * x + y * y) / (edge * edge);  // uniform, for every direction
      ASSERT_LT(part, 1 + 1e-4);
      // Area swept from the middle, by its fraction.
      const double sector = 2 * pi64 / blades;
      double angle = std::atan2(x, y) - 20 * pi64 / 180;
      if (angle < 0) angle += 2 * pi64;
      const double within = angle - sector * std::floor(angle / sector) - sector / 2;
      const double swept =
          (std::floor(angle / sector) + 0.5 * (1 + std::tan(within) / std::tan(sector / 2))) /
          blades;
      count[std::min(int(part * rings), rings - 1) * sectors +
            std::clamp(int(swept * sectors), 0, sectors - 1)] += 1;
    }
    // Well stratified points: each bin holds its part to 2 %.
    for (const int n : count) EXPECT_NEAR(n, draws / (rings * sectors), 0.02 * n) << blades;
  }
}

TEST(Aperture, OfARoundUnsqueezedLensKeepsItsBits) {
  for (uint32_t k = 0; k < 1000; ++k) {
    const Sampler sampler(PixelOrder::separate, 1, 0, 0, 10, k);
    const ShutterCamera shutter(lens_camera(), 1001, 1001, 64, 64);
    const V2f d = sample_disc(sampler.two(1)) * 0.1f;
    const V3f p = shutter.ray<CameraMotion::still, Lens::thin>({32, 32}, sampler.two(1), 0).origin;
    EXPECT_EQ(p, V3f(1, 0, 0) * d.x + V3f(0, 1, 0) * d.y);
  }
}

/// Moments of a picture of a small ball, pixels: about its middle, right and up.
struct Moments {
  double sum = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
};

constexpr double ball_distance = 4, focus = 2, ball_radius = 0.01, pixels = 32 / 0.05;

Moments moments_of_bokeh(const Camera& shape, double distance, const V3d& aside = V3d(0)) {
  Shot shot = plain_shot(2048, 64);
  shot.camera = shape;
  shot.camera.position = V3d(0, 0, 0);
  shot.camera.target = V3d(0, 0, -4);
  shot.camera.focus_distance = focus;
  shot.camera.lens_radius = 0.1;
  shot.camera.fov_deg = 2 * std::atan(0.05) * 180 / pi64;
  Light ball;
  ball.type = LightType::sphere;
  ball.center = V3d(0, 0, -distance) + aside;
  ball.radius = ball_radius;
  ball.radiance = V3f(1000);
  shot.light = {ball};
  const Film film = render_frame(shot, 1001, {});
  Moments m;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const double value = film.rgba[4 * size_t(y * 64 + x)], h = x + 0.5 - 32, v = 31.5 - y;
      m.sum += value, m.x += value * h, m.y += value * v;
      m.xx += value * h * h, m.xy += value * h * v, m.yy += value * v * v;
    }
  m.x /= m.sum, m.y /= m.sum;
  m.xx = m.xx / m.sum - m.x * m.x, m.yy = m.yy / m.sum - m.y * m.y;
  m.xy = m.xy / m.sum - m.x * m.y;
  return m;
}

/// Of the ball's own disc and the pixel's filter, along one axis.
double own_square(double distance) {
  const PixelFilter filter;
  double square = 0;
  for (int q = 0; q < 4096; ++q)
    square += std::pow(filter.offset({(q + 0.5f) / 4096, 0.5f}).x, 2) / 4096;
  return square + std::pow(pixels * ball_radius / distance, 2) / 4;
}

// A regular n-gon of circumradius R has the mean square radius R^2 (2 + cos(2 pi / n)) / 6, half of
// it along any axis (n > 2); a squeeze divides that along x by its square.
TEST(Bokeh, HasTheMomentsOfItsPolygonAndSqueeze) {
  const double radius = pixels * 0.1 * (1 / focus - 1 / ball_distance);
  for (const auto& [blades, squeeze] : {std::pair(6, 1.), {6, 2.}, {3, 1.}, {0, 2.}}) {
    Camera camera;
    camera.blades = blades;
    camera.squeeze = squeeze;
    camera.blade_rotation_deg = 17;
    const Moments m = moments_of_bokeh(camera, ball_distance);
    const double polar = blades > 0 ? (2 + std::cos(2 * pi64 / blades)) / 6 : 0.5;
    const double axis = radius * radius * polar / 2, own = own_square(ball_distance);
    EXPECT_NEAR(m.xx, axis / (squeeze * squeeze) + own, 0.01 * m.xx) << blades << ' ' << squeeze;
    EXPECT_NEAR(m.yy, axis + own, 0.01 * m.yy) << blades << ' ' << squeeze;
    EXPECT_NEAR(m.xy, 0, 0.01 * m.yy) << blades << ' ' << squeeze;
  }
}

// The field of view is that of the picture as it is shown: what is in focus stays where it is and
// round.
TEST(Bokeh, OfASqueezedLensLeavesTheFieldAsItIs) {
  Camera camera;
  camera.squeeze = 2;
  const Moments m = moments_of_bokeh(camera, focus, {0.05, 0.03, 0});
  EXPECT_NEAR(m.x, pixels * 0.05 / focus, 0.05);
  EXPECT_NEAR(m.y, pixels * 0.03 / focus, 0.05);
  EXPECT_NEAR(m.xx, own_square(focus), 0.02 * m.xx);
  EXPECT_NEAR(m.yy, own_square(focus), 0.02 * m.yy);
}

// Behind the focus a triangle's corner is up, in front of it down.
TEST(Bokeh, StandsUprightBehindTheFocus) {
  const auto third = [](double distance) {
    Shot shot = plain_shot(512, 64);
    shot.camera = lens_camera();
    shot.camera.blades = 3;
    shot.camera.fov_deg = 2 * std::atan(0.05) * 180 / pi64;
    Light ball;
    ball.type = LightType::sphere;
    ball.center = {0, 0, -distance};
    ball.radius = ball_radius;
    shot.light = {ball};
    const Film film = render_frame(shot, 1001, {});
    double sum = 0;
    for (int p = 0; p < 64 * 64; ++p) sum += std::pow(31.5 - p / 64, 3) * film.rgba[4 * p];
    return sum;
  };
  EXPECT_GT(third(4), 0);
  EXPECT_LT(third(1.4), 0);
}

TEST(Aperture, RefusesTwoBladesAndNoWidth) {
  Camera camera = lens_camera();
  camera.blades = 2;
  EXPECT_THROW(ShutterCamera(camera, 1, 1, 8, 8), Error);
  camera.blades = 0;
  camera.squeeze = 0;
  EXPECT_THROW(ShutterCamera(camera, 1, 1, 8, 8), Error);
}

}  // namespace
}  // namespace drench::render::test
