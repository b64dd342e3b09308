// Surfaces: Fresnel and Snell, the cloth's densities and energy, textures where they belong.

#include <gtest/gtest.h>

#include <random>

#include "pipeline/contract/log.h"
#include "render/bsdf/bsdf_cloth.h"
#include "render/bsdf/bsdf_dielectric.h"
#include "render/bsdf/bsdf_fabric.h"
#include "render/bsdf/material.h"
#include "render/sampler.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

V3f at_angle(double angle) {  // towards a surface with normal +y
  return {float(std::sin(angle)), float(-std::cos(angle)), 0};
}

TEST(Interface, BendsBySnellsLaw) {
  for (double degrees = 1; degrees < 90; degrees += 4) {
    const double sin_in = std::sin(degrees * pi64 / 180);
    const InterfaceSplit split =
        split_at_interface(at_angle(degrees * pi64 / 180), {0, 1, 0}, 1.333f);
    EXPECT_NEAR(split.refracted.x, sin_in / 1.333, 1e-6);
    EXPECT_LT(split.refracted.y, 0);
    EXPECT_NEAR(split.reflected.x, sin_in, 1e-6);
    EXPECT_GT(split.reflected.y, 0);
  }
}

TEST(Interface, ReflectsHalfOfOnePolarisationAtBrewstersAngle) {
  // There the parallel part vanishes and the other is ((n^2 - 1) / (n^2 + 1))^2.
  const double n = 1.333;
  const InterfaceSplit split = split_at_interface(at_angle(std::atan(n)), {0, 1, 0}, float(n));
  EXPECT_NEAR(split.reflectance, 0.5 * std::pow((n * n - 1) / (n * n + 1), 2), 1e-6);
}

TEST(Interface, ReflectsTheSameShareFromBothSides) {
  for (double degrees = 1; degrees < 88; degrees += 3) {
    const InterfaceSplit out = split_at_interface(at_angle(degrees * pi64 / 180), {0, 1, 0}, 1.5f);
    const InterfaceSplit back = split_at_interface(-out.refracted, {0, -1, 0}, 1 / 1.5f);
    EXPECT_NEAR(out.reflectance, back.reflectance, 2e-5) << degrees;
  }
}

TEST(Interface, ReflectsTotallyBeyondTheCriticalAngle) {
  const double critical = std::asin(1 / 1.333);
  EXPECT_EQ(split_at_interface(at_angle(critical + 1e-3), {0, 1, 0}, 1 / 1.333f).reflectance, 1);
  EXPECT_LT(split_at_interface(at_angle(critical - 1e-3), {0, 1, 0}, 1 / 1.333f).reflectance, 1);
}

struct RandomCloth {
  std::mt19937 random{9};
  float uniform() { return std::uniform_real_distribution<float>(0, one_minus_epsilon)(random); }
  V3f direction() { return Basis({0, 0, 1}).world(sample_cone({uniform(), uniform()}, 2)); }
  ClothBsdf bsdf(float bend) {
    const V3f geometric = direction();
    V3f shading = normalized(geometric + direction() * bend);
    if (dot(shading, geometric) < 0.05f) shading = geometric;
    return {direction(), geometric, shading, V3f(0.5f, 0.3f, 0.1f), V3f(0.2f, 0.3f, 0.4f)};
  }
};

TEST(Cloth, SamplesWithTheDensityAndValueItStates) {
  RandomCloth cloth;
  int kept = 0;
  for (int k = 0; k < 20000; ++k) {
    const ClothBsdf bsdf = cloth.bsdf(0.5f);
    const Scatter s = bsdf.sample({cloth.uniform(), cloth.uniform()});
    if (!(s.pdf > 0)) continue;
    ++kept;
    float pdf = 0;
    const V3f value = bsdf.value(s.direction, pdf);
    ASSERT_NEAR(pdf, s.pdf, 1e-5f * pdf + 1e-7f);
    for (int c = 0; c < 3; ++c)
      ASSERT_NEAR(value[c], s.weight[c] * s.pdf, 1e-5f * value[c] + 1e-7f);
  }
  EXPECT_GT(kept, 15000);
}

