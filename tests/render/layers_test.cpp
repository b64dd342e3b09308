// Layers of a film: geometry and motion against the camera's own formulas, light groups against the
// beauty and against pictures with one group alone, Cryptomatte against areas, variance against the
// scatter over seeds.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>

#include "render/film/cryptomatte.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

const FilmLayer& layer_of(const Film& film, const std::string& name) {
  for (const FilmLayer& layer : film.layer)
    if (layer.name == name) return layer;
  throw std::runtime_error("no layer " + name);
}

float at(const Film& film, const std::string& name, int x, int y, size_t channel) {
  const FilmLayer& layer = layer_of(film, name);
  return layer.value[layer.channel.size() * size_t(y * film.width + x) + channel];
}

LayerSettings all_layers() { return {true, true, true, true, true, true, true, true, true}; }

/// A pool of water over a ground, a lamp, a sun and the sky.
Shot pool_shot(int samples) {
  Shot shot = plain_shot(samples);
  add_ground(shot, 0.5f);
  shot.material.push_back(dielectric("water", 1.333));
  shot.camera.position = V3d(0, 3, 4);
  shot.camera.target = V3d(0, 0, 0);
  shot.light = {panel({0, 4, 0}, 0.3, 0.3, 20), sky(0.4f)};
  Light sun;
  sun.type = LightType::sun;
  sun.name = "sun";
  sun.radiance = V3f(2, 1.5f, 1);
  sun.direction = V3d(0.3, -1, 0.2);
  shot.light.push_back(sun);
  shot.render.photons = 1;
  return shot;
}

FrameGeometry pool_geometry() {
  FrameGeometry geometry;
  geometry.fluid = box_mesh({-0.6f, 0.2f, -0.6f}, {0.6f, 0.5f, 0.6f});
  return geometry;
}

TEST(LightGroups, SumToTheBeauty) {
  Shot shot = pool_shot(16);
  shot.layers.light_groups = true;
  shot.light[2].group = "out_of_doors";
  shot.light[1].group = "out_of_doors";
  FrameGeometry geometry = pool_geometry();
  Obstacle lantern;
  lantern.name = "lantern";
  lantern.material = "glow";
  shot.obstacle = {lantern};
  shot.material.push_back(diffuse("glow", 0.2f));
  shot.material.back().emission = V3f(3, 2, 1);
  geometry.obstacle = {{"lantern", box_mesh({-0.2f, 0.8f, -0.2f}, {0.2f, 1.2f, 0.2f})}};
  const Film film = render_frame(shot, 1001, geometry);
  ASSERT_EQ(film.layer.size(), 4u);  // panel, out_of_doors, the lantern, caustics
  const std::vector<float>& glow = layer_of(film, "light_lantern").value;
  EXPECT_GE(*std::max_element(glow.begin(), glow.end()), 2);
  for (int k = 0; k < film.width * film.height; ++k)
    for (size_t c = 0; c < 3; ++c) {
      double sum = 0;
      for (const FilmLayer& layer : film.layer) sum += layer.value[3 * size_t(k) + c];
      EXPECT_NEAR(sum, film.rgba[4 * size_t(k) + c], 2e-6 * sum) << k;
    }
}

/// Every group is what the picture would be with its lights alone, the others in place but dark: a
/// panel hides some of the sky.
TEST(LightGroups, HoldWhatTheirLightsGive) {
  Shot shot = pool_shot(256);
  shot.layers.light_groups = true;
  shot.render.photons = 0;
  const FrameGeometry geometry = pool_geometry();
  const Film together = render_frame(shot, 1001, geometry);
  for (const Light& light : pool_shot(1).light) {
    Shot alone = shot;
    for (Light& other : alone.light)
      if (other.name != light.name) other.radiance = V3f(0);
    alone.render.seed = 2;
    const Film film = render_frame(alone, 1001, geometry);
    double sum = 0, expected = 0, difference2 = 0;
    const FilmLayer& layer = layer_of(together, "light_" + light.name);
    const size_t pixels = layer.value.size() / 3;
    for (size_t p = 0; p < pixels; ++p) {
      const double d = layer.value[3 * p + 1] - film.rgba[4 * p + 1];
      sum += layer.value[3 * p + 1];
      expected += film.rgba[4 * p + 1];
      difference2 += d * d;
    }
    EXPECT_GT(sum, 0) << light.name;
    EXPECT_NEAR(sum, expected, 4 * std::sqrt(difference2)) << light.name;
  }
}

TEST(Layers, LeaveTheBeautyAsItIs) {
  Shot shot = pool_shot(8);
  const Film plain = render_frame(shot, 1001, pool_geometry());
  EXPECT_TRUE(plain.layer.empty());
  shot.layers = all_layers();
  const Film film = render_frame(shot, 1001, pool_geometry());
  EXPECT_EQ(film.rgba, plain.rgba);
  EXPECT_EQ(film.layer.size(), 7u + 4u + 6u);  // single ones, light groups, two mattes of three
}

