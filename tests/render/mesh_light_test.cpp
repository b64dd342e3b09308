// Objects that shine, against closed forms, other lights and the estimators against each other.

#include "render/light/mesh_light.h"

#include <gtest/gtest.h>

#include "render/integrator/photons.h"
#include "render/sampler.h"
#include "render/scene/scene.h"
#include "tests/render/puddle.h"

namespace drench::render::test {
namespace {

/// A square in y = 0 around the origin that faces down, of two triangles.
TriangleMesh square(float half) {
  TriangleMesh mesh;
  mesh.position = {{-half, 0, -half}, {half, 0, -half}, {half, 0, half}, {-half, 0, half}};
  mesh.triangle = {{0, 1, 2}, {0, 2, 3}};
  mesh.velocity.assign(4, V3f(0));
  return mesh;
}

/// An obstacle of that mesh and radiance.
void add_shining(Shot& shot, FrameGeometry& geometry, TriangleMesh mesh, float radiance,
                 const V3f& place) {
  translate(mesh, place);
  Obstacle obstacle;
  obstacle.name = "lamp" + std::to_string(shot.obstacle.size());
  obstacle.material = obstacle.name;
  Material material = diffuse(obstacle.name, 0);
  material.emission = V3f(radiance);
  shot.material.push_back(material);
  shot.obstacle.push_back(obstacle);
  geometry.obstacle.push_back({obstacle.name, mesh});
}

Shot ground_shot(int samples) {
  Shot shot = plain_shot(samples);
  add_ground(shot, 0.5f);
  aim_narrow(shot, {3, 2, 0}, {0, 0, 0});
  return shot;
}

TEST(MeshLight, GivesFormFactorOfParallelUnitSquares) {
  // F = 0.19982 (Howell, configuration C-11). Seen from just under the light, which hides what is
  // behind it, the picture is the ground's plane to scale, and its sum the power it sends back.
  Shot shot = plain_shot(64, 32);
  add_ground(shot, 0.5f, 0.5);
  aim_narrow(shot, {0, 0.99, 0}, {0, 0, 0}, 2 * std::atan(1. / 0.99) * 180 / pi64);
  FrameGeometry geometry;
  add_shining(shot, geometry, square(0.5f), 3, {0, 1, 0});
  const Mean mean = mean_over_seeds(shot, geometry, {}, 16);
  const double seen_area = 4, expected = 0.5 * 3 * 0.199825 / seen_area;
  EXPECT_NEAR(mean.value, expected, 4 * mean.error + 1e-4 * expected);
}

TEST(MeshLight, OfABallIsASphereLight) {
  Shot shot = ground_shot(256);
  FrameGeometry geometry;
  TriangleMesh ball = sphere_mesh(6);
  for (V3f& p : ball.position) p *= 0.5f;
  add_shining(shot, geometry, ball, 2, {0, 1.5f, 0});
  const Mean mean = mean_over_seeds(shot, geometry, {}, 8);
  const double expected = 0.5 * 2 * 0.25 / (1.5 * 1.5);  // rho L (r / D)^2
  // Chords of 1.4 degrees lie within 7.5e-5 of the ball.
  EXPECT_LT(mean.error, 0.002 * expected);
  EXPECT_NEAR(mean.value, expected, 4 * mean.error + 3e-4 * expected);
}

TEST(MeshLight, ShinesFromItsOuterSideOnly) {
  Shot shot = plain_shot(16);
  FrameGeometry geometry;
  add_shining(shot, geometry, sphere_mesh(3), 2.5f, {0, 0, 0});
  aim_narrow(shot, {0, 0, 5}, {0, 0, 0});
  const Film outside = render_frame(shot, 1001, geometry);
  EXPECT_FLOAT_EQ(outside.rgba[0], 2.5f);
  EXPECT_FLOAT_EQ(outside.rgba[3], 1);
  aim_narrow(shot, {0, 0, 0.2}, {0, 0, 5});
  EXPECT_EQ(channel_mean(render_frame(shot, 1001, geometry), 0).value, 0);
}

// A square that grows through the shutter: the solid angle at any time, 4 asin(a^2 / (a^2 + h^2)),
// from the densities of its samples, which are even by area and those a ray would find.
TEST(MeshLight, IsDrawnByAreaWhereItIsAtTheTime) {
  const TriangleMesh mesh = square(0.5f);
  std::vector<V3f> close = mesh.position;
  for (V3f& p : close) p = p * 3 + V3f(0, 1, 0);
  const MeshLight light({mesh.triangle, {mesh.position.data(), close.data()}}, V3f(1));
  constexpr uint32_t draws = 1 << 16;
  for (const float time : {0.f, 0.4f, 1.f}) {
    const double half = 0.5 * (1 + 2 * time), height = 2 + time;
    const V3f from(0, -2, 0);
    double solid_angle = 0;
    std::vector<double> count(64);
    for (uint32_t k = 0; k < draws; ++k) {
      const Sampler sampler(PixelOrder::separate, 1, 0, 0, 16, k);
      const LightSample s = light.sample(from, time, sampler.two(1));
      ASSERT_GT(s.pdf, 0);
      solid_angle += 1. / s.pdf / draws;
      const V3f p = from + s.direction * s.distance;
      ASSERT_NEAR(p.y, time, 1e-5);
      const auto cell = [&](float x) { return std::clamp(int((x / half + 1) * 4), 0, 7); };
      count[8 * cell(p.x) + cell(p.z)] += 1;
      const uint32_t triangle = p.x > p.z ? 0 : 1;
      if (std::abs(p.x - p.z) > 1e-3) {
        EXPECT_NEAR(light.pdf(triangle, time, s.distance, s.direction.y), s.pdf, 1e-4 * s.pdf);
      }
    }
    const double expected = 4 * std::asin(half * half / (half * half + height * height));
    EXPECT_NEAR(solid_angle, expected, 1e-3 * expected) << time;
    for (const double n : count) EXPECT_NEAR(n, draws / 64., 0.05 * draws / 64) << time;
  }
}

// What a small square sends while it flies past: the mean of L A h^4 / (h^2 + x^2)^2 / h^2.
TEST(MeshLight, ThatMovesLightsAsItFlies) {
  Shot shot = ground_shot(1024);
  aim_narrow(shot, {0, 2, 3}, {0, 0, 0});  // past it
  shot.render.motion_blur = true;
  FrameGeometry geometry;
  TriangleMesh mesh = square(0.02f);
  mesh.velocity.assign(4, V3f(2 * 24 * 2, 0, 0));  // 2 m in a shutter of half a frame
  add_shining(shot, geometry, mesh, 400, {0.5f, 1, 0});
  double irradiance = 0;
  for (int k = 0; k < 1000; ++k) {
    const double x = -0.5 + 2 * (k + 0.5) / 1000;
    irradiance += 400 * 0.04 * 0.04 / std::pow(1 + x * x, 2) / 1000;
  }
  const Mean mean = mean_over_seeds(shot, geometry, {}, 8);
  EXPECT_NEAR(mean.value, 0.5 * irradiance / pi64, 4 * mean.error + 1e-3 * mean.value);
  EXPECT_LT(mean.error, 0.005 * mean.value);
}

TEST(MeshLight, EstimatorsAgree) {
  Shot shot = plain_shot(64, 16);
  add_ground(shot, 0.6f, 3);
  shot.render.motion_blur = true;
  shot.camera.position = V3d(0, 2, 4);
  shot.camera.target = V3d(0, 0.3, 0);
  shot.light = {panel({-1, 1.8, 0}, 0.6, 0.5, 3)};
  FrameGeometry geometry;
  TriangleMesh box = box_mesh({-0.3f, -0.2f, -0.3f}, {0.3f, 0.2f, 0.3f});
  for (V3f& v : box.velocity) v = {0, 20, 10};
  add_shining(shot, geometry, box, 4, {1, 1.2f, 0});
  add_shining(shot, geometry, sphere_mesh(2), 1, {-1.5f, 0.5f, -1.5f});
  geometry.cloth = {{"cloth", sheet_mesh(16, [](float x, float z) {
                       return 0.6f + 0.1f * std::sin(3 * x) * std::cos(2 * z);
                     })}};
  expect_estimators_agree(shot, geometry);
}

/// A wavy pool with a lamp and a ball that shines, above the water or in it.
struct Pool {
  Shot shot = puddle_shot(V3f(0.3f));
  FrameGeometry geometry;