// The 64 samples of a pixel say how much of either side's hemisphere lies beyond a plane twice as
// well as random ones would. (Were the side a number of its own, as badly: a side's directions
// would be a random part of the even set.)
TEST(Cloth, SpreadsThePixelsSamplesEvenlyOnBothSides) {
  const ClothBsdf bsdf({0, 1, 0}, {0, 1, 0}, {0, 1, 0}, V3f(0.5f), V3f(0.2f));
  constexpr int pixels = 400, samples = 64;
  for (const float side : {1.f, -1.f}) {
    const auto beyond = [&](const V2f& u) {
      const V3f d = bsdf.sample(u).direction;
      return d.y * side > 0 && d.x + 0.5f * d.z > 0.3f ? 1. : 0.;
    };
    double fraction = 0, squares = 0;
    for (int i = 0; i < 512; ++i)
      for (int j = 0; j < 512; ++j)
        fraction += beyond({(float(i) + 0.5f) / 512, (float(j) + 0.5f) / 512}) / (512. * 512);
    for (uint32_t pixel = 0; pixel < pixels; ++pixel) {
      double mean = 0;
      for (uint32_t s = 0; s < samples; ++s)
        mean += beyond(Sampler(PixelOrder::separate, 1, pixel, 0, 6, s).two(11)) / samples;
      squares += std::pow(mean - fraction, 2) / pixels;
    }
    EXPECT_LT(std::sqrt(squares), 0.5 * std::sqrt(fraction * (1 - fraction) / samples)) << side;
  }
}

TEST(Cloth, ReturnsReflectanceAndTransmittanceWhenFlatAndNeverMore) {
  RandomCloth cloth;
  for (const float bend : {0.f, 0.4f}) {
    const ClothBsdf bsdf = cloth.bsdf(bend);
    V3d sum(0);
    constexpr int draws = 1 << 18;
    for (int k = 0; k < draws; ++k) {  // uniform over the sphere
      float pdf = 0;
      sum += V3d(bsdf.value(cloth.direction(), pdf)) * (4 * pi64 / draws);
    }
    for (int c = 0; c < 3; ++c) {
      const double albedo = bsdf.albedo()[c];
      // |cos| over the sphere varies by 0.58 of its mean: 4 sigma of 2^18 draws is 0.5 %; the two
      // sides differ, which at most doubles that.
      EXPECT_LT(sum[c], albedo * 1.01);
      if (bend == 0) {
        EXPECT_NEAR(sum[c], albedo, albedo * 0.01);
      }
    }
  }
}

TEST(Cloth, IsTheSameSeenFromTheOtherEnd) {
  // f(a, b) = f(b, a): value / cos, on a flat sheet.
  RandomCloth cloth;
  for (int k = 0; k < 1000; ++k) {
    const V3f n = cloth.direction(), a = cloth.direction(), b = cloth.direction();
    const V3f r(0.5f), t(0.25f);
    float pdf = 0;
    const float forth = ClothBsdf(a, n, n, r, t).value(b, pdf).x / std::abs(dot(b, n));
    const float back = ClothBsdf(b, n, n, r, t).value(a, pdf).x / std::abs(dot(a, n));
    ASSERT_NEAR(forth, back, 1e-5f);
  }
}

