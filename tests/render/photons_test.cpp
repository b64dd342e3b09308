// Photons against closed forms and against paths, which share nothing with them beyond Fresnel.

#include "render/integrator/photons.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "render/bsdf/bsdf_dielectric.h"
#include "tests/render/puddle.h"

namespace drench::render::test {
namespace {

constexpr double water_index = 1.333;

/// Calls f(direction of flight, power, weight) for the photons near a point, whosever subset.
template <class F>
void for_each_near(const PhotonMap& map, const V3f& at, const F& f) {
  for (unsigned subset = 0; subset < map.subsets(); ++subset)
    map.for_each_near(subset, at, V3f(0, 1, 0),
                      [&](const V3f& flight, const V3f& power, float weight, float) {
                        f(flight, power, weight / float(map.subsets()));
                      });
}

/// Of the photons that lie in the square of half size s around the origin, W/m^2.
double irradiance(const PhotonMap& map, double s, int n = 40) {
  double sum = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for_each_near(
          map, V3f(float(s * (2 * (i + 0.5) / n - 1)), 0, float(s * (2 * (j + 0.5) / n - 1))),
          [&](const V3f&, const V3f& power, float weight) { sum += double(power.x) * weight; });
  return sum / n / n;
}

PhotonMap photons_of(const Shot& shot, const TriangleMesh& fluid, uint32_t count,
                     uint32_t seed = 1) {
  const Scene scene(shot, 1001, {fluid, {}}, {});
  uint64_t rays = 0;
  PhotonMap map = trace_photons(scene, seed, count, 64, ManifoldWalks::none, rays).photons;
  EXPECT_GT(rays, count / 8);
  return map;
}

Shot pool_shot(double index, float absorption) {
  Shot shot = plain_shot(64, 8);
  add_ground(shot, 0.5f, 6);
  shot.material.push_back(dielectric("water", index, V3f(absorption)));
  return shot;
}

// Under level water, E cos(a) (1 - F(a)) e^(-s d / cos(b)) / n^2. A million photons, of which some
// 20,000 lie in the square: 4 of their standard errors.
TEST(Photons, LieUnderLevelWaterAsSnellAndFresnelSay) {
  Shot shot = pool_shot(water_index, 0.7f);
  const double a = 0.6, depth = 0.4, cos_b = std::sqrt(1 - std::pow(std::sin(a) / water_index, 2));
  shot.light = {sun({std::sin(a), -std::cos(a), 0}, 0.5)};
  const double parallel = (water_index * std::cos(a) - cos_b) / (water_index * std::cos(a) + cos_b);
  const double perpendicular =
      (std::cos(a) - water_index * cos_b) / (std::cos(a) + water_index * cos_b);
  const double fresnel = (parallel * parallel + perpendicular * perpendicular) / 2;
  const PhotonMap map = photons_of(shot, box_mesh({-5, -0.1f, -5}, {5, float(depth), 5}), 1000000);
  const double expected = 2 * std::cos(a) * (1 - fresnel) * std::exp(-0.7 * depth / cos_b) /
                          (water_index * water_index);
  EXPECT_NEAR(irradiance(map, 1.5), expected, 0.02 * expected);
}

// A lamp's light falls as the form factor of its square says, whatever the fraction of the surface.
TEST(Photons, OfALampCarryItsFormFactor) {
  Shot shot = pool_shot(1, 0);  // water that bends nothing
  shot.light = {panel({0, 2, 0}, 0.1, 0.1, 50)};
  const PhotonMap map = photons_of(shot, box_mesh({-2, -0.1f, -2}, {2, 0.4f, 2}), 1000000);
  // E = L A / h^2, cos^4 over both squares: within 1 % for lamp and patch of 0.1 and 0.2 at 2 m.
  EXPECT_NEAR(irradiance(map, 0.1), 50 * 0.04 / 4, 0.03 * 0.5);
}

// Water that rises through the shutter absorbs as the mean of e^(-s d(t)).
TEST(Photons, AreSpreadOverTheShutter) {
  Shot shot = pool_shot(1, 2);
  shot.render.motion_blur = true;
  shot.camera.position = V3d(0, 3, 0.5);
  shot.camera.shutter_open = -0.25, shot.camera.shutter_close = 0.25;
  shot.light = {sun({0, -1, 0}, 0.5)};
  TriangleMesh water = box_mesh({-3, -0.1f, -3}, {3, 0.5f, 3});
  for (size_t v = 0; v < water.position.size(); ++v)
    if (water.position[v].y > 0) water.velocity[v] = V3f(0, float(0.8 * 2 * shot.timeline.fps), 0);
  const PhotonMap map = photons_of(shot, water, 1000000);
  // From 0.1 to 0.9 m: (e^-0.2 - e^-1.8) / 1.6 of 2 W/m^2.
  const double expected = 2 * (std::exp(-0.2) - std::exp(-1.8)) / 1.6;
  EXPECT_NEAR(irradiance(map, 1), expected, 0.02 * expected);
}

// Water that rises as the shutter opens and closes evenly: times are those of a triangle, for rows
// that are exposed one after the other spread over twice the time.
TEST(Photons, FollowTheShutterOfTheCamera) {
  for (const double late : {0., 1.}) {
    Shot shot = pool_shot(1, 2);
    shot.render.motion_blur = true;
    shot.camera.position = V3d(0, 3, 0.5);
    shot.camera.shutter_open = -0.25, shot.camera.shutter_close = 0.25;
    shot.camera.shutter_opening = 0.2, shot.camera.shutter_closing = 0.8;
    shot.camera.rolling_shutter = late;
    shot.light = {sun({0, -1, 0}, 0.5)};
    TriangleMesh water = box_mesh({-3, -0.1f, -3}, {3, 0.5f, 3});
    for (size_t v = 0; v < water.position.size(); ++v)
      if (water.position[v].y > 0) water.velocity[v] = V3f(0, float(0.6 * 2 * 24), 0);
    const PhotonMap map = photons_of(shot, water, 1000000);
    // 0.2 m deep at open, 0.8 at close, 1.4 when the last row is done: by its definition.
    double expected = 0, all = 0;
    for (int i = 0; i < 400; ++i)
      for (int row = 0; row < 40; ++row) {
        const double t = (i + 0.5) / 400, open = t < 0.2 ? t / 0.2 : (1 - t) / 0.8;
        expected += 2 * open * std::exp(-2 * (0.2 + 0.6 * (t + late * (row + 0.5) / 40)));
        all += open;
      }
    expected /= all;
    EXPECT_NEAR(irradiance(map, 1), expected, 0.02 * expected) << late;
  }
}

// The same picture from photons and from paths, of a wavy pool with a lamp and a sun.
TEST(Photons, GiveThePictureThatPathsGive) {
  Shot shot = puddle_shot(V3f(0.3f));
  shot.light = {panel({0.8, 2, 0.3}, 0.15, 0.15, 40), sun({1, -2, 0}, 5), sky(0.2f)};
  expect_photons_as_paths(shot, {waves(), {}});
}

// And with a disk, which photons start from as from other lamps.
TEST(Photons, OfADiskGiveThePictureThatPathsGive) {
  Shot shot = puddle_shot(V3f(0.3f));
  Light disk;
  disk.type = LightType::disk;
  disk.center = {-0.6, 1.8, 0.4};
  disk.direction = {0.3, -1, 0};
  disk.radius = 0.2;
  disk.radiance = V3f(40);
  shot.light = {disk, sky(0.1f)};
  expect_photons_as_paths(shot, {waves(), {}});
}

// Foam is too small for a density of photons: paths bring its light, and the picture is theirs.
TEST(Photons, LeaveFoamToPaths) {
  Shot shot = pool_shot(water_index, 0.3f);
  shot.render.samples = 1024;
  shot.camera.position = V3d(0, 2, 0.1);
  shot.camera.target = V3d(0, 0.2, 0);
  shot.camera.fov_deg = 4.0;
  shot.light = {panel({0.8, 2, 0.3}, 0.3, 0.3, 40)};
  FrameGeometry pool{box_mesh({-2, -0.1f, -2}, {2, 0.4f, 2}), {}};
  for (int k = 0; k < 900; ++k) {
    pool.foam.position.push_back({0.01f * float(k % 30 - 15), 0.2f, 0.01f * float(k / 30 - 15)});
    pool.foam.velocity.push_back(V3f(0));
    pool.foam.radius.push_back(0.004f);
  }
  expect_photons_as_paths(shot, pool);
}

// Whatever the cells and packs they lie in: every photon of the disc counts once, none else, on the
// side that it comes from. Against all of them one by one.
TEST(Photons, AreAllFoundOnce) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-1, 1);
  for (const int count : {1, 7, 60, 3000, 100000}) {
    std::vector<Photon> photons;
    for (int k = 0; k < count; ++k)
      photons.push_back({V3f(place(random), 0.1f * place(random), place(random)),
                         V3f(0, k % 3 ? -1.f : 1.f, 0), V3f(0, k % 2 ? -1.f : 1.f, 0),
                         V3f(1 + place(random)), 0.5f + 0.5f * place(random)});
    const PhotonMap map(photons, 64);
    EXPECT_EQ(map.subsets(), count == 100000 ? 4 : 1);
    const float r2 = map.radius() * map.radius();
    for (int k = 0; k < (count > 3000 ? 100 : 2000); ++k) {
      const V3f at = k % 2 ? photons[size_t(k) % photons.size()].position
                           : V3f(1.2f * place(random), 0, 1.2f * place(random));
      double side[2] = {0, 0}, near = 0;
      for (const Photon& p : photons) {
        const V3f off = p.position - at;
        const double square = dot(off, off) / r2;
        if (square < 1 && off.y * off.y <= 0.25f * r2)
          side[p.direction.y < 0 ? 0 : 1] += double(p.power.x) * 2 * (1 - square) / (pi64 * r2);
      }
      for_each_near(map, at, [&](const V3f&, const V3f& power, float weight) {
        near += double(power.x) * weight;
      });
      Irradiance found;
      for (unsigned subset = 0; subset < map.subsets(); ++subset) {
        const GatheredLight part = map.irradiance(subset, at, V3f(0, 1, 0), V3f(0, 1, 0));
        found.add(part.all, 1 / float(map.subsets()));
      }
      const double slack = 1e-4 * (1 + side[0] + side[1]);
      ASSERT_NEAR(found.front.x, side[0], slack) << count << " " << k;
      ASSERT_NEAR(found.back.x, side[1], slack) << count << " " << k;
      ASSERT_NEAR(near, side[0] + side[1], slack) << count << " " << k;
    }
  }
}

