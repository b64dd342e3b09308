// Water against closed forms: Fresnel slabs, absorption, total reflection, closed meshes.

#include <gtest/gtest.h>

#include <random>

#include "render/bsdf/bsdf_cloth.h"
#include "render/integrator/refracted_light_guide.h"
#include "render/scene/scene.h"
#include "render/scene/scene_cache.h"
#include "tests/render/chi_square.h"
#include "tests/render/closed_body.h"
#include "tests/render/puddle.h"

namespace drench::render::test {
namespace {

constexpr double water_index = 1.333;
const double one_face = std::pow((water_index - 1) / (water_index + 1), 2);  // 0.020371

/// A slab of 20 m x d x 20 m whose top lies at y = 0, seen straight from above; the camera hides
/// nothing. One panel shines from above or from below.
struct Slab {
  Shot shot = plain_shot(256);
  FrameGeometry geometry;

  Slab(double thickness, const Material& material, Facing light) {
    shot.material = {material};
    aim_narrow(shot, {0, 5, 0}, {0, 0, 0});
    shot.light = {panel({0, light == Facing::down ? 10. : -10., 0}, 3, 3, 1, light)};
    geometry.fluid = box_mesh({-10, float(-thickness), -10}, {10, 0, 10});
  }
};

// A million rays here, a hundred million in ./bench render_leaks.
TEST(ClosedBody, LosesNoRay) {
  constexpr uint32_t chains = 4096;
  for (const float far : {0.f, 300.f})
    for (const bool round : {false, true}) {
      Shot shot = plain_shot(1);
      shot.material = {dielectric("water", water_index)};
      const V3f center(far, 0.5f * far, -far);
      FrameGeometry geometry;
      geometry.fluid = round ? sphere_mesh(4) : box_mesh({-1, -1, -1}, {1, 1, 1});
      translate(geometry.fluid, center);
      const Scene scene(shot, 1001, geometry, {});
      uint32_t lost = 0;
      for (uint32_t chain = 0; chain < chains; ++chain) lost += loses_ray(scene, center, chain, 64);
      EXPECT_EQ(lost, 0u) << "far " << far << ", round " << round;
    }
}

TEST(FresnelSlab, ReflectsWhatBothFacesSumTo) {
  // R = R1 + (1 - R1)^2 R1 (1 + R1^2 + ...) = 2 R1 / (1 + R1) = 0.03993.
  for (const auto first : {FirstInterface::one, FirstInterface::both}) {
    Slab slab(0.5, dielectric("water", water_index), Facing::down);
    slab.shot.render.samples = 4096;
    RenderOptions options;
    options.first_interface = first;
    const Mean mean = channel_mean(render_frame(slab.shot, 1001, slab.geometry, options), 0);
    EXPECT_LT(mean.error, 1e-4);  // 2 R1, without what goes to and fro, is 8e-4 more
    EXPECT_NEAR(mean.value, 2 * one_face / (1 + one_face), bound(mean));
  }
}

TEST(FresnelSlab, TransmitsTheRest) {
  const Slab slab(0.5, dielectric("water", water_index), Facing::up);
  const Mean mean = channel_mean(render_frame(slab.shot, 1001, slab.geometry), 0);
  EXPECT_NEAR(mean.value, (1 - one_face) / (1 + one_face), bound(mean));
}

TEST(AbsorbingSlab, TransmitsBeerLambertBetweenItsReflections) {
  // T = (1 - R1)^2 e^-sd / (1 - R1^2 e^-2sd)
  const V3f absorption(0.5f, 1, 2);
  const double thickness = 0.7;
  const Slab slab(thickness, dielectric("water", water_index, absorption), Facing::up);
  const Film film = render_frame(slab.shot, 1001, slab.geometry);
  for (int c = 0; c < 3; ++c) {
    const double once = std::exp(-absorption[c] * thickness);
    const Mean mean = channel_mean(film, c);
    EXPECT_NEAR(mean.value, std::pow(1 - one_face, 2) * once / (1 - std::pow(one_face * once, 2)),
                bound(mean));
  }
}

TEST(AbsorbingSlab, FollowsBeerLambertAloneWhenTheIndexMatches) {
  const V3f absorption(0.5f, 1, 2);
  const Slab slab(1.25, dielectric("water", 1, absorption), Facing::up);
  const Film film = render_frame(slab.shot, 1001, slab.geometry);
  for (int c = 0; c < 3; ++c) {
    const double expected = std::exp(-1.25 * absorption[c]);
    // No chance is left in this one: only rounding.
    EXPECT_NEAR(channel_mean(film, c).value, expected, 2e-5 * expected);
  }
}

// Films as thin as 10 micrometres near the origin and 0.1 mm 300 m away: both faces are met, or
// light would be kept whole or lost. What rays leave a face by is not absorbed, the rounding of
// places 10 m and 310 m from the origin.
TEST(AbsorbingSlab, KeepsThinFilms) {
  for (const auto& [far, thickness] : {std::pair{0.f, 1e-3},
                                       {0.f, 1e-4},
                                       {0.f, 1e-5},
                                       {300.f, 1e-2},
                                       {300.f, 1e-3},
                                       {300.f, 1e-4}})
    for (const double index : {1., water_index}) {
      const double density = 0.5 / thickness, left = 1.3e-7 * (10 + far);  // 1/m, m
      Slab slab(thickness, dielectric("water", index, V3f(float(density))), Facing::up);
      const V3d by(far, 0, -far);
      translate(slab.geometry.fluid, V3f(by));
      slab.shot.camera.position.keys[0].second += by;
      slab.shot.camera.target.keys[0].second += by;
      slab.shot.light[0].center += by;
      const Mean mean = channel_mean(render_frame(slab.shot, 1001, slab.geometry), 0);
      const double face = index == 1 ? 0 : one_face, once = std::exp(-0.5);
      const double whole = std::pow(1 - face, 2) * once / (1 - std::pow(face * once, 2));
      EXPECT_GT(mean.value, whole - bound(mean)) << thickness << " m, " << far << " m away";
      EXPECT_LT(mean.value, whole * std::exp(density * left) + bound(mean))
          << thickness << " m, " << far << " m away";
    }
}

TEST(AbsorbingSlab, TintsTheFloorByTheWayLightTook) {
  // Index-matched water over a white floor, light straight down: e^-s(d / cos camera + d).
  Shot shot = plain_shot(64);
  add_ground(shot, 0.5f);
  shot.material.push_back(dielectric("water", 1, V3f(0.8f, 0.4f, 0.f)));
  shot.fluid.spacing = 1e-4;
  Light sun;
  sun.type = LightType::sun;
  sun.radiance = V3f(pi64);
  sun.angle_deg = 2;  // wide enough to be met by surface samples: light sampling cannot pass water
  shot.light = {sun};
  shot.render.samples = 16384;
  shot.render.width = shot.render.height = 8;
  aim_narrow(shot, {0, 5, 5}, {0, 0, 0});
  const double depth = 0.5;
  FrameGeometry geometry{box_mesh({-4, -0.1f, -4}, {4, float(depth), 4}), {}};
  const Film film = render_frame(shot, 1001, geometry);
  const Mean clear = channel_mean(film, 2);
  EXPECT_NEAR(clear.value, 0.5, 4 * clear.error);
  EXPECT_LT(clear.error, 0.02);
  // The same paths in every channel, so the ratio has almost no noise: 1e-3 for the sun's width.
  for (int c = 0; c < 2; ++c)
    EXPECT_NEAR(channel_mean(film, c).value / clear.value,
                std::exp(-(c == 0 ? 0.8 : 0.4) * depth * (1 + std::sqrt(2.))), 1e-3);
}

/// A camera under flat water that looks up through 120 degrees, black around it.
struct UnderWater {
  Shot shot;
  FrameGeometry geometry{box_mesh({-100, -1, -100}, {100, 2, 100}), {}};

