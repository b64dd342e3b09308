// Suns that are taken out of environment maps: what they take, what they leave, and what a picture
// gains.

#include "render/light/environment_suns.h"

#include <gtest/gtest.h>

#include "render/color/color.h"
#include "render/light/lights.h"
#include "tests/render/puddle.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

struct Disc {
  V3d toward;  // unit
  double diameter_deg = 0.5;
  V3f radiance;
};

V3d direction_of(double column, double row, int width, int height) {
  const double phi = (column / width - 0.5) * 2 * pi64, theta = row / height * pi64;
  return {std::sin(theta) * std::sin(phi), std::cos(theta), -std::sin(theta) * std::cos(phi)};
}

V3f gradient(const V3d& d) { return V3f(0.4f, 0.5f, 0.8f) * float(d.y > 0 ? 1 - 0.5 * d.y : 0.2); }

/// A sky with discs, each texel the mean over its area.
SkyMap sky_map(int width, const std::vector<Disc>& discs) {
  const int height = width / 2;
  SkyMap map{width, height, {}};
  for (int r = 0; r < height; ++r)
    for (int c = 0; c < width; ++c) {
      const V3d middle = direction_of(c + 0.5, r + 0.5, width, height);
      V3f texel = gradient(middle);
      for (const Disc& disc : discs) {
        const double cosine = std::cos(disc.diameter_deg * pi64 / 360);
        if (middle.dot(disc.toward) < std::cos(disc.diameter_deg * pi64 / 360 + 8. / width))
          continue;
        double covered = 0;
        for (int i = 0; i < 16; ++i)
          for (int j = 0; j < 16; ++j)
            covered += direction_of(c + (i + 0.5) / 16, r + (j + 0.5) / 16, width, height)
                           .dot(disc.toward) >= cosine;
        texel += disc.radiance * float(covered / 256);
      }
      map.texel.push_back(texel);
    }
  return map;
}

Light map_light(const SkyMap& map, const std::filesystem::path& path) {
  Film film{map.width, map.height, {}};
  for (const V3f& t : map.texel) film.rgba.insert(film.rgba.end(), {t.x, t.y, t.z, 1});
  write_exr(path, film, {});
  Light light = sky(1);
  light.map = path;
  return light;
}

/// Irradiance of planes that face the directions, by four points in every cell between texels.
std::vector<V3d> irradiances(const Environment& sky, int width, const std::vector<V3d>& normals) {
  std::vector<V3d> sums(normals.size(), V3d(0));
  const int height = width / 2;
  for (int r = -1; r < 2 * height - 1; ++r)  // half cells, between rows' middles
    for (int c = 0; c < 2 * width; ++c)
      for (const double s : {0.2113248654051871, 0.7886751345948129})
        for (const double t : {0.2113248654051871, 0.7886751345948129}) {
          const double row = (r + 1 + s) / 2;
          const V3d d = direction_of((c + t) / 2, row, width, height);
          const double area =
              std::sin(row / height * pi64) * pi64 * pi64 / (double(height) * width) / 8;
          const V3d light = V3d(sky.radiance(V3f(d))) * area;
          for (size_t k = 0; k < normals.size(); ++k)
            sums[k] += light * std::max(0., d.dot(normals[k]));
        }
  return sums;
}

void expect_the_light_of(const Light& light, int width, const std::vector<V3d>& normals) {
  Light whole = light;
  whole.split_suns = false;
  const Environment before(whole, Environment::Sampling::off),
      after(light, Environment::Sampling::off);
  ASSERT_FALSE(after.suns().empty());
  EXPECT_TRUE(before.suns().empty());
  const auto expected = irradiances(before, width, normals),
             found = irradiances(after, width, normals);
  for (size_t k = 0; k < normals.size(); ++k)
    for (int c = 0; c < 3; ++c) {
      double all = found[k][c];
      for (const ExtractedSun& sun : after.suns())
        all += sun.irradiance[c] * std::max(0., normals[k].dot(V3d(sun.toward)));
      EXPECT_NEAR(all, expected[k][c], 1e-4 * expected[k][c]) << k << ' ' << c;
    }
}

const V3d sun_toward = V3d(0.5, 0.7, -0.4).normalized();