TEST(Layers, TellWhereAndWhatIsSeen) {
  Shot shot = plain_shot(4, 32);
  add_ground(shot, 0.3f, 2);
  shot.layers = all_layers();
  shot.light = {sky(1)};
  shot.camera.position = V3d(0, 1, 4);
  shot.camera.target = V3d(0, 0, 0);
  const Film film = render_frame(shot, 1001, {});
  const V3d forward = (V3d(0, 0, 0) - V3d(0, 1, 4)).normalized();
  const V3d right(1, 0, 0), up = right % forward;
  const double scale = 2 * std::tan(shot.camera.fov_deg.at(0) * pi64 / 360) / 32;
  int seen = 0, missed = 0;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      const V3d p(at(film, "P", x, y, 0), at(film, "P", x, y, 1), at(film, "P", x, y, 2));
      const double depth = at(film, "depth", x, y, 0);
      if (depth > 1e9) {
        EXPECT_EQ(at(film, "albedo", x, y, 0), 0);
        ++missed;
        continue;
      }
      ++seen;
      EXPECT_EQ(p.y, 0);
      EXPECT_NEAR((p - V3d(0, 1, 4)).dot(forward), depth, 1e-5 * depth);
      // Within the filter of 1.5 pixels around the pixel's centre.
      const V3d to = (p - V3d(0, 1, 4)) / depth;
      EXPECT_NEAR(to.dot(right) / scale + 16, x + 0.5, 1.5001);
      EXPECT_NEAR(16 - to.dot(up) / scale, y + 0.5, 1.5001);
      const float coverage = at(film, "CryptoObject00", x, y, 1);
      EXPECT_NEAR(at(film, "N", x, y, 1), coverage, 1e-6);
      EXPECT_NEAR(at(film, "albedo", x, y, 1), 0.3f * coverage, 1e-6);
    }
  EXPECT_GT(seen, 100);
  EXPECT_GT(missed, 100);
}

/// Of what lies under water the surface's normal is told, and the ground's albedo.
TEST(Layers, AlbedoLooksThroughWater) {
  Shot shot = pool_shot(16);
  shot.layers.albedo = shot.layers.normal = true;
  shot.light = {panel({0, 9, 0}, 0.3, 0.3, 20)};
  aim_narrow(shot, {0, 3, 0}, {0, 0, 0});
  shot.material[1].absorption = V3f(2, 1, 0);
  const Film film = render_frame(shot, 1001, pool_geometry());
  double albedo[3] = {0, 0, 0}, normal = 0;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) {
      for (size_t c = 0; c < 3; ++c) albedo[c] += at(film, "albedo", x, y, c) / 256;
      normal += at(film, "N", x, y, 1) / 256;
    }
  // A slab of 0.3 m: R and T of two faces; what is mirrored is the sky and counts as black ground,
  // so white; inside it once more.
  const double r = 0.333 * 0.333 / (2.333 * 2.333);
  for (size_t c = 0; c < 3; ++c) {
    const double a = std::exp(-0.3 * shot.material[1].absorption[int(c)]);
    const double through = (1 - r) * (1 - r) * a / (1 - r * r * a * a);
    const double back = r + (1 - r) * (1 - r) * r * a * a / (1 - r * r * a * a);
    EXPECT_NEAR(albedo[c], 0.5 * through + back, 0.01) << c;
  }
  EXPECT_NEAR(normal, 1, 1e-6);
}

