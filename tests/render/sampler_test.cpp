// Point sets have their stratification; every direction sampler has the density it claims.

#include <gtest/gtest.h>

#include <functional>
#include <numeric>
#include <random>
#include <set>

#include "render/film/filter.h"
#include "render/light/environment.h"
#include "render/light/lights.h"
#include "render/sampler.h"
#include "render/sampling.h"
#include "render/scene/scene_cache.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

TEST(Sampler, FillsEveryElementaryIntervalOnce) {
  // A pixel's 2^m points are a (0, m, 2)-net: one point in every 2^-a x 2^-(m-a) box.
  constexpr int log2 = 8;
  for (const auto order : {PixelOrder::morton, PixelOrder::separate})
    for (uint32_t pixel = 0; pixel < 16; ++pixel)
      for (int a = 0; a <= log2; ++a) {
        std::set<std::pair<int, int>> boxes;
        for (uint32_t s = 0; s < 1u << log2; ++s) {
          const V2f p = Sampler(order, 7, pixel * 37, pixel, log2, s).two(3 + pixel);
          boxes.insert({int(p.x * float(1 << a)), int(p.y * float(1 << (log2 - a)))});
        }
        ASSERT_EQ(boxes.size(), 1u << log2) << "a = " << a << ", pixel " << pixel;
      }
}

TEST(Sampler, StratifiesOneDimension) {
  for (uint32_t pixel = 0; pixel < 16; ++pixel) {
    std::set<int> cells;
    for (uint32_t s = 0; s < 64; ++s)
      cells.insert(int(Sampler(PixelOrder::morton, 1, pixel, 5, 6, s).one(11) * 64));
    EXPECT_EQ(cells.size(), 64u);
  }
}

TEST(Sampler, KeepsDimensionsUncorrelated) {
  // Products of centred numbers of two dimensions average to 0 with deviation 1/12 / sqrt(n).
  constexpr uint32_t side = 64, samples = 4;
  for (uint32_t other = 1; other < 12; ++other) {
    double sum = 0;
    for (uint32_t y = 0; y < side; ++y)
      for (uint32_t x = 0; x < side; ++x)
        for (uint32_t s = 0; s < samples; ++s) {
          const Sampler sampler(PixelOrder::morton, 3, x, y, 2, s);
          sum += (sampler.two(0).x - 0.5) * (sampler.two(other).y - 0.5);
        }
    const double n = side * side * samples;
    EXPECT_LT(std::abs(sum / n), 5 / 12. / std::sqrt(n)) << other;
  }
}

TEST(Sampler, SecondDimensionIsSobols) {
  // Direction numbers of the polynomial x + 1: v_1 = 1/2, v_{k+1} = v_k xor v_k/2.
  for (uint32_t index : {0u, 1u, 2u, 3u, 5u, 100u, 12345u, 0x87654321u}) {
    uint32_t expected = 0, column = 1u << 31;
    for (uint32_t i = index; i; i >>= 1, column ^= column >> 1)
      if (i & 1) expected ^= column;
    EXPECT_EQ(reverse_bits(sobol_second_reversed(index)), expected);
  }
}

TEST(Sampler, GivesPacksOfTheSamePoints) {
  for (const auto order : {PixelOrder::morton, PixelOrder::separate}) {
    const Sampler pixel(order, 3, 700, 50000, 10, 0);
    for (uint32_t s = 0; s < 1000; s += 8) {
      const std::array<V2f, 8> of_eight = pixel.two_of_eight(s, 9);
      for (uint32_t k = 0; k < 8; ++k) {
        const Sampler sampler(order, 3, 700, 50000, 10, s + k);
        EXPECT_EQ(of_eight[k], sampler.two(9));
        const std::array<V2f, 4> four = pixel.at(s + k).four(20);
        for (uint32_t d = 0; d < 4; ++d) EXPECT_EQ(four[d], sampler.two(20 + d));
        EXPECT_EQ(four[1].x, sampler.one(21));
      }
    }
  }
}