// Smooth normals on coarse triangles: no photon far brighter than the others, which would be a
// disc.
TEST(Photons, AreNoneFarBrighterThanOthers) {
  Shot shot = pool_shot(water_index, 0);
  shot.light = {sun({0.6, -1, 0.2}, 0.5)};
  TriangleMesh drop = sphere_mesh(3);
  for (V3f& p : drop.position)
    p = 0.3f * p * (1 + 0.4f * std::sin(7 * p.x) * std::sin(6 * p.y + 5 * p.z)) + V3f(0, 0.5f, 0);
  drop.normal.clear();
  const PhotonMap map = photons_of(shot, drop, 200000);
  double most = 0, sum = 0, count = 0;
  for (int k = 0; k < 10000; ++k)
    for_each_near(map, V3f(0.02f * float(k % 100 - 50), 0, 0.02f * float(k / 100 - 50)),
                  [&](const V3f&, const V3f& power, float) {
                    most = std::max(most, double(power.x));
                    sum += double(power.x), ++count;
                  });
  ASSERT_GT(count, 1000);
  EXPECT_LT(most, 20 * sum / count);
}

/// Water to a depth of 0.4 m whose faces rise and fall by 15 degrees and whose normals are level.
TriangleMesh roof_tiles() {
  TriangleMesh mesh;
  const auto quad = [&](const std::array<V3f, 4>& corners, const V3f& normal) {
    const uint32_t first = uint32_t(mesh.position.size());
    for (const V3f& p : corners) {
      mesh.position.push_back(p);
      mesh.normal.push_back(normal);
      mesh.velocity.push_back(V3f(0));
    }
    mesh.triangle.push_back({first, first + 1, first + 2});
    mesh.triangle.push_back({first, first + 2, first + 3});
  };
  constexpr int tiles = 400;
  constexpr float half = 5, tile_width = 2 * half / tiles, below = -0.1f;
  for (int k = 0; k < tiles; ++k) {
    const float x = -half + tile_width * float(k), next = -half + tile_width * float(k + 1);
    const float rise = tile_width * std::tan(15 * pi / 180), odd = k % 2 == 0 ? 0.f : rise;
    const float y = 0.4f + odd, there = 0.4f + rise - odd;
    quad({V3f(x, y, half), {next, there, half}, {next, there, -half}, {x, y, -half}}, V3f(0, 1, 0));
    quad({V3f(x, below, -half), {next, below, -half}, {next, below, half}, {x, below, half}},
         V3f(0, -1, 0));
    quad({V3f(x, below, half), {next, below, half}, {next, there, half}, {x, y, half}},
         V3f(0, 0, 1));
    quad({V3f(next, below, -half), {x, below, -half}, {x, y, -half}, {next, there, -half}},
         V3f(0, 0, -1));
  }
  for (const float side : {-1.f, 1.f}) {
    const float x = side * half;
    quad({V3f(x, below, half * side),
          {x, below, -half * side},
          {x, 0.4f, -half * side},
          {x, 0.4f, half * side}},
         V3f(side, 0, 0));
  }
  return mesh;
}