TEST(Motion, IsThatOfThingsAndOfTheCamera) {
  Shot shot = plain_shot(4, 32);
  shot.layers.motion = shot.layers.depth = true;
  shot.light = {sky(1)};
  shot.material.push_back(diffuse("ground", 0.5f));
  Obstacle box;
  box.name = "box";
  shot.obstacle = {box};
  shot.camera.fov_deg = 40.0;
  shot.camera.target = V3d(0, 0, 0);
  FrameGeometry geometry;
  ObstacleFrame moving{"box", box_mesh({-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.f})};
  for (V3f& v : moving.mesh.velocity) v = V3f(2.4f, -1.2f, 0);  // 0.1 and -0.05 m a frame
  geometry.obstacle = {moving};
  const double pixels_per_m = 32 / (2 * std::tan(20 * pi64 / 180) * 4);
  const auto expect = [&](double x, double y, const std::string& what) {
    for (const bool blur : {false, true}) {
      shot.render.motion_blur = blur;
      const Film film = render_frame(shot, 1001, geometry);
      ASSERT_LT(at(film, "depth", 16, 16, 0), 1e9);
      EXPECT_NEAR(at(film, "motion", 16, 16, 0), x, 1e-3) << what << blur;
      EXPECT_NEAR(at(film, "motion", 16, 16, 1), y, 1e-3) << what << blur;
      EXPECT_NEAR(at(film, "motion", 16, 16, 2), 0, 1e-5) << what << blur;
    }
  };
  shot.camera.position = V3d(0, 0, 4);
  expect(0.1 * pixels_per_m, -0.05 * pixels_per_m, "box ");
  // The camera goes along with the box, and so stays what it sees.
  shot.camera.position.keys = {{1001, V3d(0, 0, 4)}, {1002, V3d(0.1, -0.05, 4)}};
  shot.camera.target.keys = {{1001, V3d(0, 0, 0)}, {1002, V3d(0.1, -0.05, 0)}};
  expect(0, 0, "both ");
  for (V3f& v : geometry.obstacle[0].mesh.velocity) v = V3f(0);
  expect(-0.1 * pixels_per_m, 0.05 * pixels_per_m, "camera ");
  shot.camera.position = V3d(0, 0, 4);
  shot.camera.target = V3d(0, 0, 0);
  for (V3f& v : geometry.obstacle[0].mesh.velocity) v = V3f(0, 0, -2.4f);
  EXPECT_NEAR(at(render_frame(shot, 1001, geometry), "motion", 16, 16, 2), 0.1, 1e-5);
}

/// What approaches is farther out on the film the later it is seen: late rows must tell of where it
/// is at the frame, too.
TEST(Motion, OfLateRowsStartsAtTheFrame) {
  Shot shot = plain_shot(4, 32);
  shot.layers.motion = shot.layers.position = true;
  shot.render.motion_blur = true;
  shot.camera.rolling_shutter = 2;
  shot.light = {sky(1)};
  shot.material.push_back(diffuse("ground", 0.5f));
  Obstacle box;
  box.name = "box";
  shot.obstacle = {box};
  shot.camera.fov_deg = 40.0;
  shot.camera.position = V3d(0, 0, 4);
  shot.camera.target = V3d(0, 0, 0);
  FrameGeometry geometry;
  ObstacleFrame moving{"box", box_mesh({-4, -4, -1}, {4, 4, 0})};
  for (V3f& v : moving.mesh.velocity) v = V3f(0, 0, 24);  // 1 m a frame
  geometry.obstacle = {moving};
  const Film film = render_frame(shot, 1001, geometry);
  // Its face is 4 m away at the frame and 3 m at the next.
  const double growth = 32 / (2 * std::tan(20 * pi64 / 180)) * (1. / 3 - 1. / 4);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x)
      for (size_t c = 0; c < 2; ++c)
        EXPECT_NEAR(at(film, "motion", x, y, c), growth * at(film, "P", x, y, c), 1e-4);
  EXPECT_GT(at(film, "P", 16, 31, 2), 0.7) << "the last row's shutter opens at 0.75 frames";
}

// Published values of MurmurHash3_x86_32 with seed 0.
TEST(Cryptomatte, HashesAsTheSpecificationDoes) {
  EXPECT_EQ(murmur3(""), 0u);
  EXPECT_EQ(murmur3("hello"), 0x248bfa47u);
  EXPECT_EQ(murmur3("hello, world"), 0x149bbb7fu);
  EXPECT_EQ(murmur3("The quick brown fox jumps over the lazy dog"), 0x2e4ff723u);
  for (int k = 0; k < 100000; ++k) {
    const float id = cryptomatte_id("thing" + std::to_string(k));
    ASSERT_TRUE(std::isnormal(id)) << k;
  }
}

TEST(Cryptomatte, CoversTheAreaOfThings) {
  Shot shot = plain_shot(64, 32);
  shot.layers.cryptomatte = shot.layers.samples = true;
  shot.light = {sky(1)};
  shot.material = {diffuse("steel", 0.5f), diffuse("ground", 0.5f)};
  Obstacle ball;
  ball.name = "ball";
  ball.material = "steel";
  shot.obstacle = {ball};
  shot.camera.position = V3d(0, 0, 40);
  shot.camera.target = V3d(0, 0, 0);
  shot.camera.fov_deg = 4.0;
  FrameGeometry geometry;
  geometry.obstacle = {{"ball", sphere_mesh(6)}};
  const Film film = render_frame(shot, 1001, geometry);
  double area = 0;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      const float fraction = at(film, "CryptoObject00", x, y, 1);
      if (fraction > 0) {
        EXPECT_EQ(at(film, "CryptoObject00", x, y, 0), cryptomatte_id("ball"));
        EXPECT_EQ(at(film, "CryptoMaterial00", x, y, 0), cryptomatte_id("steel"));
      }
      EXPECT_EQ(at(film, "CryptoMaterial00", x, y, 1), fraction);
      EXPECT_EQ(at(film, "samples", x, y, 0), 64);
      area += fraction;
    }
  // The silhouette of a sphere of radius 1 seen from 40: tan(asin(1 / 40)).
  const double radius = std::tan(std::asin(1. / 40)) * 32 / (2 * std::tan(2 * pi64 / 180));
  EXPECT_NEAR(area, pi64 * radius * radius, 0.003 * area);
}

