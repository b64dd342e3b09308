// The denoiser across frames, on made pictures that move and whose truth is known, and on rendered
// frames against many samples.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <functional>
#include <random>

#include "render/denoise/denoise.h"
#include "render/denoise/motion_match.h"
#include "render/denoise/noisy_frame.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

constexpr int picture_size = 64;
constexpr float noise_level = 0.2f;

/// What a pixel shows in a frame.
struct Seen {
  float colour = 0, guide = 0;
  V2f motion{0, 0};  // pixels a frame, right and down
};
using Scene = std::function<Seen(int frame, int x, int y)>;

/// A frame of a scene in grey with Gaussian noise of its halves.
NoisyPicture frame_of(const Scene& scene, int frame, unsigned seed = 1) {
  std::mt19937 random(seed * 1000 + unsigned(frame));
  std::normal_distribution<float> scatter(0, 1);
  NoisyPicture picture;
  picture.width = picture.height = picture_size;
  picture.feature.resize(1);
  for (int y = 0; y < picture_size; ++y)
    for (int x = 0; x < picture_size; ++x) {
      const Seen seen = scene(frame, x, y);
      for (int c = 0; c < 3; ++c) {
        for (auto& half : picture.half)
          half[c].push_back(seen.colour + noise_level * scatter(random));
        picture.variance[c].push_back(noise_level * noise_level);
      }
      picture.feature[0].push_back(seen.guide);
      for (int axis = 0; axis < 2; ++axis) {
        picture.motion[0][axis].push_back(-seen.motion[axis]);
        picture.motion[1][axis].push_back(seen.motion[axis]);
      }
    }
  picture.feature_variance.assign(1, NoisyPicture::Plane(picture_size * picture_size, 0.f));
  return picture;
}

Neighbours around(const Scene& scene, int frame, int radius, unsigned seed = 1) {
  Neighbours out;
  for (int k = 1; k <= radius; ++k) {
    out.before.push_back(frame_of(scene, frame - k, seed));
    out.after.push_back(frame_of(scene, frame + k, seed));
  }
  return out;
}

NoisyPicture::Plane denoised(const Scene& scene, int frame, int radius, unsigned seed = 1) {
  return denoise(frame_of(scene, frame, seed), around(scene, frame, radius, seed))[1];
}

/// Of a few frames: RMS error, and RMS change from frame to frame of the error of what is seen,
/// followed along its motion.
struct Quality {
  double error = 0, flicker = 0;
};

Quality quality(const Scene& scene, int radius) {
  constexpr int frames = 5;
  std::vector<NoisyPicture::Plane> off;
  for (int f = 0; f < frames; ++f) {
    off.push_back(denoised(scene, f, radius));
    for (int p = 0; p < picture_size * picture_size; ++p)
      off.back()[size_t(p)] -= scene(f, p % picture_size, p / picture_size).colour;
  }
  Quality out;
  int pixels = 0, pairs = 0;
  for (int f = 0; f < frames; ++f)
    for (int y = 8; y < picture_size - 8; ++y)
      for (int x = 8; x < picture_size - 8; ++x, ++pixels) {
        const float here = off[size_t(f)][size_t(y * picture_size + x)];
        out.error += here * here;
        if (f + 1 == frames) continue;
        const V2f motion = scene(f, x, y).motion;
        const int u = x + int(std::lround(motion.x)), v = y + int(std::lround(motion.y));
        const float change = off[size_t(f) + 1][size_t(v * picture_size + u)] - here;
        out.flicker += change * change;
        ++pairs;
      }
  return {std::sqrt(out.error / pixels), std::sqrt(out.flicker / pairs)};
}

/// Waves that move by 3 pixels to the right and 1 up a frame.
Seen moving_waves(int frame, int x, int y) {
  const float u = float(x - 3 * frame), v = float(y + frame);
  return {0.5f + 0.2f * std::sin(0.35f * u) * std::sin(0.25f * v), 0, V2f(3, -1)};
}

TEST(DenoiseFrames, ErrsAndFlickersLessOnAMovingPattern) {
  const Quality alone = quality(moving_waves, 0), one = quality(moving_waves, 1),
                two = quality(moving_waves, 2);
  EXPECT_LT(one.error, 0.85 * alone.error);
  EXPECT_LT(one.flicker, 0.65 * alone.flicker);
  EXPECT_LT(two.error, one.error);
  EXPECT_LT(two.flicker, one.flicker);
}