TEST(ExtractedSuns, KeepTheIrradianceOfEveryPlane) {
  const TemporaryFolder folder;
  // Planes that see the sun or see it not, but none that it sets on.
  const std::vector<V3d> normals{{0, 1, 0},
                                 {1, 0, 0},
                                 {0, 0, -1},
                                 sun_toward,
                                 {0, -1, 0},
                                 {-1, 0, 0},
                                 V3d(1, 1, 0).normalized()};
  constexpr int map_width = 720;
  Light light = map_light(sky_map(map_width, {{sun_toward, 0.5, V3f(30000, 25000, 20000)}}),
                          folder / "sun.exr");
  light.rotation_deg = 77;
  light.radiance = {0.5f, 1, 2};
  expect_the_light_of(light, map_width, normals);
}

// At the zenith rows end, at -X..+X of +Z columns do.
TEST(ExtractedSuns, KeepTheIrradianceAtPolesAndAtTheSeam) {
  const TemporaryFolder folder;
  const std::vector<V3d> normals{{0, 1, 0}, {0, 0, 1}, V3d(1, 2, 3).normalized()};
  constexpr int map_width = 720;
  for (const V3d& toward : {V3d(0, 1, 0), V3d(0, 0.2, 1).normalized()}) {
    const Light light =
        map_light(sky_map(map_width, {{toward, 1, V3f(9000, 8000, 7000)}}), folder / "edge.exr");
    const Environment sky(light, Environment::Sampling::off);
    ASSERT_EQ(sky.suns().size(), 1u);
    EXPECT_NEAR((V3d(sky.suns()[0].toward) - toward).length(), 0, 2e-4);
    std::vector<V3d> clear{normals[0], normals[2]};
    if (toward.y < 0.5) clear.push_back(normals[1]);
    expect_the_light_of(light, map_width, clear);
  }
}

// A single texel of 5.6 degrees: what it lights is its tent, twice as wide.
TEST(ExtractedSuns, KeepTheIrradianceOfOneLargeTexel) {
  const TemporaryFolder folder;
  constexpr int map_width = 64;
  SkyMap map = sky_map(map_width, {});
  map.texel[8 * map_width + 20] = V3f(500, 400, 300);
  expect_the_light_of(map_light(map, folder / "texel.exr"), map_width,
                      {{0, 1, 0}, direction_of(20, 12, map_width, map_width / 2)});
}

TEST(ExtractedSuns, HaveTheDirectionSizeAndColourOfTheDisc) {
  for (const double diameter : {0.5, 2.}) {
    SkyMap map = sky_map(2048, {{sun_toward, diameter, V3f(9000, 8000, 6000)}});
    const std::vector<ExtractedSun> suns = extract_suns(map, 0);
    ASSERT_EQ(suns.size(), 1u);
    const double half = diameter * pi64 / 360;
    EXPECT_NEAR((V3d(suns[0].toward) - sun_toward).length(), 0, 1e-4);
    // What half-covered texels at the rim are worth depends on how they fall.
    EXPECT_NEAR(suns[0].solid_angle, pi64 * half * half,
                (diameter < 1 ? 0.25 : 0.07) * pi64 * half * half);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(suns[0].irradiance[c], V3f(9000, 8000, 6000)[c] * pi64 * half * half,
                  0.01 * suns[0].irradiance[c]);
    float most = 0;
    for (const V3f& t : map.texel) most = std::max(most, luminance(t));
    EXPECT_LT(most, 30);  // 1 % of a texel of the disc may stay
  }
}

TEST(ExtractedSuns, AreAsManyAsThereAre) {
  const V3d other = V3d(-0.8, 0.3, 0.2).normalized();
  SkyMap map = sky_map(1024, {{sun_toward, 1, V3f(9000)}, {other, 2, V3f(3000, 100, 100)}});
  const std::vector<ExtractedSun> suns = extract_suns(map, 0);
  ASSERT_EQ(suns.size(), 2u);
  const bool first = (V3d(suns[0].toward) - sun_toward).length() < 0.1;
  EXPECT_NEAR((V3d(suns[first].toward) - other).length(), 0, 1e-3);
  EXPECT_GT(suns[first].irradiance.x, 20 * suns[first].irradiance.y);
}

