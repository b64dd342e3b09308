// Photons in rounds: more than one map holds.

#include "render/photon_rounds.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/render/puddle.h"
#include "tests/temporary_folder.h"

namespace drench::test {
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
    options.walks = Walks::none;
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

TEST(PhotonRounds, GiveTheSameBitsAfterStops) {
  struct Stopped {};
  RoundsByTarget frame;
  const Film whole = frame.picture();
  const RenderStats told = frame.stats;
  const TemporaryFolder folder;
  frame.options.checkpoint.file = folder / "frame.samples";
  frame.options.checkpoint.inputs = {1, 2};
  for (const double share : {0.05, 0.3, 0.6, 0.9, 0.9999})
    EXPECT_THROW(render_frame(frame.shot, 1001, frame.geometry, frame.options, nullptr,
                              [&](double done) {
                                if (done >= share) throw Stopped{};
                              }),
                 Stopped);
  EXPECT_EQ(frame.picture().rgba, whole.rgba);
  EXPECT_EQ(frame.stats.relative_mse, told.relative_mse);
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

}  // namespace
}  // namespace drench::test