/// A pattern on water that moves under a surface which says it stands still: the neighbours do no
/// harm.
TEST(DenoiseFrames, IsNotMisledByMotionThatIsNotTheSurfaces) {
  const Scene refracted = [](int frame, int x, int y) {
    Seen seen = moving_waves(frame, x, y);
    seen.colour = seen.colour > 0.5f ? 1.5f : 0.2f;
    seen.motion = V2f(0);
    return seen;
  };
  EXPECT_LT(quality(refracted, 1).error, 1.05 * quality(refracted, 0).error);
}

/// Samples of water either mirror or refract: what a pixel shows and its guide are off together.
/// The guides' noise is not taken for detail, and an edge of theirs is not lost for it.
TEST(DenoiseFrames, IsNotMisledByGuidesWhoseNoiseIsThatOfThePicture) {
  const auto truth = [](int x) { return x < picture_size / 2 ? 0.5f : 0.55f; };
  const auto frame = [&](int number) {
    std::mt19937 random{unsigned(number)};
    std::normal_distribution<float> scatter(0, noise_level);
    NoisyPicture picture = frame_of([&](int, int x, int) { return Seen{truth(x), 0}; }, number);
    for (size_t p = 0; p < picture_size * picture_size; ++p) {
      const bool left = p % picture_size < picture_size / 2;
      float mean = 0;
      for (auto& half : picture.half) {
        const float off = scatter(random);
        for (auto& colour : half) colour[p] = truth(left ? 0 : picture_size) + off;
        mean += off / 2;
      }
      picture.feature[0][p] = (left ? 0.f : 1.f) + mean;
      picture.feature_variance[0][p] = noise_level * noise_level / 2;
    }
    return picture;
  };
  const auto rms = [&](const NoisyPicture::Plane& out) {
    double sum = 0;
    for (int p = 0; p < picture_size * picture_size; ++p)
      sum += std::pow(out[size_t(p)] - truth(p % picture_size), 2) / (picture_size * picture_size);
    return std::sqrt(sum);
  };
  const double alone = rms(denoise(frame(1))[1]),
               with = rms(denoise(frame(1), {{frame(0)}, {frame(2)}})[1]);
  EXPECT_LT(alone, 0.18 * noise_level);
  EXPECT_LT(with, 0.15 * noise_level);
  EXPECT_LT(with, 0.9 * alone);
}

/// A square that stands before a wall and is faint against the noise moves 6 pixels a frame.
Seen square_before_wall(int frame, int x, int y) {
  const int left = 20 + 6 * frame;
  const bool square = x >= left && x < left + 16 && y >= 24 && y < 40;
  return {square ? 0.7f : 0.5f, square ? 1.f : 0.f, square ? V2f(6, 0) : V2f(0)};
}

TEST(DenoiseFrames, LeavesNoGhostOfWhatMovesAway) {
  for (const bool guided : {true, false}) {
    // Where motion alone tells, the square cannot be seen by its guide.
    const Scene scene = [&](int frame, int x, int y) {
      Seen seen = square_before_wall(frame, x, y);
      if (!guided) seen.guide = 0;
      return seen;
    };
    // Means over the strips that the square leaves and enters, of many pictures.
    double behind = 0, ahead = 0;
    constexpr int pictures = 12;
    for (unsigned seed = 1; seed <= pictures; ++seed) {
      const NoisyPicture::Plane with = denoised(scene, 1, 1, seed),
                                alone = denoised(scene, 1, 0, seed);
      for (int y = 26; y < 38; ++y)
        for (int k = 0; k < 5; ++k) {
          const size_t left = size_t(y * picture_size + 20 + k),
                       right = size_t(y * picture_size + 43 + k);
          behind += (with[left] - alone[left]) / (60. * pictures);
          ahead += (with[right] - alone[right]) / (60. * pictures);
        }
    }
    // A ghost of half its weight would be 0.1.
    EXPECT_NEAR(behind, 0, 0.01) << guided;
    EXPECT_NEAR(ahead, 0, 0.01) << guided;
  }
}