  explicit UnderWater(int samples) : shot(plain_shot(samples, 64)) {
    add_ground(shot, 0, 200);
    shot.material.push_back(dielectric("water", water_index));
    shot.camera.position = V3d(0, 1, 0);
    shot.camera.target = V3d(0, 2, 0);
    shot.camera.up = V3d(0, 0, -1);
    shot.camera.fov_deg = 120.0;
  }
};

/// What water reflects of unpolarised light from within, `angle` to the vertical.
double reflected_within(double angle) {
  const double s = water_index * std::sin(angle);
  if (s >= 1) return 1;
  const double i = std::cos(angle), t = std::sqrt(1 - s * s);
  return 0.5 * (std::pow((water_index * i - t) / (water_index * i + t), 2) +
                std::pow((i - water_index * t) / (i + water_index * t), 2));
}

// The picture of the sky, summed, is that of the window's disc: its radius is right to a tenth of a
// pixel.
TEST(SnellsWindow, IsAsLargeAsRefractionSays) {
  UnderWater scene(64);
  scene.shot.light = {sky(1)};
  const Film film = render_frame(scene.shot, 1001, scene.geometry);
  const double pixels_per_tangent = 32 / std::tan(60 * pi64 / 180);
  double shown = 0, expected = 0;
  for (size_t p = 0; p < film.rgba.size(); p += 4) shown += film.rgba[p];
  constexpr int fine = 2000;
  for (int k = 0; k < fine; ++k) {
    const double r = 32 * (k + 0.5) / fine;
    expected +=
        (1 - reflected_within(std::atan(r / pixels_per_tangent))) * 2 * pi64 * r * 32 / fine;
  }
  EXPECT_NEAR(shown, expected, 0.01 * expected);  // 1 % of a disc of 21 pixels: 0.1
}

// Beyond the window the floor is mirrored whole, within it by what Fresnel leaves.
TEST(SnellsWindow, MirrorsTheFloor) {
  UnderWater scene(64);
  scene.shot.light = {panel({0, 0.5, 0}, 60, 60, 1, Facing::up)};
  const Film film = render_frame(scene.shot, 1001, scene.geometry);
  const double pixels_per_tangent = 32 / std::tan(60 * pi64 / 180);
  double within = 0, expected = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const double r = std::hypot(x + 0.5 - 32, y + 0.5 - 32);
      const double angle = std::atan(r / pixels_per_tangent);
      const float value = film.rgba[4 * size_t(y * 64 + x)];
      if (r > pixels_per_tangent * std::tan(std::asin(1 / water_index)) + 2.2) {
        EXPECT_NEAR(value, 1, 1e-4) << x << ' ' << y;
      }
      if (r < 15) within += value, expected += reflected_within(angle);
    }
  EXPECT_NEAR(within, expected, 0.03 * expected);
}

TEST(SnellsWindow, EndsAtTheCriticalAngle) {
  // Under flat water over a black floor the sky shows inside asin(1/n) = 48.61 degrees of the
  // vertical and nothing shows outside.
  UnderWater scene(4);
  scene.shot.light = {sky(1)};
  const Film film = render_frame(scene.shot, 1001, scene.geometry);
  const double pixels_per_tangent = 32 / std::tan(60 * pi64 / 180);
  const double edge = pixels_per_tangent * std::tan(std::asin(1 / water_index));
  int inside = 0, outside = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const double r = std::hypot(x + 0.5 - 32, y + 0.5 - 32);
      const float value = film.rgba[4 * size_t(y * 64 + x)];
      // The pixel filter reaches 1.5 pixels along each axis, 2.12 in all.
      if (r > edge + 2.2) {
        EXPECT_EQ(value, 0) << x << ' ' << y;
        ++outside;
      } else if (r < edge - 6) {
        EXPECT_GT(value, 0.4f) << x << ' ' << y;  // 1 - F is above 0.75 there; four samples
        ++inside;
      }
    }
  EXPECT_GT(inside, 400);
  EXPECT_GT(outside, 400);
}