TEST(PixelFilter, HasTheWindowsVariance) {
  // Blackman-Harris of width w: sum a_k cos has variance w^2/12 + w^2/(2 pi^2) sum (-1)^k a_k/(k^2
  // a0), here with the signs of a window centred on 0: + 0.48829, + 0.14128, + 0.01168.
  const PixelFilter filter;
  double square = 0;
  constexpr int steps = 200000;
  for (int k = 0; k < steps; ++k)
    square += std::pow(filter.offset({float((k + 0.5) / steps), 0.5f}).x, 2);
  const double w = PixelFilter::width, a0 = 0.35875;
  const double expected =
      w * w / 12 + w * w / (2 * pi64 * pi64) * (-0.48829 + 0.14128 / 4 - 0.01168 / 9) / a0;
  EXPECT_NEAR(square / steps, expected, 0.005 * expected);  // 1024 straight pieces
  EXPECT_NEAR(filter.offset({0.5f, 0.5f}).x, 0, 1e-3);
}

/// Pearson's chi-square of directions against a density, as a normal deviate (Wilson and Hilferty).
/// Bins are equal areas of the sphere; bins that expect less than 10 are pooled.
double chi_square_deviate(const std::function<V3f(std::mt19937&)>& draw,
                          const std::function<double(const V3f&)>& density) {
  constexpr int rows = 48, columns = 96, fine = 24, draws = 400000;
  std::vector<double> expected(rows * columns), seen(rows * columns);
  for (int r = 0; r < rows * fine; ++r)
    for (int c = 0; c < columns * fine; ++c) {
      const double y = 1 - 2 * (r + 0.5) / (rows * fine), s = std::sqrt(1 - y * y);
      const double phi = 2 * pi64 * (c + 0.5) / (columns * fine);
      expected[r / fine * columns + c / fine] +=
          density({float(s * std::cos(phi)), float(y), float(s * std::sin(phi))}) * 4 * pi64 /
          (double(rows) * fine * columns * fine) * draws;
    }
  std::mt19937 random(20);
  for (int k = 0; k < draws; ++k) {
    const V3f d = draw(random);
    double phi = std::atan2(d.z, d.x) / (2 * pi64);
    phi -= std::floor(phi);
    const int row = std::clamp(int((1 - d.y) / 2 * rows), 0, rows - 1);
    const int column = std::min(int(phi * columns), columns - 1);
    seen[row * columns + column] += 1;
  }
  double chi = 0, pooled_expected = 0, pooled_seen = 0;
  int bins = 0;
  for (size_t k = 0; k < expected.size(); ++k)
    if (expected[k] < 10) {
      pooled_expected += expected[k];
      pooled_seen += seen[k];
    } else {
      chi += std::pow(seen[k] - expected[k], 2) / expected[k];
      ++bins;
    }
  if (pooled_expected >= 10) {
    chi += std::pow(pooled_seen - pooled_expected, 2) / pooled_expected;
    ++bins;
  } else {
    EXPECT_LE(pooled_seen, pooled_expected + 30);  // draws where the density is almost nothing
  }
  const double n = bins - 1;
  return (std::cbrt(chi / n) - (1 - 2 / (9 * n))) / std::sqrt(2 / (9 * n));
}

V2f uniform2(std::mt19937& random) {
  std::uniform_real_distribution<float> u(0, one_minus_epsilon);
  const float x = u(random);
  return {x, u(random)};
}

/// 1 % over the nine below (Sidak): p > 0.0011, a deviate of 3.06. The densities have edges, which
/// the 24 x 24 points of a bin place to a fraction of a percent.
constexpr double worst_deviate = 3.06;

TEST(ChiSquare, CosineHemisphere) {
  const V3f axis = V3f(0.3f, 0.8f, -0.5f).normalized();
  const Basis basis(axis);
  EXPECT_LT(
      chi_square_deviate([&](auto& r) { return basis.world(sample_cosine(uniform2(r))); },
                         [&](const V3f& d) { return std::max(0., double(d.dot(axis))) / pi64; }),
      worst_deviate);
}

TEST(ChiSquare, Cone) {
  const V3f axis = V3f(-0.6f, 0.2f, 0.7f).normalized();
  const Basis basis(axis);
  EXPECT_LT(chi_square_deviate(
                [&](auto& r) { return basis.world(sample_cone(uniform2(r), 0.3f)); },
                [&](const V3f& d) { return d.dot(axis) > 0.7f ? 1 / (2 * pi64 * 0.3) : 0; }),
            worst_deviate);
}

