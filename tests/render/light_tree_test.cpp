// Many lights drawn from a tree, against asking each of them.

#include "render/light/light_tree.h"

#include <gtest/gtest.h>

#include <random>

#include "render/light/lights.h"
#include "render/scene/scene_cache.h"
#include "tests/render/chi_square.h"
#include "tests/render/puddle.h"

namespace drench::render::test {
namespace {

constexpr int many = 60;

/// Lamps of every shape about a point, turned all ways, large and small, far and near each other.
std::vector<Light> many_lamps(uint32_t seed, const V3d& about, double spread, double size) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0.1, 1);
  const auto vector = [&] { return V3d(normal(random), normal(random), normal(random)); };
  std::vector<Light> lamps(many);
  for (size_t k = 0; k < lamps.size(); ++k) {
    Light& lamp = lamps[k];
    lamp.name = "lamp" + std::to_string(k);
    lamp.group = "lamps";
    lamp.type = k % 3 == 0   ? LightType::rectangle
                : k % 3 == 1 ? LightType::disk
                             : LightType::sphere;
    lamp.center = about + vector() * (k % 5 == 0 ? 0.1 * spread : spread);
    lamp.radius = size * unit(random);
    lamp.direction = vector();
    lamp.u = vector() * size;
    lamp.v = vector() * size;
    lamp.radiance = V3f(float(unit(random) * unit(random)));
  }
  return lamps;
}

/// Every third a shining body, the others lamps.
struct Crowd {
  SceneCache cache;
  std::vector<TriangleMesh> ball;
  Lights lights;

  explicit Crowd(uint32_t seed)
      : lights(many_lamps(seed, {0, 0, 0}, 2, 0.2), Lights::SampleEnvironment::never, cache) {
    std::mt19937 random(seed + 1);
    std::normal_distribution<float> normal;
    for (int k = 0; k < many / 2; ++k) {
      ball.push_back(sphere_mesh(2));
      for (V3f& p : ball.back().position) p = p * 0.1f + V3f(normal(random), 0, normal(random));
    }
    for (const TriangleMesh& mesh : ball)
      lights.add_mesh({mesh.triangle, {mesh.position.data()}}, V3f(1), "balls");
    lights.finish();
  }

  size_t count(int kinds) const {
    return lights.shapes().size() + (kinds == 2 ? lights.meshes().size() : 0);
  }
  auto importance(const V3f& from) const {
    return [this, from](uint32_t k) {
      const size_t lamps = count(1);
      return k < lamps ? lights.shapes()[k].importance(from)
                       : lights.meshes()[k - lamps].importance(from);
    };
  }
};

/// Points among the lamps, far from all, and beside them.
constexpr int spread_points = 160;
std::vector<V3f> points(const Lights& lights) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  std::vector<V3f> out;
  for (const float spread : {0.3f, 2.f, 6.f, 200.f})
    for (int k = 0; k < spread_points / 4; ++k)
      out.push_back(V3f(normal(random), normal(random), normal(random)) * spread);
  for (const ShapeLight& lamp : lights.shapes())
    for (const float off : {1e-4f, 0.01f, 0.3f}) out.push_back(lamp.center + lamp.normal * off);
  return out;
}

TEST(LightTree, DrawsWithTheProbabilitiesThatItStates) {
  const Crowd crowd(1);
  const LightTree& tree = crowd.lights.tree();
  ASSERT_FALSE(tree.empty());
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const int kinds : {1, 2}) {
    const size_t count = crowd.count(kinds);
    for (const V3f& from : points(crowd.lights)) {
      const auto importance = crowd.importance(from);
      const LightTree::Cut cut = tree.cut(kinds, from, importance);
      std::vector<double> expected(count), seen(count, 0);
      double total = 0;
      for (uint32_t k = 0; k < count; ++k) {
        expected[k] = double(tree.part(cut, from, k, importance));
        total += expected[k];
        EXPECT_EQ(expected[k] > 0, importance(k) > 0) << k;
      }
      // What lies in clusters of which nothing shines here is lost to the draw.
      EXPECT_LE(total, double(cut.total) * (1 + 1e-5));
      constexpr int draws = 2000;
      double lost = 0;
      for (int k = 0; k < draws; ++k) {
        const auto [light, part] = tree.choose(cut, from, unit(random) * cut.total, importance);
        if (!(part > 0)) {
          ++lost;
          continue;
        }
        ASSERT_LT(light, count);
        EXPECT_NEAR(double(part), expected[light], 1e-4 * expected[light]);
        ++seen[light];
      }
      double chi2 = 0, cells = 0, few_expected = 0, few_seen = 0;
      const auto add = [&](double want, double got) {
        if (want < 10) {
          few_expected += want, few_seen += got;
          return;
        }
        chi2 += (got - want) * (got - want) / want;
        ++cells;
      };
      for (size_t k = 0; k < count; ++k) add(expected[k] / double(cut.total) * draws, seen[k]);
      add(std::max(0., 1 - total / double(cut.total)) * draws, lost);
      if (few_expected > 10) add(few_expected, few_seen);
      if (cells > 1) {
        EXPECT_GT(chi_square_tail(chi2, cells - 1), 1e-6) << from;
      }
    }
  }
}

