// Photons in rounds, and their error as a frame tells it.

#include "render/integrator/photon_rounds.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/render/puddle.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

/// A wavy puddle under a lamp and a sky, 32 x 32 pixels, without walks.
struct Puddle {
  Shot shot = puddle_shot(V3f(0.3f));
  FrameGeometry geometry{waves(), {}};
  RenderOptions options;
  RenderStats stats;

  Puddle() {
    shot.render.width = shot.render.height = 32;
    shot.light = {panel({0.8, 2, 0.3}, 0.15, 0.15, 40), sky(0.2f)};
    options.walks = ManifoldWalks::none;
  }
  Film picture() { return render_frame(shot, 1001, geometry, options, &stats); }
};

TEST(PhotonRounds, TakeEvenPartsOfAPass) {
  PhotonRounds rounds(4000, 1000, 128);
  EXPECT_EQ(rounds.photons(), 1000u);
  rounds.begin_pass(1);
  EXPECT_EQ(rounds.first(), 0);
  EXPECT_EQ(rounds.end(), 4);
  for (const int wanted : {128, 100, 64, 8})
    for (int round = 0, before = 0; round < 4; ++round) {
      const int upto = rounds.upto(round, wanted);
      EXPECT_NEAR(upto - before, wanted / 4., 8) << wanted;
      EXPECT_TRUE(upto % 8 == 0 || upto == wanted) << "whole batches";
      before = upto;
    }
  EXPECT_EQ(rounds.upto(3, 100), 100);
  EXPECT_EQ(rounds.radius(0.5), 0.5) << "all have that of all photons";
}

TEST(PhotonRounds, FollowTheSamplesOfAllPasses) {
  PhotonRounds rounds(4000, 1000, 128);
  rounds.begin_pass(0.25);
  EXPECT_EQ(rounds.end(), 1);
  rounds.begin_pass(0.25);  // no more photons than samples brought
  EXPECT_EQ(rounds.first(), 0);
  EXPECT_EQ(rounds.end(), 1);
  rounds.begin_pass(1);
  EXPECT_EQ(rounds.first(), 1);
  EXPECT_EQ(rounds.end(), 4);
  EXPECT_EQ(rounds.upto(0, 96), 48) << "what was there before this pass";
  EXPECT_EQ(rounds.upto(3, 96), 96);
  // One round of the radius of one map, three of that of four maps' photons: half of it squared.
  EXPECT_NEAR(rounds.radius(1), std::sqrt((1 * 2 + 3) / 4.), 1e-12);
  EXPECT_EQ(PhotonRounds(1e9, 1000, 20).photons(), 1000u) << "eight samples a round at least";
}

// Beyond one map: blur falls as N^(-1/4), and the error of pictures goes on falling. Four times the
// photons halve its square, and samples err less besides.
TEST(PhotonRounds, ShrinkBlurAndErrorBeyondOneMap) {
  Puddle puddle;
  puddle.shot.render.samples = 1024;
  puddle.shot.render.photons = 8;
  const Film reference = puddle.picture();
  puddle.shot.render.photons = 1;
  puddle.shot.render.seed = 5;
  puddle.options.most_photons = 32 * 32 * 32;
  double error_before = 1e9, radius_before = 0;
  for (const int samples : {32, 128, 512}) {
    puddle.shot.render.samples = samples;
    const double error = relative_mse(puddle.picture(), reference),
                 radius = puddle.stats.photon_radius;
    RecordProperty("error_" + std::to_string(samples), std::to_string(error));
    EXPECT_LT(error, error_before / 1.8) << samples;
    if (radius_before > 0) {
      EXPECT_NEAR(radius_before / radius, std::sqrt(2.), 0.15) << samples;
    }
    error_before = error, radius_before = radius;
  }
}

