// Gaps between yarns against closed forms: what is seen, lit and shadowed through them, in air, in
// water and where water ends at the sheet.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "render/bsdf/bsdf_dielectric.h"
#include "render/scene/scene.h"
#include "tests/render/support.h"

namespace drench::render::test {
namespace {

Material gauze(float reflectance, float transmittance, double gap) {
  Material m = diffuse("cotton", reflectance);
  m.type = MaterialType::cloth;
  m.transmittance = V3f(transmittance);
  m.gap = gap;
  return m;
}

Shot shot_with(const Material& material, int samples) {
  Shot shot = plain_shot(samples, 8);
  shot.material = {material};
  shot.render.depth = 64;
  return shot;
}

/// Level sheets of cotton, 8 m wide.
FrameGeometry sheets(const std::vector<float>& heights, float half = 4) {
  FrameGeometry geometry;
  for (const float height : heights) {
    TriangleMesh sheet = flat_mesh(sheet_mesh(2, [](float, float) { return 0.f; }));
    for (V3f& p : sheet.position) p = {half * p.x, height, half * p.z};
    geometry.cloth.push_back({fmt::format("cloth{}", height), sheet});
  }
  return geometry;
}

FrameGeometry layers(int count) {
  std::vector<float> heights;
  for (int k = 0; k < count; ++k) heights.push_back(0.5f + 0.5f * float(k));
  return sheets(heights);
}

// Black gauze before a lamp of radiance 1: g of one sheet, g^2 of two, g^3 of three. Alpha is what
// is covered, where there is nothing else.
TEST(Gap, ShowsWhatIsBehindAsOftenAsItIsOpen) {
  for (const double gap : {0., 0.2, 0.7})
    for (const int count : {1, 2, 3}) {
      Shot shot = shot_with(gauze(0, 0, gap), 4096);
      aim_narrow(shot, {0, 5, 0}, {0, 0, 0});
      const Mean alpha = channel_mean(render_frame(shot, 1001, layers(count)), 3);
      EXPECT_NEAR(alpha.value, 1 - std::pow(gap, count), bound(alpha)) << gap << ' ' << count;
      shot.light = {panel({0, -1, 0}, 3, 3, 1, Facing::up)};
      const Mean mean = channel_mean(render_frame(shot, 1001, layers(count)), 0);
      EXPECT_LT(mean.error, 0.002);
      EXPECT_NEAR(mean.value, std::pow(gap, count), bound(mean)) << gap << ' ' << count;
    }
}

// Light of a lamp on the ground under black gauze: times g for each layer, by light samples, by
// surface samples and by both.
TEST(Gap, LetsLightOntoTheGround) {
  for (const int count : {1, 2})
    for (const Estimator estimator :
         {Estimator::mis, Estimator::light_only, Estimator::bsdf_only}) {
      Shot shot = shot_with(gauze(0, 0, 0.3), 1024);
      add_ground(shot, 0.6f);
      shot.light = {panel({0, 3, 0}, 1.5, 1.5, 2)};
      aim_narrow(shot, {2.5, 0.1, 0}, {0, 0, 0});  // from below the gauze
      RenderOptions options;
      options.estimator = estimator;
      const Mean open = channel_mean(render_frame(shot, 1001, {}, options), 0);
      const Mean mean = channel_mean(render_frame(shot, 1001, layers(count), options), 0);
      const double fraction = std::pow(0.3, count), expected = open.value * fraction;
      EXPECT_LT(mean.error, 0.03 * expected);
      EXPECT_NEAR(mean.value, expected, bound(mean) + fraction * bound(open))
          << count << ' ' << int(estimator);
    }
}

// Under a sky of 1 the yarns show their albedo in 1 - g of the picture, and the sky behind the
// rest.
TEST(Gap, AddsUpInAFurnace) {
  Shot shot = shot_with(gauze(0.5f, 0.2f, 0.4), 1024);
  shot.light = {sky(1)};
  aim_narrow(shot, {0, 5, 0}, {0, 0, 0});
  const Mean grey = channel_mean(render_frame(shot, 1001, layers(1)), 0);
  EXPECT_NEAR(grey.value, 0.4 + 0.6 * 0.7, bound(grey));
  shot.material[0] = gauze(0.6f, 0.4f, 0.4);
  const Mean white = channel_mean(render_frame(shot, 1001, layers(3)), 0);
  EXPECT_NEAR(white.value, 1, bound(white));
}

// Layers show yarns and what is behind them in the same fractions: albedo of 0.7 before one of 0.5.
TEST(Gap, IsInTheLayers) {
  Shot shot = shot_with(gauze(0.5f, 0.2f, 0.4), 1024);
  add_ground(shot, 0.5f);
  shot.light = {sky(1)};
  shot.layers.albedo = true;
  aim_narrow(shot, {0, 5, 0}, {0.1, 0, 0.1});
  Film film = render_frame(shot, 1001, layers(1));
  ASSERT_EQ(film.layer.size(), 1u);
  double mean = 0;
  const std::vector<float>& albedo = film.layer[0].value;
  for (const float value : albedo) mean += double(value) / double(albedo.size());
  // 64 pixels of 1024 samples: a fraction of 0.4 errs by 0.002.
  EXPECT_NEAR(mean, 0.6 * 0.7 + 0.4 * 0.5, 4 * 0.2 * 0.002 + 1e-4);
}

TEST(Gap, IsTheSameByAllEstimators) {
  Shot shot = shot_with(gauze(0.5f, 0.2f, 0.4), 64);
  shot.render.width = shot.render.height = 12;
  add_ground(shot, 0.5f, 6);
  shot.camera.position = V3d(0.5, 1.8, 2);
  shot.camera.target = V3d(0, 0.5, 0);
  shot.camera.fov_deg = 30.0;
  shot.light = {panel({0.5, 2.5, 0.4}, 0.5, 0.5, 6), sky(0.2f)};
  expect_estimators_agree(shot, sheets({0.3f, 0.7f}));
}

/// Water half a metre deep that lies on a black sheet with gaps of a half; its lower face is
/// contact with the sheet. `both`: there is as much water under the sheet.
enum class Water { above, both };
struct Pool {
  Shot shot = shot_with(gauze(0, 0, 0.5), 2048);
  FrameGeometry geometry = sheets({0}, 20);