TEST(SnellsWindow, ShowsOneMinusFresnelAtTheZenith) {
  Shot shot = plain_shot(1024, 8);
  add_ground(shot, 0, 200);
  shot.material.push_back(dielectric("water", water_index));
  shot.light = {sky(1)};
  aim_narrow(shot, {0, 1, 0}, {0, 2, 0});
  const FrameGeometry geometry{box_mesh({-100, -1, -100}, {100, 2, 100}), {}};
  const Mean mean = channel_mean(render_frame(shot, 1001, geometry), 0);
  EXPECT_NEAR(mean.value, 1 - one_face, bound(mean));
}

TEST(WaterGuide, LeavesTheMeanAsItIs) {
  // A wavy surface over a floor, a lamp and a sun aslant: aimed and unaimed rays see one picture.
  Shot shot = puddle_shot(V3f(0.5f, 0.2f, 0.1f));
  Light sun;
  sun.type = LightType::sun;
  sun.direction = {1, -2, 0};
  sun.angle_deg = 5;
  sun.radiance = V3f(2);
  shot.light = {panel({0.8, 2, 0.3}, 0.15, 0.15, 40), sun, sky(0.2f)};
  TriangleMesh wavy = sphere_mesh(5);
  for (V3f& p : wavy.position)
    p = {6 * p.x, p.y > 0 ? 0.4f * p.y + 0.02f * std::sin(9 * p.x) * p.y : 0.3f * p.y, 6 * p.z};
  wavy.normal.clear();
  RenderOptions aimed, unaimed;
  unaimed.water_guide = WaterGuide::off;
  for (const TriangleMesh& water : {box_mesh({-5, -0.1f, -5}, {5, 0.4f, 5}), wavy}) {
    const Mean with = mean_over_seeds(shot, {water, {}}, aimed, 24);
    const Mean without = mean_over_seeds(shot, {water, {}}, unaimed, 24);
    EXPECT_LT(without.error, 0.02 * without.value);
    EXPECT_NEAR(with.value, without.value, 4 * std::hypot(with.error, without.error));
    // On a level surface most of the noise goes; the two errors are known to 15 % each.
    if (water.position.size() == 24) {
      EXPECT_LT(with.error, 0.6 * without.error);
    }
  }
}