// A pixel's mean is that of its rounds: what moves is lit as by one map, and no light is lost.
TEST(PhotonRounds, GiveTheMeanOfOneMap) {
  Puddle puddle;
  puddle.shot.render.motion_blur = true;
  puddle.shot.camera.shutter_open = -0.25, puddle.shot.camera.shutter_close = 0.25;
  for (V3f& v : puddle.geometry.fluid.velocity) v = V3f(0.3f, -1, 0);
  puddle.shot.render.width = puddle.shot.render.height = 16;
  puddle.shot.render.samples = 128;
  puddle.shot.render.photons = 4;
  const Mean one = mean_over_seeds(puddle.shot, puddle.geometry, puddle.options, 16);
  puddle.options.most_photons = 8000;
  const Mean rounds = mean_over_seeds(puddle.shot, puddle.geometry, puddle.options, 16);
  EXPECT_LT(one.error, 0.003 * one.value);
  EXPECT_NEAR(rounds.value, one.value, 4 * std::hypot(one.error, rounds.error) + 0.002 * one.value);
}

/// With samples by a target, whose passes begin rounds one after the other.
struct RoundsByTarget : Puddle {
  RoundsByTarget() {
    shot.render.samples = 256;
    shot.render.photons = 0.5;
    shot.render.error = 0.002;
    options.most_photons = 10000;
  }
};

TEST(PhotonRounds, GiveTheSameBitsForAnyThreads) {
  RoundsByTarget frame;
  std::vector<float> expected;
  for (const size_t threads : {1, 2, 16}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const Film film = frame.picture();
    if (expected.empty()) expected = film.rgba;
    EXPECT_EQ(film.rgba, expected) << threads;
  }
  EXPECT_GT(frame.stats.camera_samples, 48u * 32 * 32) << "more than one round";
}

TEST(PhotonRounds, GiveTheSameBitsWhenShownAsTheyRefine) {
  RoundsByTarget frame;
  const Film whole = frame.picture();
  int shown = 0;
  frame.options.refined = [&](const Film&) { ++shown; };
  EXPECT_EQ(frame.picture().rgba, whole.rgba);
  EXPECT_GE(shown, 6);
}

TEST(PhotonRounds, GiveTheSameBitsAfterStops) {
  struct Stopped {};
  RoundsByTarget frame;
  const Film whole = frame.picture();
  const RenderStats told = frame.stats;
  const TemporaryFolder folder;
  frame.options.checkpoint.file = folder / "frame.samples";
  frame.options.checkpoint.inputs = {1, 2};
  for (const double fraction : {0.05, 0.3, 0.6, 0.9, 0.9999})
    EXPECT_THROW(render_frame(frame.shot, 1001, frame.geometry, frame.options, nullptr,
                              [&](double done) {
                                if (done >= fraction) throw Stopped{};
                              }),
                 Stopped);
  EXPECT_EQ(frame.picture().rgba, whole.rgba);
  EXPECT_EQ(frame.stats.relative_mse, told.relative_mse);
  EXPECT_EQ(frame.stats.photon_error, told.photon_error);
  EXPECT_EQ(frame.stats.photon_radius, told.photon_radius);
}

TEST(PhotonRounds, OfACropAreThoseOfTheFrame) {
  RoundsByTarget frame;
  frame.shot.render.error = 0;
  frame.shot.render.samples = 64;
  const Film whole = frame.picture();
  frame.shot.render.crop_min = V2i(7, 11);
  frame.shot.render.crop_max = V2i(30, 29);
  const Film part = frame.picture();
  for (int y = 0; y < part.height; ++y)
    for (int k = 0; k < 4 * part.width; ++k)
      ASSERT_EQ(part.rgba[size_t(4 * part.width * y + k)],
                whole.rgba[size_t(4 * 32 * (y + 11) + 4 * 7 + k)]);
}