// Light from behind a bowl that grazes it shows through by the cosine of the smooth bowl, not of
// the triangles: these were a chequer of lit and dark.
TEST(Cloth, ShowsNoTrianglesWhereLightGrazesIt) {
  Shot shot = plain_shot(64, 64);
  shot.render.depth = 1;
  Material cotton = diffuse("cotton", 0.4f);
  cotton.type = MaterialType::cloth;
  cotton.transmittance = V3f(0.4f);
  shot.material = {cotton};
  Light sun;
  sun.type = LightType::sun;
  sun.direction = {-1, -0.4, 0};  // along the bowl where its slope is 0.4, at x = 0.5
  sun.radiance = V3f(10);
  shot.light = {sun};
  const TriangleMesh bowl = sheet_mesh(24, [](float x, float) { return 0.4f * x * x; });
  shot.camera.position = V3d(0.75, 20, 0);
  shot.camera.target = V3d(0.75, 0.2, 0);
  shot.camera.up = V3d(0, 0, -1);
  shot.camera.fov_deg = 1.1;
  const Film film = render_frame(shot, 1001, {{}, {{"cloth", bowl}}});
  const double half = std::tan(0.55 * pi64 / 180) * 19.8;  // m
  double most = 0;
  for (int y = 0; y < film.height; ++y)
    for (int x = 0; x < film.width; ++x) {
      const double at = 0.75 + half * (2 * (x + 0.5) / film.width - 1);
      const double cos = (0.8 * at - 0.4) / std::sqrt((1 + 0.64 * at * at) * 1.16);
      const double shown = film.rgba[4 * (size_t(y) * film.width + x)];
      most = std::max(most, std::abs(shown - 0.4 * 10 * cos / pi64));
    }
  EXPECT_LT(most, 0.01);
}

/// A ball of 512 triangles under a slanting sun: how far it is at most from the ball that its
/// normals describe, up to the circle where light ends; in units of white facing the sun.
/// @param value  V3f(outgoing, normal, incoming): what its material makes of light, x |cos|
template <class Value>
double off_a_smooth_ball(const Material& material, const Value& value) {
  constexpr int picture_size = 96;
  Shot shot = plain_shot(64, picture_size);
  shot.render.depth = 1;
  shot.material = {material};
  shot.fluid.material = material.name;
  Light sun;
  sun.type = LightType::sun;
  sun.direction = {-1, -0.37, -0.21};
  sun.radiance = V3f(10);
  shot.light = {sun};
  const V3d eye(0, 0, 20);
  shot.camera.position = eye;
  shot.camera.target = V3d(0, 0, 0);
  shot.camera.fov_deg = 2 * std::atan(1 / 20.) * 180 / pi64;
  const Film film = render_frame(shot, 1001, {sphere_mesh(3), {}});
  double most = 0;
  int seen = 0;
  for (int y = 0; y < picture_size; ++y)
    for (int x = 0; x < picture_size; ++x) {
      const V3d d =
          V3d(2 * (x + 0.5) / picture_size - 1, 1 - 2 * (y + 0.5) / picture_size, -20).normalized();
      const double nearest2 = 400 - std::pow(eye.dot(d), 2);
      if (nearest2 > 0.8) continue;  // near its rim triangles are seen from the side
      const V3d n = eye - d * (eye.dot(d) + std::sqrt(1 - nearest2));
      const V3f in(-sun.direction.normalized());
      const double expected = value(V3f(-d), V3f(n), in).x * pi64;
      const double shown = film.rgba[4 * size_t(y * picture_size + x)] * pi64 / 10;
      most = std::max(most, std::abs(shown - expected));
      ++seen;
    }
  EXPECT_GT(seen, 5000);
  return most;
}

// With shadow rays from the triangles, which turn away before it, the circle where light ends was a
// saw of steps of 0.05 to 0.1.
TEST(Cloth, HasNoTriangularShadowsWhereLightEnds) {
  const auto value = [](const V3f& o, const V3f& n, const V3f& i) {
    float pdf = 0;
    return ClothBsdf(o, n, n, V3f(0.8f), V3f(0)).value(i, pdf);
  };
  EXPECT_LT(off_a_smooth_ball(diffuse("chalk", 0.8f), value), 0.01);
}

TEST(Coated, HasNoTriangularShadowsWhereLightEnds) {
  Material glaze = diffuse("glaze", 0.8f);
  glaze.type = MaterialType::coated;
  glaze.ior = 1.5;
  glaze.roughness = 0.6;  // wider than what triangles bend normals by
  const float alpha = 0.36f;
  const AlbedoTable table = AlbedoTable::dielectric(alpha, 1.5f);
  const auto value = [&](const V3f& o, const V3f& n, const V3f& i) {
    float pdf = 0;
    const CoatedBsdf bsdf(o, n, n, alpha, 1.5f, V3f(0.8f), table);
    return bsdf.coat().value(i, pdf) + bsdf.base().value(i, pdf);
  };
  EXPECT_LT(off_a_smooth_ball(glaze, value), 0.01);
}