TEST(MotionMatch, FollowsMotionAndKnowsWhatIsCovered) {
  const PixelMatch match =
      match_pixels(frame_of(square_before_wall, 1), frame_of(square_before_wall, 0), Side::before);
  const auto at = [](int x, int y) { return size_t(y * picture_size + x); };
  EXPECT_EQ(match.pixel[at(30, 30)], int32_t(at(24, 30)));  // the square
  EXPECT_EQ(match.same[at(30, 30)], 1);
  EXPECT_EQ(match.pixel[at(10, 10)], int32_t(at(10, 10)));  // the wall
  EXPECT_EQ(match.same[at(10, 10)], 1);
  EXPECT_EQ(match.same[at(22, 30)], 0);  // the wall, just uncovered
  const PixelMatch beyond = match_pixels(frame_of(
                                             [](int, int, int) {
                                               return Seen{0, 0, V2f(40, NAN)};
                                             },
                                             0),
                                         frame_of(moving_waves, 1), Side::after);
  for (const float same : beyond.same) ASSERT_EQ(same, 0);
}

TEST(MotionMatch, OfFramesFartherAwayGoesByThoseBetween) {
  const auto picture = [](int frame) { return frame_of(moving_waves, frame); };
  const PixelMatch far = chained(match_pixels(picture(5), picture(4), Side::before),
                                 match_pixels(picture(4), picture(3), Side::before));
  const size_t p = 30 * picture_size + 30;
  EXPECT_EQ(far.pixel[p], int32_t((30 + 2) * picture_size + 30 - 6));
  EXPECT_EQ(far.same[p], 1);
  EXPECT_EQ(far.same[30 * picture_size + 4], 0);  // came in from the left in between
}

TEST(DenoiseFrames, GivesTheSameBitsForAnyThreads) {
  NoisyPicture::Plane expected;
  for (const size_t threads : {1, 2, 16}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const NoisyPicture::Plane out = denoised(moving_waves, 3, 2);
    if (expected.empty()) expected = out;
    EXPECT_EQ(out, expected);
  }
}

/// A ball that rolls over a checkered floor while the camera goes sideways.
struct RollingBall {
  Shot shot = plain_shot(16, 96);
  TemporaryFolder folder;

  RollingBall() {
    add_ground(shot, 0.6f);
    shot.material[0].checker = true;
    shot.material[0].checker_size = 0.25;
    shot.material.push_back(diffuse("water", 0.5f));
    shot.light = {panel({1, 2, 0}, 0.3, 0.3, 12), sky(0.1f)};
    shot.render.motion_blur = true;
    shot.camera.position.keys = {{1001, V3d(-0.2, 1.5, 3)}, {1005, V3d(0.2, 1.5, 3)}};
    shot.camera.target.keys = {{1001, V3d(-0.1, 0.3, 0)}, {1005, V3d(0.1, 0.3, 0)}};
    shot.render.denoise = true;
  }
  static FrameGeometry geometry(int frame) {
    FrameGeometry out;
    out.fluid = sphere_mesh(4);
    const float per_frame = 0.06f;
    for (V3f& p : out.fluid.position) p = p * 0.4f + V3f(float(frame - 1003) * per_frame, 0.4f, 0);
    out.fluid.velocity.assign(out.fluid.position.size(), V3f(24 * per_frame, 0, 0));
    return out;
  }
  Film reference(int frame) const {
    Shot exact = shot;
    exact.render.denoise = false;
    exact.render.samples = 1024;
    return render_frame(exact, frame, geometry(frame));
  }
  std::filesystem::path noisy(int frame) const {
    const std::filesystem::path file = folder / (std::to_string(frame) + ".exr");
    RenderOptions options;
    options.denoised = Denoised::later;
    write_exr(file, render_frame(shot, frame, geometry(frame), options), {});
    return file;
  }
};

/// Through the file, with no neighbours: the frame that is denoised at once.
TEST(NoisyFrame, AloneGivesTheBitsOfAFrameDenoisedAtOnce) {
  RollingBall ball;
  ball.shot.layers.depth = ball.shot.layers.cryptomatte = true;
  ball.shot.render.crop_min = {8, 16};
  ball.shot.render.crop_max = {80, 90};
  const std::filesystem::path at_once = ball.folder / "once.exr", late = ball.folder / "late.exr";
  const WrittenFile once =
      write_exr(at_once, render_frame(ball.shot, 1003, ball.geometry(1003)), {});
  EXPECT_EQ(write_exr(late, denoised_film(ball.noisy(1003), {}, {}), {}).digest, once.digest);
}