/// mean of variance / (mean^2 + 0.01) over seeds, and what the frames told in the mean.
struct Scatter {
  double error = 0, told = 0;
};
Scatter over_seeds(Puddle puddle, int seeds) {
  std::vector<Film> films;
  Scatter out;
  for (int seed = 1; seed <= seeds; ++seed) {
    puddle.shot.render.seed = uint32_t(seed);
    films.push_back(puddle.picture());
    out.told += puddle.stats.relative_mse / seeds;
  }
  for (size_t k = 0; k < films[0].rgba.size(); ++k) {
    if (k % 4 == 3) continue;
    double mean = 0, square = 0;
    for (const Film& film : films) mean += double(film.rgba[k]) / seeds;
    for (const Film& film : films) square += std::pow(film.rgba[k] - mean, 2) / (seeds - 1);
    out.error += square / (mean * mean + 0.01);
  }
  out.error /= double(films[0].rgba.size()) * 3 / 4;
  return out;
}

// Most of these errors is that of photons, which a pixel's samples have in common.
TEST(PhotonError, IsToldAsSeedsScatter) {
  Puddle puddle;
  for (const bool moving : {false, true})
    for (const double photons : {0.2, 2.})
      for (const int samples : {32, 96}) {
        puddle.shot.render.motion_blur = moving;
        puddle.shot.camera.shutter_open = -0.25, puddle.shot.camera.shutter_close = 0.25;
        for (V3f& v : puddle.geometry.fluid.velocity) v = V3f(0.3f, -1, 0);
        puddle.shot.render.samples = samples;
        puddle.shot.render.photons = photons;
        const Scatter scatter = over_seeds(puddle, 10);
        const double ratio = scatter.told / scatter.error;
        EXPECT_GT(ratio, 1 / 1.3) << moving << " " << photons << " " << samples;
        EXPECT_LT(ratio, 1.3) << moving << " " << photons << " " << samples;
      }
}

// Where rounds bring photons of their own, the samples' scatter tells their error, and it is not
// told twice. All rounds together are spread more evenly than a few, so that it is told too high.
TEST(PhotonError, OfRoundsIsToldOnce) {
  Puddle puddle;
  puddle.shot.render.samples = 128;
  puddle.shot.render.photons = 1;
  for (const int rounds : {2, 4, 8}) {
    puddle.options.most_photons = 128. * 32 * 32 / rounds;
    const Scatter scatter = over_seeds(puddle, 10);
    EXPECT_GT(scatter.told, 0.8 * scatter.error) << rounds;
    EXPECT_LT(scatter.told, 2 * scatter.error) << rounds;
  }
}

// More samples would not help: they go to half of the target and no further.
TEST(PhotonError, AboveTheTargetEndsTheFrame) {
  Puddle puddle;
  puddle.shot.render.samples = 4096;
  puddle.shot.render.photons = 1e-3;
  puddle.shot.render.error = 0.002;
  puddle.picture();
  EXPECT_GT(puddle.stats.photon_error, 0.01);
  EXPECT_GT(puddle.stats.relative_mse, puddle.stats.photon_error);
  EXPECT_LT(puddle.stats.relative_mse - puddle.stats.photon_error, 0.6 * 0.002);
  EXPECT_LT(puddle.stats.camera_samples, uint64_t(1024 * 32 * 32));
}

// Where the target leaves room for it, samples reach what is left.
TEST(PhotonError, IsWithinTheTarget) {
  Puddle puddle;
  puddle.shot.render.samples = 2048;
  puddle.shot.render.photons = 1;
  puddle.shot.render.error = 0.002;
  puddle.picture();
  EXPECT_GT(puddle.stats.photon_error, 0);
  EXPECT_LT(puddle.stats.relative_mse, 1.1 * 0.002);
}

TEST(PhotonError, IsNoneWithoutPhotons) {
  Puddle puddle;
  puddle.shot.render.samples = 16;
  puddle.shot.render.photons = 0;
  puddle.picture();
  EXPECT_EQ(puddle.stats.photon_error, 0);
  EXPECT_GT(puddle.stats.relative_mse, 0);
}

}  // namespace
}  // namespace drench::render::test