// Where light grazes the real faces few photons fall, each of which counts for more: what passes is
// what the smooth normals say. Of 70 degrees half the faces see 85.
TEST(Photons, PassAsManyAsSmoothNormalsSay) {
  Shot shot = pool_shot(water_index, 0);
  const double a = 70 * double(pi) / 180;
  shot.light = {sun({std::sin(a), -std::cos(a), 0}, 0.5)};
  const double passes = 1 - double(fresnel_reflectance(float(std::cos(a)), float(water_index)));
  const double expected = 2 * std::cos(a) * passes / (water_index * water_index);
  EXPECT_NEAR(irradiance(photons_of(shot, roof_tiles(), 1000000), 1.5), expected, 0.02 * expected);
}

// Blur and noise vanish together: on lines across the waves' caustics noise falls with the number
// of photons to the power -1/4, 1.78 a decade, blur to twice that. The reference has its own tenth.
TEST(Photons, ConvergeAsTheirNumberGrows) {
  Shot shot = pool_shot(water_index, 0);
  shot.light = {sun({0.2, -1, 0.1}, 0.5)};
  const auto lines = [&](uint32_t count, uint32_t seed) {
    const PhotonMap map = photons_of(shot, waves(), count, seed);
    std::vector<double> values;
    for (int k = 0; k < 2200; ++k) {
      double sum = 0;
      for_each_near(
          map, V3f(-0.5f + 0.005f * float(k % 200), 0, -0.5f + 0.1f * float(k / 200)),
          [&](const V3f&, const V3f& power, float weight) { sum += double(power.x) * weight; });
      values.push_back(sum);
    }
    return values;
  };
  const std::vector<double> best = lines(8000000, 9);
  double before = 1e9;
  for (const uint32_t count : {4000u, 40000u, 400000u}) {
    double sum = 0, of = 0;
    const std::vector<double> values = lines(count, 1);
    for (size_t k = 0; k < best.size(); ++k)
      sum += std::pow(values[k] - best[k], 2), of += best[k] * best[k];
    const double error = std::sqrt(sum / of);
    RecordProperty("error_" + std::to_string(count), std::to_string(error));
    EXPECT_LT(error, before / 1.4) << count;
    before = error;
  }
  EXPECT_LT(before, 0.2);
}