TEST(Fabric, HasNoTriangularShadowsWhereLightEnds) {
  Material velvet = diffuse("velvet", 0.5f);
  velvet.type = MaterialType::cloth;
  velvet.sheen = V3f(0.5f);
  velvet.sheen_roughness = 0.3;
  const SheenTable fuzz(0.3f);
  FabricPoint point;
  point.dry = {V3f(0.5f), V3f(0)};
  point.sheen = V3f(0.5f);
  point.fuzz = &fuzz;
  const auto value = [&](const V3f& o, const V3f& n, const V3f& i) {
    float pdf = 0;
    return FabricBsdf(o, n, n, point).soft().value(i, pdf);
  };
  EXPECT_LT(off_a_smooth_ball(velvet, value), 0.01);
}

TEST(Texture, LiesOnTheClothByItsCoordinates) {
  forget_warnings();
  // A 2 x 2 picture: red, green above; blue, white below. u runs along x, v along z (sheet_mesh).
  const TemporaryFolder folder;
  const auto path = folder / "weave.png";
  write_png(path, 2, 2, {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255});
  Shot shot = plain_shot(16, 4);
  shot.light = {sky(1)};
  Material cotton = diffuse("cotton", 0.8f);
  cotton.texture = path;
  shot.material = {cotton};
  TriangleMesh sheet = sheet_mesh(2, [](float, float) { return 0.f; });
  const auto seen = [&](double x, double z) {
    aim_narrow(shot, {x, 3, z}, {x, 0, z});
    const Film film = render_frame(shot, 1001, {{}, {{"cloth", sheet}}});
    return V3f(float(channel_mean(film, 0).value), float(channel_mean(film, 1).value),
               float(channel_mean(film, 2).value));
  };
  // v = 0 is the picture's bottom and z = -1. Flat cloth under a sky of 1 shows its reflectance.
  const V3f blue = seen(-0.5, -0.5), white = seen(0.5, -0.5), red = seen(-0.5, 0.5),
            green = seen(0.5, 0.5);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(white[c], 0.8, 0.01);
  EXPECT_NEAR(red.x, 0.8 * 0.613, 0.01);
  EXPECT_NEAR(green.y, 0.8 * 0.916, 0.01);
  EXPECT_NEAR(blue.z, 0.8 * 0.870, 0.01);
  shot.material[0].texture_size = 0.5;  // twice along each edge
  for (const double x : {-0.75, 0.25})
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen(x, -0.75)[c], blue[c], 0.01);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen(-0.25, -0.75)[c], white[c], 0.01);
  EXPECT_TRUE(logged_warnings().empty());
  sheet.uv.clear();
  seen(0, 0);
  ASSERT_EQ(logged_warnings().size(), 1u);
  EXPECT_NE(logged_warnings()[0].text.find("\"cloth\" has no texture coordinates"),
            std::string::npos);
  forget_warnings();
}

TEST(Checker, AlternatesInSquaresOfItsSize) {
  Shot shot;
  Material ground = diffuse("ground", 0.6f);
  ground.checker = true;
  ground.checker_size = 0.25;
  shot.material = {ground};
  const ShadingMaterial material = find_material(shot, "ground");
  const float light = material.reflectance_at({0.1f, 0.1f}).x;
  EXPECT_FLOAT_EQ(light, 0.6f);
  EXPECT_LT(material.reflectance_at({0.3f, 0.1f}).x, light);
  EXPECT_LT(material.reflectance_at({-0.1f, 0.1f}).x, light);
  EXPECT_FLOAT_EQ(material.reflectance_at({-0.1f, -0.1f}).x, light);
  EXPECT_FLOAT_EQ(material.reflectance_at({0.6f, 0.1f}).x, light);
}

}  // namespace
}  // namespace drench::render::test