double shape_density(const Lights& lights, const V3f& from, const V3f& d) {
  const Lights::Hit hit = lights.intersect(from, d, 1e30f);
  return hit.light < 0 ? 0 : lights.shape_pdf(hit.light, from, d, hit.distance);
}

void expect_shape_density(const std::vector<Light>& list, const V3f& from) {
  SceneCache cache;
  const Lights lights(list, Lights::SampleEnvironment::automatic, cache);
  EXPECT_LT(chi_square_deviate(
                [&](auto& r) {
                  const float u = uniform2(r).x;
                  return lights.sample(from, 0, u, uniform2(r)).direction;
                },
                [&](const V3f& d) { return shape_density(lights, from, d); }),
            worst_deviate);
}

TEST(ChiSquare, RectangleLight) {
  Light light = panel({0.5, 2, 0.2}, 1.2, 0.7, 1);
  light.u += V3d(0, 0.3, 0);
  expect_shape_density({light}, V3f(0.1f, 0.2f, 0.6f));
}

TEST(ChiSquare, ParallelogramLight) {
  Light light = panel({0.5, 1.2, 0.2}, 1.2, 0.7, 1);
  light.u += V3d(0, 0, 0.5);
  expect_shape_density({light}, V3f(0.1f, 0.2f, 0.6f));
}

TEST(ChiSquare, SphereLight) {
  Light light;
  light.type = LightType::sphere;
  light.center = {0.3, -1, 0.5};
  light.radius = 0.8;
  expect_shape_density({light}, V3f(-0.2f, 0.1f, 0.4f));
}

TEST(ChiSquare, DiskLight) {
  Light light;
  light.type = LightType::disk;
  light.center = {0.3, 1.1, 0.5};
  light.direction = {0.4, -1, -0.2};
  light.radius = 0.8;
  expect_shape_density({light}, V3f(-0.2f, 0.1f, 0.4f));
}

TEST(ChiSquare, ChoiceAmongLights) {
  Light sphere;
  sphere.type = LightType::sphere;
  sphere.center = {1.5, -1, 0.5};
  sphere.radius = 0.6;
  sphere.radiance = V3f(3);
  expect_shape_density({panel({0, 2, 0}, 1, 1, 1), sphere}, V3f(-0.2f, 0.1f, 0.4f));
}

TEST(ChiSquare, EnvironmentGradientAndMap) {
  Film film{16, 8, {}};
  for (int k = 0; k < 16 * 8; ++k) {
    const float value = k == 37 || k == 90 ? 30.f : 0.3f + 0.1f * float(k % 5);
    film.rgba.insert(film.rgba.end(), {value, value, value, 1});
  }
  const TemporaryFolder folder;
  const auto path = folder / "map.exr";
  write_exr(path, film, {});
  Light light = sky(1);
  light.map = path;
  light.rotation_deg = 77;
  const Environment map(light, Environment::Sampling::on);
  const Environment even(sky(1), Environment::Sampling::on);
  for (const Environment* environment : {&map, &even})
    EXPECT_LT(
        chi_square_deviate([&](auto& r) { return environment->sample(uniform2(r)).direction; },
                           [&](const V3f& d) { return environment->pdf(d); }),
        worst_deviate);
}

TEST(AliasTable, DrawsInProportion) {
  const std::vector<float> weights{1, 0, 5, 2, 0.5f, 8};
  const AliasTable table(weights);
  const double total = std::accumulate(weights.begin(), weights.end(), 0.);
  std::vector<double> seen(weights.size());
  constexpr int draws = 1 << 16;
  for (int k = 0; k < draws; ++k) {
    float u = (float(k) + 0.5f) / draws;
    seen[table.sample(u)] += 1;
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
  }
  for (size_t k = 0; k < weights.size(); ++k) {
    EXPECT_NEAR(seen[k] / draws, weights[k] / total, 6. / draws);  // evenly spaced draws
    EXPECT_FLOAT_EQ(table.probability(uint32_t(k)), float(weights[k] / total));
  }
}

}  // namespace
}  // namespace drench::render::test