TEST(WaterGuide, HasTheDensityItClaims) {
  // The density integrates to 1 over the directions that reach the surface below the critical
  // angle, less what the cones hold beyond the horizon: none here.
  SceneCache cache;
  const Lights lights({panel({0.8, 2, 0.3}, 0.4, 0.4, 6)}, Lights::SampleEnvironment::automatic,
                      cache);
  const RefractedLightGuide guide(lights, float(water_index));
  const V3f point(0.1f, 0, 0);
  double integral = 0, drawn = 0;
  constexpr int steps = 2000;
  V3d mean(0), mean_drawn(0);
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) {
      const double y = (i + 0.5) / steps, phi = 2 * pi64 * (j + 0.5) / steps;
      const V3f d(float(std::sqrt(1 - y * y) * std::cos(phi)), float(y),
                  float(std::sqrt(1 - y * y) * std::sin(phi)));
      const double weight = guide.pdf(point, d) * 2 * pi64 / steps / steps;
      integral += weight;
      mean += V3d(d) * weight;
    }
  for (uint32_t k = 0; k < 1u << 16; ++k) {
    const Sampler sampler(PixelOrder::separate, 1, 0, 0, 16, k);
    const DirectionSample s = guide.sample(point, sampler.one(0), sampler.two(1));
    drawn += s.pdf > 0 ? 1. / (1 << 16) : 0;
    if (s.pdf > 0) mean_drawn += V3d(s.direction) / (1 << 16);
  }
  // 2000 x 2000 points, coarse where the density grows without bound at the critical angle.
  EXPECT_NEAR(drawn, integral, 3e-3);
  EXPECT_GT(drawn, 0.9);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(mean_drawn[c], mean[c], 3e-3);
}

// What a surface under water draws: a diffuse direction, or one aimed at the lamp.
TEST(WaterGuide, IsDrawnInAMixtureOfTheDensitiesItSays) {
  SceneCache cache;
  const Lights lights({panel({0.8, 2, 0.3}, 0.4, 0.4, 6), sky(0.5f)},
                      Lights::SampleEnvironment::automatic, cache);
  const RefractedLightGuide guide(lights, float(water_index));
  const V3f point(0.1f, 0, 0), up(0, 1, 0);
  const ClothBsdf floor({0, 1, 0}, up, up, V3f(0.5f), V3f(0));
  const float probability = guide.probability(point);
  ASSERT_GT(probability, 0.2);
  ASSERT_LT(probability, 0.9);
  const auto number = [](std::mt19937& random) {
    return std::uniform_real_distribution<float>(0, one_minus_epsilon)(random);
  };
  const ChiSquare fit = chi_square(
      7,
      [&](std::mt19937& random) {
        const float u = number(random), v = number(random), w = number(random);
        return sample_mixed(floor, guide, probability, point, u, {v, w});
      },
      [&](const V3f& d) {
        float pdf = 0;
        floor.value(d, pdf);
        return pdf > 0 ? double(probability * guide.pdf(point, d) + (1 - probability) * pdf) : 0.;
      });
  EXPECT_GT(fit.p_value, 0.01);
  // The guide's density grows without bound at the critical angle.
  EXPECT_NEAR(fit.integral, fit.drawn, 0.005);
}

TEST(WaterMesh, AloneIsTracedWithoutGaps) {
  Shot shot = plain_shot(1);
  shot.material = {dielectric("water", water_index), diffuse("cotton", 0.5f)};
  shot.fluid.material = "water";
  const TriangleMesh sheet = sheet_mesh(2, [](float, float) { return 3.f; });
  const Scene scene(shot, 1001, {sphere_mesh(2), {{"cloth", sheet}}}, {});
  ASSERT_EQ(scene.object_count(), 2u);
  for (uint32_t k = 0; k < 2; ++k) {
    const SceneObject& object = scene.object(k);
    const bool robust = rtcGetSceneFlags(object.scene.get()) & RTC_SCENE_FLAG_ROBUST;
    EXPECT_EQ(robust, object.body != 0) << object.name;
  }
}