// What a cluster is taken for is near what its lights give together: a draw of one light knows what
// all give to a relative variance that is 0 where each is drawn by what it gives.
TEST(LightTree, DrawsNearlyByWhatEachLightGives) {
  const Crowd crowd(2);
  double worst = 0, sum = 0;
  std::vector<V3f> at = points(crowd.lights);
  at.resize(spread_points);  // beside a lamp its cluster gives more than it is taken for
  for (const V3f& from : at) {
    const auto importance = crowd.importance(from);
    const LightTree::Cut cut = crowd.lights.tree().cut(2, from, importance);
    double total = 0, second = 0;
    for (uint32_t k = 0; k < crowd.count(2); ++k) {
      const double given = double(importance(k));
      if (!(given > 0)) continue;
      const double part = double(crowd.lights.tree().part(cut, from, k, importance));
      total += given;
      second += given * given / part * double(cut.total);
    }
    const double variance = second / (total * total) - 1;
    worst = std::max(worst, variance);
    sum += variance / double(at.size());
  }
  EXPECT_LT(sum, 0.02);
  EXPECT_LT(worst, 0.5);
}

TEST(LightTree, MeetsWhatALookAtEachLampMeets) {
  for (const double spread : {0.3, 2., 500.}) {
    SceneCache cache;
    Lights lights(many_lamps(5, {1000, -3, 20}, spread, 0.2), Lights::SampleEnvironment::never,
                  cache);
    lights.finish();
    ASSERT_FALSE(lights.tree().empty());
    std::mt19937 random(11);
    std::normal_distribution<float> normal;
    int met = 0;
    for (int k = 0; k < 20000; ++k) {
      const V3f origin =
          V3f(1000, -3, 20) + V3f(normal(random), normal(random), normal(random)) * float(spread);
      const ShapeLight& lamp = lights.shapes()[size_t(k) % lights.shapes().size()];
      V3f to = lamp.center + V3f(normal(random), normal(random), normal(random)) * 0.1f - origin;
      if (k % 7 == 0) to[k % 3] = 0;
      const V3f direction = normalized(to);
      const float reach = k % 4 ? std::numeric_limits<float>::infinity() : dot(to, direction);
      float nearest = reach;
      for (const ShapeLight& shape : lights.shapes())
        nearest = std::min(nearest, shape.intersect(origin, direction, nearest));
      const Lights::Hit hit = lights.intersect(origin, direction, reach);
      EXPECT_EQ(hit.distance, nearest);
      EXPECT_EQ(hit.light >= 0, nearest < reach);
      met += hit.light >= 0;
    }
    EXPECT_GT(met, 2000);
  }
}

TEST(LightTree, GivesThePictureOfSurfaceSamples) {
  Shot shot = plain_shot(64, 16);
  add_ground(shot, 0.6f, 3);
  shot.camera.position = V3d(0, 2, 4);
  shot.camera.target = V3d(0, 0.3, 0);
  shot.light = many_lamps(9, {0, 1.5, 0}, 0.5, 0.25);
  Light sun;
  sun.type = LightType::sun;
  sun.direction = {1, -1, -1};
  sun.angle_deg = 40;
  sun.radiance = V3f(1);
  shot.light.push_back(sun);
  shot.light.push_back(sky(0.5f));
  FrameGeometry geometry;
  for (int k = 0; k < 20; ++k) {
    Obstacle obstacle;
    obstacle.name = obstacle.material = "ball" + std::to_string(k);
    Material material = diffuse(obstacle.name, 0);
    material.emission = V3f(1);
    shot.material.push_back(material);
    shot.obstacle.push_back(obstacle);
    TriangleMesh ball = sphere_mesh(2);
    for (V3f& p : ball.position)
      p = p * 0.1f + V3f(0.2f * float(k - 10), 0.2f, 0.3f * float(k % 5));
    geometry.obstacle.push_back({obstacle.name, ball});
  }
  geometry.cloth = {{"cloth", sheet_mesh(16, [](float x, float z) {
                       return 0.6f + 0.1f * std::sin(3 * x) * std::cos(2 * z);
                     })}};
  expect_estimators_agree(shot, geometry);
}

// Photons and walks share what many lamps send as they share that of one.
TEST(LightTree, GivesPhotonsAndWalksThePictureOfPaths) {
  Shot shot = puddle_shot(V3f(0.3f));
  shot.light = many_lamps(4, {0, 2.5, 0}, 0.4, 0.2);
  for (Light& lamp : shot.light) lamp.center.y = std::max(lamp.center.y, 1.2);
  expect_photons_as_paths(shot, {waves(), {}});
}

}  // namespace
}  // namespace drench::render::test
