// ManifoldWalks to lamps through calm water, against Snell's law in closed form, against
// differences of rays, and the pictures that paths and photons give.

#include "render/integrator/manifold.h"

#include <gtest/gtest.h>

#include <random>

#include "render/bsdf/bsdf_dielectric.h"
#include "render/integrator/photons.h"
#include "tests/render/puddle.h"

namespace drench::render::test {
namespace {

constexpr double water_index = 1.333;

/// Water over a ground of reflectance 0.5.
struct Pool {
  Shot shot = plain_shot(64);
  FrameGeometry geometry;

  explicit Pool(const TriangleMesh& water, float absorption = 0) {
    add_ground(shot, 0.5f, 6);
    shot.material.push_back(dielectric("water", water_index, V3f(absorption)));
    shot.camera.position = V3d(0, 3, 1);
    shot.camera.target = V3d(0, 0, 0);
    shot.camera.fov_deg = 20.0;
    geometry.fluid = water;
  }
  Scene scene() const { return Scene(shot, 1001, geometry, {}); }
};

TriangleMesh level_water() { return box_mesh({-4, -0.1f, -4}, {4, 0.4f, 4}); }

/// A point of the ground.
Surface ground_at(const Scene& scene, float x, float z) {
  const Ray down{{x, 1e-3f, z}, {0, -1, 0}, 0};
  const Hit hit = scene.intersect(down, Coherence::incoherent);
  EXPECT_EQ(hit.kind, Hit::Kind::ground);
  return scene.surface(down, hit);
}

double passes(double a) { return 1 - double(fresnel_reflectance(float(std::cos(a)), water_index)); }

// To a sun: along Snell's direction, d(water) / d(air) = cos(a) / (n^2 cos(b)), (1 - F) e^(-s d).
TEST(ManifoldWalks, FindTheSunThroughLevelWater) {
  for (const double a : {0.1, 0.6, 1.2}) {
    Pool pool(level_water(), 0.7f);
    pool.shot.light = {sun({std::sin(a), -std::cos(a), 0}, 0.5)};
    const Scene scene = pool.scene();
    uint64_t rays = 0;
    const LampPoint lamp = scene.lights().sample_lamp_point({0, 0, 0}, 0.5f, {0, 0});
    const auto path =
        manifold_walk(scene, ground_at(scene, 0.1f, 0.2f), 0, scene.fluid(), lamp, rays);
    ASSERT_TRUE(path) << a;
    const double sin_b = std::sin(a) / water_index, cos_b = std::sqrt(1 - sin_b * sin_b);
    EXPECT_NEAR(path->direction.x, -sin_b, 1e-4);
    EXPECT_NEAR(path->direction.y, cos_b, 1e-4);
    EXPECT_NEAR(path->density, std::cos(a) / (water_index * water_index * cos_b), 1e-3);
    EXPECT_NEAR(path->transmittance.x, passes(a) * std::exp(-0.7 * 0.4 / cos_b), 1e-3);
    EXPECT_TRUE(std::isinf(path->distance));
    EXPECT_LE(rays, 2u);
  }
}

// To a point at a height H over water of depth d: r = d tan(b) + (H - d) tan(a), sin(a) = n sin(b),
// found by halving; the density is sin(b) db / (r dr).
TEST(ManifoldWalks, FindAPointThroughLevelWater) {
  constexpr double lamp_height = 2, depth = 0.4;
  Pool pool(level_water());
  pool.shot.light = {panel({0, lamp_height, 0}, 1e-3, 1e-3, 50)};
  const Scene scene = pool.scene();
  const auto reach = [&](double b) {
    return depth * std::tan(b) +
           (lamp_height - depth) * std::tan(std::asin(water_index * std::sin(b)));
  };
  for (const double r : {0.2, 1., 3.}) {
    double low = 0, high = std::asin(1 / water_index) - 1e-9;
    for (int k = 0; k < 60; ++k) (reach((low + high) / 2) < r ? low : high) = (low + high) / 2;
    const double slope = (reach(low + 1e-6) - reach(low - 1e-6)) / 2e-6;
    const Surface ground = ground_at(scene, float(r), 0);
    uint64_t rays = 0;
    const LampPoint lamp = scene.lights().sample_lamp_point(ground.position, 0.5f, {0.5f, 0.5f});
    const auto path = manifold_walk(scene, ground, 0, scene.fluid(), lamp, rays);
    ASSERT_TRUE(path) << r;
    EXPECT_NEAR(path->direction.x, -std::sin(low), 1e-4) << r;
    EXPECT_NEAR(path->density / (std::sin(low) / (r * slope)), 1, 1e-3) << r;
    const double a = std::asin(water_index * std::sin(low));
    EXPECT_NEAR(path->transmittance.x, passes(a), 1e-3) << r;
    EXPECT_NEAR(path->distance, (lamp_height - depth) / std::cos(a), 1e-3) << r;
  }
}

/// Where a ray from under water meets the height of the lamp.
V3f lands(const Scene& scene, const Surface& from, const V3f& direction, float height) {
  const Ray ray{from.leave(direction), direction, 0};
  const Surface face = scene.surface(ray, scene.intersect(ray, Coherence::incoherent));
  const V3f n = interface_normal(direction, face.geometric_normal, face.shading_normal);
  const V3f bent = split_at_interface(direction, n, 1 / float(water_index)).refracted;
  return face.position + bent * ((height - face.position.y) / bent.y);
}

// Under waves: rays along the path found and beside it, one by one, say where it leads and how
// dense the directions lie.
TEST(ManifoldWalks, EndWhereRaysUnderWavesDo) {
  Pool pool(waves());
  pool.shot.light = {panel({0.3, 2, 0.2}, 0.05, 0.05, 50)};
  const Scene scene = pool.scene();
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  int found = 0, close = 0;
  constexpr int points = 400;
  for (int k = 0; k < points; ++k) {
    const Surface ground = ground_at(scene, 1.6f * unit(random) - 0.8f, 1.6f * unit(random) - 0.8f);
    const LampPoint lamp =
        scene.lights().sample_lamp_point(ground.position, 0.5f, {unit(random), unit(random)});
    uint64_t rays = 0;
    const auto path = manifold_walk(scene, ground, 0, scene.fluid(), lamp, rays);
    EXPECT_LE(rays, 5u);
    if (!path) continue;
    ++found;
    const V3f off = lands(scene, ground, path->direction, 2) - lamp.at;
    EXPECT_LT(std::sqrt(dot(off, off)), 0.03 * 0.05);
    const Basis across(path->direction), plane(lamp.normal);
    const V3f axis[2] = {across.tangent, across.bitangent};
    V3f moved[2];
    float off_slope = 0;
    for (int k = 0; k < 2; ++k) {
      constexpr float h = 1e-3f;
      const auto turned = [&](float by) {
        return lands(scene, ground, normalized(path->direction + axis[k] * by), 2);
      };
      moved[k] = (turned(h) - turned(-h)) * (1 / (2 * h));
      const V2f slope(dot(path->slope[0], axis[k]), dot(path->slope[1], axis[k]));
      const V2f seen(dot(plane.tangent, moved[k]), dot(plane.bitangent, moved[k]));
      off_slope = std::max(off_slope, (slope - seen).length() / seen.length());
    }
    const V3f area = cross(moved[0], moved[1]);
    close += std::abs(path->density * std::sqrt(dot(area, area)) - 1) < 0.05 && off_slope < 0.05;
  }
  EXPECT_GT(found, 0.95 * points);
  EXPECT_GT(close, 0.95 * found);  // the others have an edge between their rays
}

// What photons leave out is what walks find: 85 % of their light here, and a photon from elsewhere
// is not taken for one.
TEST(ManifoldWalks, FindWhatPhotonsLeaveOut) {
  Pool pool(waves());
  pool.shot.light = {panel({0.3, 2, 0.2}, 0.05, 0.05, 50)};
  const Scene scene = pool.scene();
  const Surface ground = ground_at(scene, 0.2f, 0.1f);
  const LampPoint lamp = scene.lights().sample_lamp_point(ground.position, 0.5f, {0.4f, 0.7f});
  uint64_t rays = 0;
  const auto path = manifold_walk(scene, ground, 0, scene.fluid(), lamp, rays);
  ASSERT_TRUE(path);
  const auto finds = [&](const V3f& flight) {
    return manifold_walk_finds(scene, ground, 0, scene.fluid(), lamp, flight, rays);
  };
  EXPECT_TRUE(finds(-path->direction));
  EXPECT_FALSE(finds(-normalized(path->direction + Basis(path->direction).tangent * 0.01f)));
  EXPECT_FALSE(finds(path->direction));
  const auto traced = [&](ManifoldWalks walks) {
    return trace_photons(scene, 1, 100000, 64, walks, rays);
  };
  const Caustics all = traced(ManifoldWalks::none), some = traced(ManifoldWalks::some),
                 calm = traced(ManifoldWalks::if_calm);
  EXPECT_EQ(all.walked, 0);
  EXPECT_GT(some.walked, 0.85);
  EXPECT_LT(double(some.photons.size()), 0.3 * double(all.photons.size()));
  EXPECT_EQ(calm.walks, ManifoldWalks::some);
  EXPECT_EQ(calm.photons.size(), some.photons.size());
}

// Lamps of every kind, over waves that rise while the shutter is open.
TEST(ManifoldWalks, GiveThePictureThatPathsGive) {
  Pool pool(waves(), 0.3f);
  for (V3f& v : pool.geometry.fluid.velocity) v = V3f(0, 1.5f, 0);
  Light disk, ball;
  disk.type = LightType::disk;
  disk.name = "disk";
  disk.center = {-0.6, 1.8, 0.4};
  disk.direction = {0.3, -1, 0};
  disk.radius = 0.2;
  disk.radiance = V3f(40);
  ball.type = LightType::sphere;
  ball.name = "ball";
  ball.center = {0.2, 1.2, -0.9};
  ball.radius = 0.15;
  ball.radiance = V3f(30);
  pool.shot.light = {disk, ball, sun({1, -2, 0}, 8), sky(0.1f)};
  pool.shot.render.motion_blur = true;
  pool.shot.render.samples = 256;
  expect_photons_as_paths(pool.shot, pool.geometry);
}

// Water on a sheet that lets light through, seen from below: light comes on its other side.
TEST(ManifoldWalks, GiveThePictureOfWaterOnASheetFromBelow) {
  Pool pool(box_mesh({-3, 1.f, -3}, {3, 1.2f, 3}));
  pool.geometry.fluid.contact = {0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0};  // the lower face
  Material cotton = diffuse("cotton", 0.3f);
  cotton.type = MaterialType::cloth, cotton.transmittance = V3f(0.5f);
  pool.shot.material.push_back(cotton);
  TriangleMesh sheet = flat_mesh(sheet_mesh(2, [](float, float) { return 0.999f; }));
  for (V3f& p : sheet.position) p.x *= 3, p.z *= 3;
  pool.geometry.cloth = {{"cloth", sheet}};
  pool.shot.light = {panel({0.5, 3, 0.2}, 0.3, 0.3, 40)};
  pool.shot.camera.position = V3d(0, 0.2, 0.6);
  pool.shot.camera.target = V3d(0, 1, 0);
  pool.shot.render.samples = 256;
  RenderStats stats;
  Shot once = pool.shot;
  once.render.photons = 1;
  render_frame(once, 1001, pool.geometry, &stats);
  EXPECT_GT(stats.walked, 0.5);
  expect_photons_as_paths(pool.shot, pool.geometry);
}

// Under a small lamp over waves the error is far below that of photons, which blur and are few.
TEST(ManifoldWalks, ErrLessThanPhotonsUnderCalmWater) {
  Pool pool(waves());
  pool.shot.render.width = pool.shot.render.height = 32;
  pool.shot.light = {panel({0.3, 2, 0.2}, 0.15, 0.15, 40)};
  const auto picture = [&](ManifoldWalks walks, double photons, int samples, uint32_t seed) {
    RenderOptions options;
    options.walks = walks;
    pool.shot.render.photons = photons;
    pool.shot.render.samples = samples;
    pool.shot.render.seed = seed;
    return render_frame(pool.shot, 1001, pool.geometry, options);
  };
  const Film paths = picture(ManifoldWalks::none, 0, 16384, 9);
  const double by_photons = relative_mse(picture(ManifoldWalks::none, 0.2, 64, 1), paths);
  const double by_walks = relative_mse(picture(ManifoldWalks::if_calm, 0.2, 64, 1), paths);
  RecordProperty("photons", std::to_string(by_photons));
  RecordProperty("walks", std::to_string(by_walks));
  EXPECT_LT(by_walks, by_photons / 4);
}

// Drops focus: photons bring all their light, the same bits as if there were no walks.
TEST(ManifoldWalks, AreLeftOutWhereWaterIsNotCalm) {
  TriangleMesh drop = sphere_mesh(4);
  for (V3f& p : drop.position) p = p * 0.3f + V3f(0, 0.6f, 0);
  Pool pool(drop);
  pool.shot.light = {panel({0.3, 2, 0.2}, 0.05, 0.05, 50)};
  pool.shot.render.photons = 1;
  RenderStats stats;
  const Film calm = render_frame(pool.shot, 1001, pool.geometry, &stats);
  EXPECT_LT(stats.walked, 0.5);
  RenderOptions none;
  none.walks = ManifoldWalks::none;
  EXPECT_EQ(calm.rgba, render_frame(pool.shot, 1001, pool.geometry, none).rgba);
}

}  // namespace
}  // namespace drench::render::test