TEST(Cryptomatte, RanksByShare) {
  CryptomattePixel pixel;
  for (const int thing : {2, 0, 2, -1, 1, 2, 0, 3}) pixel.add(thing);
  const auto ranked = pixel.ranked({10, 11, 12, 13}, 8);
  const std::array<float, 12> expected{12, 3 / 8.f, 10, 2 / 8.f, 11, 1 / 8.f,
                                       13, 1 / 8.f, 0,  0,       0,  0};
  EXPECT_EQ(ranked, expected);
}

TEST(Variance, IsThatOfPicturesWithOtherSeeds) {
  Shot shot = pool_shot(64);
  shot.layers.variance = true;
  constexpr int seeds = 48;
  double told = 0;
  std::vector<double> sum(256), square(256);
  for (int seed = 1; seed <= seeds; ++seed) {
    shot.render.seed = uint32_t(seed);
    shot.render.photons = 0;
    const Film film = render_frame(shot, 1001, pool_geometry());
    for (size_t p = 0; p < 256; ++p) {
      const double v = std::min(film.rgba[4 * p + 1], 2.f);
      sum[p] += v;
      square[p] += v * v;
      told += layer_of(film, "variance").value[3 * p + 1] / seeds;
    }
  }
  double real = 0;
  for (size_t p = 0; p < 256; ++p) real += (square[p] - sum[p] * sum[p] / seeds) / (seeds - 1);
  // Smaller nets know less of stratification: it may tell too much, hardly too little.
  EXPECT_GT(told, 0.8 * real);
  EXPECT_LT(told, 3 * real);
}

TEST(LayerFile, HasTheChannelsAndTheirValues) {
  const TemporaryFolder folder;
  Shot shot = pool_shot(4);
  shot.layers = all_layers();
  const Film film = render_frame(shot, 1001, pool_geometry());
  write_exr(folder / "a.exr", film, {{"shot", "pool"}});
  Imf::InputFile file((folder / "a.exr").c_str());
  const Imf::ChannelList& channels = file.header().channels();
  size_t count = 4;
  for (const FilmLayer& layer : film.layer) {
    count += layer.channel.size();
    for (size_t c = 0; c < layer.channel.size(); ++c) {
      const std::string name = layer.name + "." + layer.channel[c];
      ASSERT_TRUE(channels.findChannel(name)) << name;
      const bool full = layer.precision == FilmLayer::Precision::full;
      EXPECT_EQ(channels.findChannel(name)->type, full ? Imf::FLOAT : Imf::HALF) << name;
      std::vector<float> back(256);
      Imf::FrameBuffer buffer;
      buffer.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(back.data()), 4, 64));
      file.setFrameBuffer(buffer);
      file.readPixels(0, 15);
      for (size_t p = 0; p < 256; ++p) {
        const float value = layer.value[layer.channel.size() * p + c];
        if (full)
          EXPECT_EQ(std::bit_cast<uint32_t>(back[p]), std::bit_cast<uint32_t>(value)) << name;
        else
          EXPECT_NEAR(back[p], value, std::abs(value) / 2048 + 1e-7) << name;
      }
    }
  }
  for (auto channel = channels.begin(); channel != channels.end(); ++channel) --count;
  EXPECT_EQ(count, 0u);
  const auto text = [&](const std::string& key) {
    return file.header().typedAttribute<Imf::StringAttribute>(key).value();
  };
  const std::string key =
      "cryptomatte/" + fmt::format("{:08x}", murmur3("CryptoObject")).substr(0, 7) + "/";
  EXPECT_EQ(text(key + "name"), "CryptoObject");
  const auto manifest = nlohmann::json::parse(text(key + "manifest"));
  EXPECT_EQ(manifest.at("fluid").get<std::string>(),
            fmt::format("{:08x}", std::bit_cast<uint32_t>(cryptomatte_id("fluid"))));
  EXPECT_EQ(manifest.size(), 2u);
}

TEST(LayerFile, RefusesChannelsOfOneName) {
  const TemporaryFolder folder;
  Film film{1, 1, {0, 0, 0, 1}};
  const FilmLayer one{"a", {"X"}, FilmLayer::Precision::half, {1}};
  film.layer = {one, one};
  EXPECT_THROW(write_exr(folder / "a.exr", film, {}), Error);
  film.layer = {{"a", {"X"}, FilmLayer::Precision::half, {1, 2}}};
  EXPECT_THROW(write_exr(folder / "a.exr", film, {}), Error);
}

}  // namespace
}  // namespace drench::render::test