TEST(NoisyFrame, OfOtherFilesIsRefused) {
  RollingBall ball;
  const std::filesystem::path frame = ball.noisy(1003), plain = ball.folder / "plain.exr";
  ball.shot.render.width = 80;
  const std::filesystem::path narrow = ball.noisy(1004);
  write_exr(plain, render_frame(ball.shot, 1002, ball.geometry(1002)), {});
  EXPECT_THROW(denoised_film(plain, {}, {}), Error);
  EXPECT_THROW(denoised_film(frame, {plain}, {}), Error);
  EXPECT_THROW(denoised_film(frame, {}, {narrow}), Error);
  EXPECT_THROW(denoised_film(ball.folder / "none.exr", {}, {}), Error);
}

/// The motion that frames tell leads from each to its neighbours, of the ball, the floor and the
/// sky.
TEST(NoisyFrame, TellsWhereWhatIsSeenIsInTheFramesBeside) {
  const RollingBall ball;
  const NoisyPicture now = picture_of(read_layers(ball.noisy(1003))),
                     next = picture_of(read_layers(ball.noisy(1004)));
  const PixelMatch match = match_pixels(now, next, Side::after);
  double same = 0, off = 0, still = 0;
  for (size_t p = 0; p < match.same.size(); ++p) {
    same += match.same[p] / double(match.same.size());
    off += match.same[p] * std::abs(now.feature[0][p] - next.feature[0][size_t(match.pixel[p])]);
    still += match.same[p] * std::abs(now.feature[0][p] - next.feature[0][p]);
  }
  EXPECT_GT(same, 0.85);
  EXPECT_LT(off, 0.5 * still);  // of the albedo of checks
}

/// In pixels, of the ball and not of the floor, from a camera that stands.
TEST(NoisyFrame, TellsTheMotionOfThings) {
  RollingBall ball;
  ball.shot.camera.position = V3d(0, 0.4, 3);
  ball.shot.camera.target = V3d(0, 0.4, 0);
  const NoisyPicture now = picture_of(read_layers(ball.noisy(1003)));
  const double pixels = 0.06 * 96 / (2 * std::tan(20 * pi64 / 180) * (3 - 0.4));  // a frame
  const size_t middle = 48 * 96 + 48, floor = 90 * 96 + 5;
  EXPECT_NEAR(now.motion[0][0][middle], -pixels, 0.02);
  EXPECT_NEAR(now.motion[1][0][middle], pixels, 0.02);
  EXPECT_NEAR(now.motion[1][1][middle], 0, 0.02);
  EXPECT_NEAR(now.motion[1][0][floor], 0, 1e-3);
}

/// A streak that few samples of a pixel see does not take along what lies behind.
TEST(NoisyFrame, TellsTheMotionOfWhatMostSamplesSee) {
  RollingBall ball;
  ball.shot.camera.position = V3d(0, 0.4, 3);
  ball.shot.camera.target = V3d(0, 0.4, 0);
  FrameGeometry drop = RollingBall::geometry(1003);
  for (V3f& p : drop.fluid.position) p = (p - V3f(0, 0.4f, 0)) * 0.05f + V3f(0, 0.4f, 0);
  drop.fluid.velocity.assign(drop.fluid.position.size(), V3f(24, 0, 0));  // 50 times its radius
  RenderOptions options;
  options.denoised = Denoised::later;
  const NoisyPicture now = picture_of(render_frame(ball.shot, 1003, drop, options));
  int streak = 0;
  for (size_t p = 48 * 96; p < 49 * 96; ++p) {
    streak += now.feature_variance[0][p] > 0 && now.feature[0][p] < 0.9f;
    EXPECT_NEAR(now.motion[1][0][p], 0, 1e-3) << p;
  }
  EXPECT_GT(streak, 5);
}

TEST(NoisyFrame, WithNeighboursErrsLess) {
  const RollingBall ball;
  const std::filesystem::path before = ball.noisy(1002), frame = ball.noisy(1003),
                              after = ball.noisy(1004);
  const Film reference = ball.reference(1003);
  const double alone = relative_mse(denoised_film(frame, {}, {}), reference);
  EXPECT_LT(relative_mse(denoised_film(frame, {before}, {after}), reference), 0.9 * alone);
}

}  // namespace
}  // namespace drench::render::test