TEST(WaterMesh, LosesNoRayThroughItsEdges) {
  // From inside a closed convex mesh every ray meets an inner side; from outside, leaving outwards,
  // none comes back.
  Shot shot = plain_shot(1);
  shot.material = {dielectric("water", water_index)};
  TriangleMesh mesh = sphere_mesh(5);
  translate(mesh, {10, 2, -3});  // away from the origin, where rounding is coarser
  const Scene scene(shot, 1001, {mesh, {}}, {});
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto direction = [&] {
    for (;;) {
      const V3f d(uniform(random), uniform(random), uniform(random));
      if (d.length2() < 1 && d.length2() > 0.01f) return d.normalized();
    }
  };
  Ray ray{V3f(10, 2, -3), direction(), 0};
  int lost = 0, caught = 0, wrong_side = 0;
  for (int k = 0; k < 400000; ++k) {
    const Hit hit = scene.intersect(ray, Coherence::incoherent);
    if (hit.kind != Hit::Kind::object) {
      ++lost;
      ray.origin = V3f(10, 2, -3);
      continue;
    }
    const Surface surface = scene.surface(ray, hit);
    wrong_side += surface.geometric_normal.dot(ray.direction) > 0 ? 0 : 1;
    V3f d = direction();
    if (d.dot(surface.geometric_normal) > 0) d = -d;
    const Ray away{surface.leave(-d), -d, 0};
    caught += scene.intersect(away, Coherence::incoherent).kind == Hit::Kind::object ? 1 : 0;
    ray = {surface.leave(d), d, 0};
  }
  EXPECT_EQ(lost, 0);
  EXPECT_EQ(wrong_side, 0);
  EXPECT_EQ(caught, 0);
}

/// Near the origin in the middle of the shutter, 25 m from it at its ends: places are rounded as
/// those are.
TEST(WaterMesh, LetsRaysGoOnWhereItFliesPast) {
  Shot shot = plain_shot(1);
  shot.material = {dielectric("water", water_index)};
  shot.render.motion_blur = true;
  TriangleMesh mesh = sphere_mesh(4);
  mesh.velocity.assign(mesh.position.size(), V3f(100 * 24, 60 * 24, -80 * 24));  // m/s
  const Scene scene(shot, 1001, {mesh, {}}, {});
  const float frames = float(shot.camera.shutter_close - shot.camera.shutter_open);
  ASSERT_NEAR(shot.camera.shutter_open, -frames / 2, 1e-9);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  int lost = 0, caught = 0;
  for (int k = 0; k < 200000; ++k) {
    const float time = 0.5f + 0.02f * uniform(random);
    const V3f center = mesh.velocity[0] * ((time - 0.5f) * frames / 24);
    const V3f d = V3f(uniform(random), uniform(random), 1.5f + uniform(random)).normalized();
    Ray ray{center, d, time};
    const Hit hit = scene.intersect(ray, Coherence::incoherent);
    if (hit.kind != Hit::Kind::object) {
      ++lost;
      continue;
    }
    const Surface surface = scene.surface(ray, hit);
    ray.origin = surface.leave(d);
    caught += scene.intersect(ray, Coherence::incoherent).kind == Hit::Kind::object ? 1 : 0;
    ray = {surface.leave(-d), d, time};
    lost += scene.intersect(ray, Coherence::incoherent).kind == Hit::Kind::object ? 0 : 1;
  }
  EXPECT_EQ(caught, 0);
  EXPECT_EQ(lost, 0);
}

TEST(WaterMesh, KnowsWhatLiesInside) {
  Shot shot = plain_shot(1);
  shot.material = {dielectric("water", water_index)};
  const Scene scene(shot, 1001, {sphere_mesh(4), {}}, {});
  EXPECT_TRUE(scene.bodies_at({0.1f, 0.2f, -0.3f}, 0) != 0);
  EXPECT_TRUE(scene.bodies_at({0, -0.98f, 0}, 0) != 0);
  EXPECT_FALSE(scene.bodies_at({0, -1.02f, 0}, 0) != 0);
  EXPECT_FALSE(scene.bodies_at({1.5f, 0, 0}, 0) != 0);
}

}  // namespace
}  // namespace drench::render::test