  explicit Pool(Water water) {
    shot.material.push_back(dielectric("water", 1.333));
    shot.fluid.material = "water";
    geometry.fluid = box_mesh({-20, 0.001f, -20}, {20, 0.5f, 20});
    geometry.fluid.contact = {0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0};  // the lower face
    if (water == Water::both) add(box_mesh({-20, -0.5f, -20}, {20, -0.001f, 20}));
  }

  void add(const TriangleMesh& below) {
    TriangleMesh& fluid = geometry.fluid;
    const uint32_t first = uint32_t(fluid.position.size());
    fluid.position.insert(fluid.position.end(), below.position.begin(), below.position.end());
    fluid.normal.insert(fluid.normal.end(), below.normal.begin(), below.normal.end());
    fluid.velocity.resize(fluid.position.size(), V3f(0));
    for (const auto& t : below.triangle)
      fluid.triangle.push_back({t.x + first, t.y + first, t.z + first});
    for (const int contact : {0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0})  // the upper face
      fluid.contact.push_back(uint8_t(contact));
  }

  /// What is seen of a lamp of radiance 1 on the other side. @param side  1: from above, -1: below
  Mean seen(double angle, double side) {
    aim_narrow(shot, {6 * std::sin(angle), side * 6 * std::cos(angle), 0}, {0, 0, 0});
    shot.light = {panel({0, -side * 40, 0}, 300, 300, 1, side > 0 ? Facing::up : Facing::down)};
    return channel_mean(render_frame(shot, 1001, geometry), 0);
  }
};

double fresnel_at(double angle) {
  return double(fresnel_reflectance(float(std::cos(angle)), 1.333f));
}

// In water on both sides light goes straight on: through both faces and the sheet once, or to and
// fro between the faces, through the sheet each time. Also in a mesh that says nothing of contact.
TEST(GapInWater, LetsLightStraightOn) {
  Pool with(Water::both), without(Water::above);
  without.geometry.fluid = box_mesh({-20, -0.5f, -20}, {20, 0.5f, 20});
  for (Pool* pool : {&with, &without})
    for (const double angle : {0., 0.9}) {
      const double r = fresnel_at(angle), g = 0.5;
      const Mean mean = pool->seen(angle, 1);
      EXPECT_LT(mean.error, 0.005);
      EXPECT_NEAR(mean.value, (1 - r) * (1 - r) * g / (1 - r * r * g * g), bound(mean)) << angle;
    }
}

// Where water ends at the sheet it has a surface in the gaps, that bends and reflects: to and fro
// between the faces light meets the sheet every other time. Seen from above, and from below.
TEST(GapInWater, HasASurfaceWhereTheWaterEnds) {
  Pool pool(Water::above);
  for (const double side : {1., -1.})
    for (const double angle : {0., 0.9}) {
      const double r = fresnel_at(angle), g = 0.5;
      const Mean mean = pool.seen(angle, side);
      EXPECT_LT(mean.error, 0.005);
      EXPECT_NEAR(mean.value, g * (1 - r) * (1 - r) / (1 - r * r * g), bound(mean))
          << side << ' ' << angle;
    }
}

// A ray in water that is too flat to leave it does not leave it by gaps: from within, at 60 degrees
// to the sheet's normal, a lamp below is not seen.
TEST(GapInWater, ReflectsTotally) {
  Pool pool(Water::above);
  // Not at an edge of the mesh.
  const V3d at(0.3, 0, 0.2);
  const auto from = [&](double degrees) {
    return at + V3d(0.3 * std::tan(degrees * pi64 / 180), 0.3, 0);
  };
  aim_narrow(pool.shot, from(60), at);
  pool.shot.light = {panel({0, -2, 0}, 8, 8, 1, Facing::up)};
  EXPECT_EQ(channel_mean(render_frame(pool.shot, 1001, pool.geometry), 0).value, 0);
  aim_narrow(pool.shot, from(30), at);
  EXPECT_GT(channel_mean(render_frame(pool.shot, 1001, pool.geometry), 0).value, 0.4);
}

// White yarns, water above, air below: nothing is lost or made, from either side.
TEST(GapInWater, HidesInAFurnace) {
  for (const Water water : {Water::above, Water::both})
    for (const double above : {5., -5.}) {
      Pool pool(water);
      pool.shot.material[0] = gauze(0.6f, 0.4f, 0.3);
      pool.shot.light = {sky(1)};
      pool.shot.render.depth = 400;
      aim_narrow(pool.shot, {1, above, 0}, {0, 0, 0});
      const Mean mean = channel_mean(render_frame(pool.shot, 1001, pool.geometry), 0);
      EXPECT_NEAR(mean.value, 1, bound(mean) + 1e-3) << int(water) << ' ' << above;
    }
}

/// A lamp above a pane, gauze above or below it, and the ground: photons come through gaps on the
/// way to the pane and from it, and lie on yarns.
TEST(GapPhotons, GiveThePictureThatPathsGive) {
  for (const float height : {0.5f, 2.f})
    for (const double camera : {1.2, 0.4}) {  // over the lower sheet, under it
      Shot shot = shot_with(gauze(0.5f, 0.2f, 0.5), 512);
      shot.material.push_back(dielectric("smooth", 1.5));
      add_ground(shot, 0.5f, 6);
      shot.light = {panel({0.8, 3, 0}, 0.5, 0.5, 15), sky(0.2f)};
      FrameGeometry geometry = sheets({height});
      shot.camera.position = V3d(1.2, camera, 0);
      shot.camera.target = V3d(-0.2, 0, 0);
      shot.camera.fov_deg = 12.0;
      shot.obstacle.emplace_back();
      shot.obstacle.back().name = shot.obstacle.back().material = "smooth";
      geometry.obstacle = {{"smooth", box_mesh({-3, 1.4f, -3}, {3, 1.5f, 3})}};
      expect_photons_as_paths(shot, geometry);
    }
}

// Gauze that hangs in level water: walks find the lamp from its yarns, photons that lie on these
// are left out although they met gaps, and what fell through a gap stays a photon.
TEST(GapPhotons, ShareWithWalksWhatYarnsUnderWaterGet) {
  Shot shot = shot_with(gauze(0.5f, 0.2f, 0.5), 512);
  shot.material.push_back(dielectric("water", 1.333));
  shot.fluid.material = "water";
  add_ground(shot, 0.5f, 6);
  shot.light = {panel({0.8, 3, 0}, 0.5, 0.5, 15)};
  FrameGeometry geometry = sheets({0.5f}, 2.5f);
  geometry.fluid = box_mesh({-3, -0.1f, -3}, {3, 1, 3});
  shot.camera.position = V3d(1.2, 2, 0);
  shot.camera.target = V3d(0, 0.5, 0);
  shot.camera.fov_deg = 12.0;
  expect_photons_as_paths(shot, geometry);
}

// A lamp under a sheet that holds water: paths keep what comes in by the gaps, where no photon is.
TEST(GapPhotons, LeaveToPathsWhatComesThroughGapsIntoWater) {
  Shot shot = shot_with(gauze(0.5f, 0.2f, 0.5), 512);
  shot.material.push_back(dielectric("water", 1.333));
  shot.fluid.material = "water";
  shot.material.push_back(diffuse("stone", 0.7f));
  FrameGeometry geometry = sheets({0.5f});
  geometry.fluid = box_mesh({-3, 0.501f, -3}, {3, 1, 3});
  geometry.fluid.contact = {0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0};
  shot.obstacle.emplace_back();
  shot.obstacle.back().name = shot.obstacle.back().material = "stone";
  geometry.obstacle = {{"stone", box_mesh({-0.5f, 0.8f, -0.5f}, {0.5f, 0.9f, 0.5f})}};
  shot.light = {panel({0, -0.6, 0}, 0.8, 0.8, 6, Facing::up), sky(0.2f)};
  shot.camera.position = V3d(1, -0.3, 0);
  shot.camera.target = V3d(0, 0.8, 0);
  shot.camera.fov_deg = 12.0;
  expect_photons_as_paths(shot, geometry);
}

TEST(GapBits, AreTheSameForAnyNumberOfThreads) {
  Shot shot = shot_with(gauze(0.5f, 0.2f, 0.4), 8);
  shot.render.width = shot.render.height = 48;
  shot.camera.position = V3d(0.5, 1.8, 2);
  shot.light = {panel({0.5, 2.5, 0.4}, 0.5, 0.5, 6), sky(0.2f)};
  const FrameGeometry geometry = sheets({0.3f, 0.7f});
  const auto on_threads = [&](int threads) {
    const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 16);
    tbb::task_arena arena(threads);
    Film film;
    arena.execute([&] { film = render_frame(shot, 1001, geometry); });
    return film;
  };
  const Film one = on_threads(1);
  for (const int threads : {2, 16}) EXPECT_EQ(on_threads(threads).rgba, one.rgba) << threads;
}

// Where nothing has gaps no variant that knows them is chosen.
TEST(GapBits, AreOthersOnlyWhereSomethingHasGaps) {
  Shot shot = shot_with(gauze(0.5f, 0.2f, 0), 4);
  shot.light = {sky(1)};
  EXPECT_EQ(Scene(shot, 1001, layers(1), {}).features(), 0u);
  shot.material[0].gap = 0.1;
  EXPECT_NE(Scene(shot, 1001, layers(1), {}).features(), 0u);
}

}  // namespace
}  // namespace drench::render::test