// Their blur is told, less with more samples; where there are none, none.
TEST(Photons, TellTheirBlur) {
  Shot shot = pool_shot(water_index, 0);
  shot.light = {sun({0.2, -1, 0.1}, 0.5)};
  shot.render.width = shot.render.height = 64;
  double before = 1e9;
  for (const int samples : {4, 16, 64}) {
    shot.render.samples = samples;
    shot.render.photons = 1;
    RenderStats stats;
    render_frame(shot, 1001, {waves(), {}}, &stats);
    EXPECT_GT(stats.photon_radius, 0);
    EXPECT_LT(stats.photon_radius, before / 1.1) << samples;
    before = stats.photon_radius;
  }
  shot.render.photons = 0;
  RenderStats stats;
  render_frame(shot, 1001, {waves(), {}}, &stats);
  EXPECT_EQ(stats.photon_radius, 0);
}

// A sample finds the photons of its own eighth of the shutter; all eighths have as much light.
TEST(Photons, AreThoseOfTheirTime) {
  constexpr int photon_count = 300000;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-1, 1);
  std::vector<Photon> photons;
  for (int k = 0; k < photon_count; ++k) {
    const float time_sample = (float((k * 7) % photon_count) + 0.5f) / photon_count;
    photons.push_back({V3f(place(random), 0, place(random)), V3f(0, -1, 0), V3f(0, 1, 0),
                       V3f(1, time_sample, 0), time_sample});
  }
  EXPECT_EQ(PhotonMap(photons, 4).subsets(), 4u) << "no more than a pixel has samples";
  const PhotonMap map(photons, 64);
  ASSERT_EQ(map.subsets(), 8u);
  for (const float time_sample : {0.f, 0.3f, 0.61f, 0.9999999f, 1.f}) {
    const float eighth = std::min(std::floor(time_sample * 8), 7.f) / 8;
    double light = 0, points = 0;
    for (float x = -0.8f; x < 0.8f; x += 0.05f)
      for (float z = -0.8f; z < 0.8f; z += 0.05f, ++points)
        map.for_each_near(map.subset_at(time_sample), V3f(x, 0, z), V3f(0, 1, 0),
                          [&](const V3f&, const V3f& power, float weight, float) {
                            const float its = power.y / power.x;
                            ASSERT_GE(its, eighth);
                            ASSERT_LT(its, eighth + 0.125f);
                            light += double(power.x) * weight;
                          });
    EXPECT_NEAR(light / points, photon_count / 4., 0.03 * photon_count / 4) << time_sample;
  }
}