  explicit Pool(const V3f& ball_at, float radius, float radiance) {
    shot.light = {panel({0.8, 2, 0.3}, 0.15, 0.15, 20)};
    geometry.fluid = waves();
    TriangleMesh ball = sphere_mesh(3);
    for (V3f& p : ball.position) p *= radius;
    add_shining(shot, geometry, ball, radiance, ball_at);
  }
};

// Photons bring the lamp's light through water and paths the ball's: the sum is that of paths.
TEST(MeshLight, IsLeftToPathsThroughWaterBesidesPhotons) {
  for (const auto& [place, radius] :
       {std::pair(V3f(-0.6f, 1.2f, 0), 0.3f), {V3f(0.2f, 0.15f, 0.3f), 0.08f}}) {
    Pool pool(place, radius, 6);
    const Mean paths = mean_over_seeds(pool.shot, pool.geometry, {}, 16);
    pool.shot.render.photons = 6;
    EXPECT_TRUE(can_trace_photons(Scene(pool.shot, 1001, pool.geometry, {})));
    const Mean photons = mean_over_seeds(pool.shot, pool.geometry, {}, 16);
    EXPECT_LT(paths.error, 0.01 * paths.value);
    EXPECT_NEAR(photons.value, paths.value,
                4 * std::hypot(photons.error, paths.error) + 0.005 * paths.value);
    pool.shot.light.clear();  // without the lamp there is much less: the ball was seen as well
    const Mean ball = mean_over_seeds(pool.shot, pool.geometry, {}, 4);
    EXPECT_GT(ball.value, 0.1 * paths.value);
    EXPECT_LT(ball.value, 0.9 * paths.value);
  }
}

// In the water it is found by light samples as by chance.
TEST(MeshLight, InWaterIsSampledThere) {
  Pool pool({0.2f, 0.15f, 0.3f}, 0.08f, 6);
  pool.shot.light.clear();
  RenderOptions chance;
  chance.estimator = Estimator::bsdf_only;
  const Mean mis = mean_over_seeds(pool.shot, pool.geometry, {}, 16),
             bsdf = mean_over_seeds(pool.shot, pool.geometry, chance, 16);
  EXPECT_LT(mis.error, 0.5 * bsdf.error);
  EXPECT_NEAR(mis.value, bsdf.value, 4 * std::hypot(mis.error, bsdf.error));
}

// Rays under water are aimed at it: the same mean, with less noise.
TEST(MeshLight, AboveWaterIsAimedAt) {
  Pool pool({-0.6f, 1.5f, 0}, 0.1f, 60);
  pool.shot.camera.fov_deg = 4.0;  // past its reflection
  RenderOptions unaimed;
  unaimed.water_guide = WaterGuide::off;
  for (const double photons : {0., 6.}) {
    pool.shot.render.photons = photons;
    if (photons == 0) pool.shot.light.clear();
    const Mean with = mean_over_seeds(pool.shot, pool.geometry, {}, 16),
               without = mean_over_seeds(pool.shot, pool.geometry, unaimed, 16);
    EXPECT_LT(with.error, 0.7 * without.error) << photons;
    EXPECT_NEAR(with.value, without.value, 4 * std::hypot(with.error, without.error)) << photons;
    pool.shot.light = {panel({0.8, 2, 0.3}, 0.15, 0.15, 20)};
  }
}

}  // namespace
}  // namespace drench::render::test
