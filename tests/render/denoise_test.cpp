// The denoiser on made pictures whose truth is known, and on rendered ones against many samples.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <random>

#include "render/denoise/denoise.h"
#include "tests/render/support.h"

namespace drench::render::test {
namespace {

constexpr int picture_size = 64;
constexpr float noise_level = 0.2f;

/// A picture of truth(x, y) in grey with Gaussian noise of its halves, guided by feature(x, y).
template <class Truth, class Feature>
NoisyPicture made(const Truth& truth, const Feature& feature, float noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> scatter(0, 1);
  NoisyPicture picture;
  picture.width = picture.height = picture_size;
  picture.feature.resize(1);
  for (int y = 0; y < picture_size; ++y)
    for (int x = 0; x < picture_size; ++x) {
      for (int c = 0; c < 3; ++c) {
        for (auto& half : picture.half) half[c].push_back(truth(x, y) + noise * scatter(random));
        picture.variance[c].push_back(noise * noise);
      }
      picture.feature[0].push_back(feature(x, y));
    }
  picture.feature_variance.assign(1, NoisyPicture::Plane(picture_size * picture_size, 0.f));
  return picture;
}

/// RMS error of the green over pixels `margin` from the picture's edge.
template <class Truth>
double rms(const std::vector<NoisyPicture::Plane>& out, const Truth& truth) {
  double sum = 0;
  for (int y = 0; y < picture_size; ++y)
    for (int x = 0; x < picture_size; ++x) {
      const double d = out[1][size_t(y * picture_size + x)] - truth(x, y);
      sum += d * d;
    }
  return std::sqrt(sum / (picture_size * picture_size));
}

const auto none = [](int, int) { return 0.f; };

TEST(Denoise, LeavesWhatHasNoNoise) {
  const auto truth = [](int x, int y) { return 0.5f + 0.4f * std::sin(float(x * y) * 0.3f); };
  EXPECT_LT(rms(denoise(made(truth, none, 0, 1)), truth), 1e-5);
}

/// 225 neighbours and two halves hold sqrt(450) times less noise, a fit with a slope twice that.
TEST(Denoise, SmoothsAFlatPictureWithoutBias) {
  const auto truth = [](int, int) { return 1.f; };
  double mean = 0;
  const auto out = denoise(made(truth, none, noise_level, 2));
  for (const float v : out[1]) mean += v / (picture_size * picture_size);
  EXPECT_LT(rms(out, truth), 0.12 * noise_level);
  EXPECT_NEAR(mean, 1, 4 * noise_level / std::sqrt(2.) / picture_size);
}

/// Neither is an edge that a feature shows lost, however little it stands out of the noise, nor a
/// slope, nor an edge that stands out by itself.
TEST(Denoise, KeepsEdgesAndSlopes) {
  const auto faint = [](int x, int y) { return (x / 8 + y / 8) % 2 ? 0.5f : 0.55f; };
  const auto feature = [](int x, int y) { return (x / 8 + y / 8) % 2 ? 0.2f : 0.9f; };
  const auto slope = [](int x, int y) { return 0.3f + 0.03f * float(x) + 0.01f * float(y); };
  const auto bold = [](int x, int y) { return (x / 16 + y / 16) % 2 ? 0.f : 4.f; };
  EXPECT_LT(rms(denoise(made(faint, feature, noise_level, 3)), faint), 0.12 * noise_level);
  EXPECT_LT(rms(denoise(made(slope, none, noise_level, 4)), slope), 0.2 * noise_level);
  EXPECT_LT(rms(denoise(made(bold, none, noise_level, 5)), bold), 0.35 * noise_level);
}

/// One sample in a pixel found the sun: no white square is left, and nothing else is changed. A
/// bright pixel that its samples are sure of stays.
TEST(Denoise, TakesAwayLoneOutliersOnly) {
  const auto truth = [](int, int) { return 1.f; };
  const auto add = [](NoisyPicture& picture, size_t p, float lone) {
    for (int c = 0; c < 3; ++c) {
      picture.half[0][c][p] += lone;
      picture.variance[c][p] = lone * lone / 2;
    }
  };
  NoisyPicture picture = made(truth, none, noise_level, 9);
  for (const size_t p : {size_t(20 * picture_size + 20), size_t(21 * picture_size + 22),
                         size_t(50 * picture_size + 7)})
    add(picture, p, 4000);
  EXPECT_LT(rms(denoise(picture), truth), 0.2 * noise_level);

  // One of many samples, on a small drop before a clear sky: the drop's guide is no reason for it.
  const auto drop = [](int x, int y) { return x == 20 && y == 20 ? 0.9f : 0.f; };
  NoisyPicture sky = made(truth, drop, 0, 9);
  add(sky, 20 * picture_size + 20, 14);
  EXPECT_NEAR(denoise(sky)[1][20 * picture_size + 20], 1, 0.1);

  NoisyPicture sure = made(truth, none, noise_level, 10);
  const size_t star = 30 * picture_size + 30;
  for (int c = 0; c < 3; ++c)
    for (auto& half : sure.half) half[c][star] = 100;
  EXPECT_NEAR(denoise(sure)[1][star], 100, 1);
}

// A glint that few samples found in a part of the pixels around: no blot where their windows meet.
TEST(Denoise, TakesAwayOutliersThatLieTogether) {
  const auto truth = [](int, int) { return 1.f; };
  NoisyPicture picture = made(truth, none, noise_level, 11);
  std::mt19937 random(12);
  for (int y = 20; y < 40; ++y)
    for (int x = 20; x < 40; ++x) {
      if (random() % 10 != 0) continue;
      for (int c = 0; c < 3; ++c) {
        picture.half[random() % 2][c][size_t(y * picture_size + x)] += 400;
        picture.variance[c][size_t(y * picture_size + x)] = 1e5f;
      }
    }
  EXPECT_LT(rms(denoise(picture), truth), 0.5 * noise_level);
}

/// A lamp that a drop shows in eight pixels, which each know it badly: it is no white square, and
/// what light it has stays. Two samples that found one beside each other, as likely by luck, do
/// not.
TEST(Denoise, KeepsGlintsWhereTheyAre) {
  const auto truth = [](int, int) { return 1.f; };
  const auto brighten = [](NoisyPicture& picture, int x, int y) {
    const size_t p = size_t(y * picture_size + x);
    for (int c = 0; c < 3; ++c) {
      for (auto& half : picture.half) half[c][p] += 300;
      picture.variance[c][p] = 170 * 170;
    }
  };
  NoisyPicture glint = made(truth, none, noise_level, 12);
  NoisyPicture luck = glint;
  for (int x = 30; x < 34; ++x)
    for (int y = 40; y < 42; ++y) brighten(glint, x, y);
  const auto lit = [](int x, int y) {
    return x >= 30 && x < 34 && y >= 40 && y < 42 ? 301.f : 1.f;
  };
  EXPECT_LT(rms(denoise(glint), lit), 0.2 * noise_level);
  brighten(luck, 30, 40);
  EXPECT_LT(rms(denoise(luck), truth), 0.2 * noise_level);
}

/// A moving drop's glint, of which single samples lie loosely together, has no dark rim and no
/// square around it, and keeps some of its light.
TEST(Denoise, KeepsLooseGlintsWhereTheyAre) {
  NoisyPicture picture = made([](int, int) { return 1.f; }, none, noise_level, 14);
  std::mt19937 random(15);
  const auto within = [](int x, int y, int reach) {
    return std::abs(x - 30) <= 5 + reach && std::abs(y - 40) <= 4 + reach;
  };
  for (int y = 0; y < picture_size; ++y)
    for (int x = 0; x < picture_size; ++x) {
      if (!within(x, y, 0) || random() % 5 > 1) continue;
      const size_t half = random() % 2;
      for (size_t c = 0; c < 3; ++c) {
        picture.half[half][c][size_t(y * picture_size + x)] += 150;
        picture.variance[c][size_t(y * picture_size + x)] = 75 * 75;
      }
    }
  const auto out = denoise(picture);
  double light = 0;
  for (int y = 0; y < picture_size; ++y)
    for (int x = 0; x < picture_size; ++x) {
      const float value = out[1][size_t(y * picture_size + x)];
      EXPECT_GT(value, 0.8f) << x << ' ' << y;
      EXPECT_TRUE(value < 1.2f || within(x, y, 1)) << x << ' ' << y;
      light += value - 1;
    }
  EXPECT_GT(light, 100);
}

/// The sun in a moving drop is a line of pixels that have a sample of it each, or two. What single
/// samples found beside it may stay; as bright ones elsewhere go.
template <class Width>
void expect_whole_streak(const Width& width, double fraction) {
  NoisyPicture picture = made([](int, int) { return 1.f; }, none, noise_level, 16);
  std::mt19937 random(17);
  const auto within = [&](int x, int y, int reach) {
    const int across = x - 20 - y / 6;
    return y >= 10 - reach && y < 50 + reach && across >= -reach && across < width(y) + reach;
  };
  double found = 0;
  for (int y = 0; y < picture_size; ++y)
    for (int x = 0; x < picture_size; ++x) {
      if (random() % 100 >= (within(x, y, 0) ? 80 : 1)) continue;
      for (size_t c = 0; c < 3; ++c) {
        picture.half[random() % 2][c][size_t(y * picture_size + x)] += 150;
        picture.variance[c][size_t(y * picture_size + x)] = 75 * 75;
      }
      found += within(x, y, 0) ? 75 : 0;
    }
  const auto out = denoise(picture);
  double streak = 0, elsewhere = 0;
  for (int y = 0; y < picture_size; ++y)
    for (int x = 0; x < picture_size; ++x)
      if (within(x, y, 1) || !within(x, y, 4))
        (within(x, y, 1) ? streak : elsewhere) += out[1][size_t(y * picture_size + x)] - 1;
  EXPECT_GT(streak, fraction * found);
  EXPECT_LT(elsewhere, 0.05 * found);
}

TEST(Denoise, KeepsStreaksWhole) {
  expect_whole_streak([](int) { return 2; }, 0.9);
}
TEST(Denoise, KeepsThinEndsOfStreaks) {
  expect_whole_streak([](int y) { return y >= 25 && y < 35 ? 2 : 1; }, 0.8);
}

/// Of a lamp in 40 pixels each sample of 64 finds it with one chance in 40, so that a fifth of them
/// have none: no white dots and black holes, nearer to what more samples would show, and no light
/// lost. With four times the samples each pixel knows it, and nothing is spread.
TEST(Denoise, FillsGlintsThatFewSamplesFound) {
  const auto within = [](int x, int y) { return x >= 20 && x < 28 && y >= 30 && y < 35; };
  for (const int samples : {64, 256}) {
    NoisyPicture picture = made([](int, int) { return 1.f; }, none, noise_level, 18);
    std::mt19937 random(19);
    double light = 0, rendered = 0, denoised = 0, kept = 0;
    const float lamp = 40 * 100;  // 100 in the mean
    for (int y = 30; y < 35; ++y)
      for (int x = 20; x < 28; ++x) {
        const size_t p = size_t(y * picture_size + x);
        double mean = 0;
        for (auto& half : picture.half) {
          const int found = std::binomial_distribution<int>(samples / 2, 1. / 40)(random);
          for (auto& colour : half) colour[p] += lamp * float(found) / float(samples / 2);
          mean += double(lamp) * found / samples;
        }
        for (auto& variance : picture.variance)
          variance[p] = float(mean) * lamp / float(samples / 2);
        light += mean;
        rendered += (mean - 100) * (mean - 100);
      }
    const auto out = denoise(picture);
    for (int y = 0; y < picture_size; ++y)
      for (int x = 0; x < picture_size; ++x) {
        const double found = double(out[1][size_t(y * picture_size + x)]) - 1;
        denoised += std::pow(found - (within(x, y) ? 100 : 0), 2);
        kept += found;
      }
    EXPECT_NEAR(kept, light, 0.02 * light);
    EXPECT_LT(denoised, (samples == 64 ? 0.5 : 1.1) * rendered);
  }
}

/// Where a pixel's feature lies beyond those around it a fit led below what is there, and left
/// holes beside glints.
TEST(Denoise, StaysWithinTheColoursItComesFrom) {
  const auto lone = [](int x, int y) { return x % 16 == 8 && y % 16 == 8; };
  const auto steps = [](int x, int y) { return float((7 * x + 3 * y) % 16) / 16; };
  const auto truth = [&](int x, int y) { return lone(x, y) ? 0.2f : 0.2f + 5 * steps(x, y); };
  const auto feature = [&](int x, int y) { return lone(x, y) ? 0.f : 1 + steps(x, y); };
  NoisyPicture picture = made(truth, feature, 0.01f, 9);
  for (auto& variance : picture.variance) std::fill(variance.begin(), variance.end(), 100.f);
  const auto out = denoise(picture);
  EXPECT_GT(*std::min_element(out[1].begin(), out[1].end()), 0.15f);
}

/// A guide that is itself noise must not bring it in.
TEST(Denoise, TrustsNoisyFeaturesLess) {
  const auto truth = [](int, int) { return 1.f; };
  std::mt19937 random(6);
  std::normal_distribution<float> scatter(0, 0.3f);
  NoisyPicture picture = made(
      truth, [&](int, int) { return scatter(random); }, noise_level, 7);
  const double trusting = rms(denoise(picture), truth);
  picture.feature_variance[0].assign(picture_size * picture_size, 0.09f);
  const double wary = rms(denoise(picture), truth);
  EXPECT_LT(wary, trusting);
  EXPECT_LT(wary, 0.15 * noise_level);
}

TEST(Denoise, GivesTheSameBitsForAnyThreads) {
  const NoisyPicture picture = made([](int x, int) { return float(x); }, none, noise_level, 8);
  std::vector<NoisyPicture::Plane> expected;
  for (const size_t threads : {1, 2, 16}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const auto out = denoise(picture);
    if (expected.empty()) expected = out;
    EXPECT_EQ(out, expected);
  }
}

/// A ball with an edge of light and shade on a checkered floor.
Shot checkered_shot(int samples) {
  Shot shot = plain_shot(samples, 96);
  add_ground(shot, 0.6f);
  shot.material[0].checker = true;
  shot.material[0].checker_size = 0.25;
  shot.material.push_back(diffuse("water", 0.5f));
  shot.light = {panel({1, 2, 0}, 0.3, 0.3, 12), sky(0.1f)};
  shot.camera.position = V3d(0, 1.5, 3);
  shot.camera.target = V3d(0, 0.3, 0);
  return shot;
}

TEST(DenoisedFrame, ErrsLessAtThreeNumbersOfSamples) {
  FrameGeometry geometry;
  geometry.fluid = sphere_mesh(4);
  for (V3f& p : geometry.fluid.position) p = p * 0.4f + V3f(0, 0.4f, 0);
  Shot exact = checkered_shot(2048);
  exact.render.seed = 9;
  const Film reference = render_frame(exact, 1001, geometry);
  for (const int samples : {16, 32, 64}) {
    Shot shot = checkered_shot(samples);
    const Film noisy = render_frame(shot, 1001, geometry);
    shot.render.denoise = true;
    const Film clean = render_frame(shot, 1001, geometry);
    EXPECT_LT(relative_mse(clean, reference), 0.75 * relative_mse(noisy, reference)) << samples;
    const double mean = channel_mean(noisy, 1).value;
    EXPECT_NEAR(channel_mean(clean, 1).value, mean, 0.005 * mean) << samples;
    ASSERT_EQ(clean.layer.back().name, "noisy");
    for (size_t p = 0; p < noisy.rgba.size() / 4; ++p)
      for (size_t c = 0; c < 3; ++c)
        ASSERT_EQ(clean.layer.back().value[3 * p + c], noisy.rgba[4 * p + c]);
  }
}

TEST(DenoisedFrame, OfTooFewSamplesIsRefused) {
  Shot shot = checkered_shot(8);
  shot.render.denoise = true;
  EXPECT_THROW(render_frame(shot, 1001, {}), Error);
}

}  // namespace
}  // namespace drench::render::test