// A glow of 12 degrees is no sun, but the disc in it is.
TEST(ExtractedSuns, StandInAGlowThatStays) {
  SkyMap map = sky_map(1024, {{sun_toward, 12, V3f(150)}, {sun_toward, 1, V3f(40000)}});
  const SkyMap before = map;
  const std::vector<ExtractedSun> suns = extract_suns(map, 0);
  ASSERT_EQ(suns.size(), 1u);
  const double half = 0.5 * pi64 / 180;
  EXPECT_NEAR(suns[0].irradiance.x, 40000 * pi64 * half * half, 0.02 * suns[0].irradiance.x);
  size_t changed = 0;
  for (size_t t = 0; t < map.texel.size(); ++t) {
    changed += map.texel[t] != before.texel[t];
    if (before.texel[t].x > 149 && before.texel[t].x < 152) {
      EXPECT_EQ(map.texel[t], before.texel[t]);
    }
    EXPECT_LT(map.texel[t].x, 2000);
  }
  EXPECT_LT(changed, 60u);  // the disc has a quarter of a square degree's 8 texels
}

// Windows are too large, and specks too faint, to be worth a lamp.
TEST(ExtractedSuns, AreNotInMapsOfLargeOrFaintLights) {
  for (const Disc& disc : {Disc{sun_toward, 20, V3f(500)}, Disc{sun_toward, 0.5, V3f(300)},
                           Disc{sun_toward, 3, V3f(5)}}) {
    SkyMap map = sky_map(512, {disc});
    const SkyMap before = map;
    EXPECT_TRUE(extract_suns(map, 0).empty()) << disc.diameter_deg;
    EXPECT_EQ(map.texel, before.texel);
  }
  SkyMap black{8, 4, std::vector<V3f>(32, V3f(0))};
  EXPECT_TRUE(extract_suns(black, 0).empty());
}

TEST(ExtractedSuns, LightAPlaneAsTheFormulaSays) {
  const TemporaryFolder folder;
  Shot shot = plain_shot(256);
  add_ground(shot, 0.5f);
  aim_narrow(shot, {3, 2, 0}, {0, 0, 0});
  const Disc disc{sun_toward, 0.5, V3f(40000)};
  shot.light = {map_light(sky_map(1440, {disc}), folder / "sun.exr")};
  // Of the sky (1 - y / 2) from above: 2 pi (1/2 - 1/6).
  const double half = 0.25 * pi64 / 180;
  const double sun = 40000 * pi64 * std::sin(half) * std::sin(half) * sun_toward.y;
  const Film film = render_frame(shot, 1001, {});
  for (int c = 0; c < 3; ++c) {
    const double irradiance = V3f(0.4f, 0.5f, 0.8f)[c] * 2 * pi64 / 3 + sun;
    const Mean mean = channel_mean(film, c);
    EXPECT_LT(mean.error, 0.005 * mean.value);  // without the split it is more than a tenth
    // 1 % for the disc in texels half its width, and for maps of half floats.
    EXPECT_NEAR(mean.value, 0.5 * irradiance / pi64, 0.01 * mean.value);
  }
}

TEST(ExtractedSuns, AreSeenInTheSky) {
  const TemporaryFolder folder;
  Shot shot = plain_shot(16, 64);
  shot.light = {map_light(sky_map(1440, {{sun_toward, 2, V3f(20000)}}), folder / "sun.exr")};
  aim_narrow(shot, {0, 0, 0}, sun_toward, 4);
  const Mean split = channel_mean(render_frame(shot, 1001, {}), 1);
  shot.light[0].split_suns = false;
  const Mean whole = channel_mean(render_frame(shot, 1001, {}), 1);
  EXPECT_NEAR(split.value, whole.value, 0.005 * whole.value);
}

// Under waves: photons and guided rays of the sun against a map that is left whole, by paths alone.
TEST(ExtractedSuns, GiveTheCausticThatPathsFindInTheMap) {
  const TemporaryFolder folder;
  Shot shot = puddle_shot(V3f(0.3f));
  shot.light = {map_light(sky_map(360, {{sun_toward, 6, V3f(300)}}), folder / "sun.exr")};
  const Mean guided = mean_over_seeds(shot, {waves(), {}}, {}, 8);
  shot.render.photons = 6;
  const Mean photons = mean_over_seeds(shot, {waves(), {}}, {}, 8);
  shot.render.photons = 0;
  shot.light[0].split_suns = false;
  const Mean paths = mean_over_seeds(shot, {waves(), {}}, {}, 24);
  EXPECT_LT(paths.error, 0.01 * paths.value);
  for (const Mean& mean : {guided, photons}) {
    EXPECT_LT(mean.error, paths.error);
    EXPECT_NEAR(mean.value, paths.value,
                4 * std::hypot(mean.error, paths.error) + 0.005 * paths.value);
  }
}

}  // namespace
}  // namespace drench::render::test