// A lamp in the midst of a splash is in none of its drops; one that a drop holds, touches or meets
// while the shutter is open leaves its light to paths.
TEST(Photons, KnowALampAmongDropsFromOneInADrop) {
  Shot shot = puddle_shot(V3f(0));
  Light lamp;
  lamp.type = LightType::sphere;
  lamp.name = "lamp";
  lamp.center = {0, 0.5, 0};
  lamp.radius = 0.1;
  lamp.radiance = V3f(20);
  shot.light = {lamp, sky(0.1f)};
  FrameGeometry drops;
  for (const float side : {-1.f, 1.f}) {
    const uint32_t first = uint32_t(drops.fluid.position.size());
    const TriangleMesh ball = sphere_mesh(4);
    for (const V3f& p : ball.position)
      drops.fluid.position.push_back(0.3f * p + V3f(0.6f * side, 0.5f, 0));
    for (const auto& t : ball.triangle)
      drops.fluid.triangle.push_back({first + t.x, first + t.y, first + t.z});
  }
  drops.fluid.velocity.assign(drops.fluid.position.size(), V3f(0));
  const auto traced = [&] { return can_trace_photons(Scene(shot, 1001, drops, {})); };
  EXPECT_TRUE(traced());
  expect_photons_as_paths(shot, drops);

  for (const double x : {0.6, 0.25, 0.95}) {
    shot.light[0].center.x = x;
    EXPECT_FALSE(traced()) << x;
  }
  shot.light[0].center.x = 0.15;
  EXPECT_TRUE(traced());
  drops.fluid.velocity.assign(drops.fluid.position.size(), V3f(-24, 0, 0));
  EXPECT_TRUE(traced());
  shot.render.motion_blur = true;
  EXPECT_FALSE(traced()) << "a drop comes to it";
}

// What has no lamps or no fluid does without, and its picture keeps its bits.
TEST(Photons, AreNotTracedWithoutLampsOrFluid) {
  Shot shot = pool_shot(water_index, 0.3f);
  shot.camera.position = V3d(0, 3, 1);
  shot.light = {sky(0.2f)};
  Shot with = shot;
  with.render.photons = 1;
  EXPECT_EQ(render_frame(shot, 1001, {waves(), {}}).rgba,
            render_frame(with, 1001, {waves(), {}}).rgba);
  shot.light = with.light = {sun({1, -2, 0}, 5)};
  EXPECT_EQ(render_frame(shot, 1001, {}).rgba, render_frame(with, 1001, {}).rgba);
}

}  // namespace
}  // namespace drench::render::test
