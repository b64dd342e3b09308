// Samples by an error target, and parts of a frame.

#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "render/integrator/sample_plan.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

/// Left a sky that has no noise; right a floor under a lamp that most paths miss.
Shot uneven_shot(int samples, int size = 32) {
  Shot shot = plain_shot(samples, size);
  add_ground(shot, 0.6f);
  shot.light = {panel({0, 2, 0}, 0.5, 0.5, 6), sky(0.05f)};
  shot.camera.position = V3d(0, 1, 3);
  shot.camera.target = V3d(0, 0.8, 0);
  shot.material.push_back(diffuse("water", 0.5f));
  return shot;
}

/// A ball between floor and lamp.
FrameGeometry ball() {
  FrameGeometry geometry;
  geometry.fluid = sphere_mesh(4);
  for (V3f& p : geometry.fluid.position) p = p * 0.4f + V3f(0, 0.5f, 0);
  return geometry;
}

/// Of 30 times the samples that the finest target takes.
const Film& exact_picture() {
  static const Film film = [] {
    Shot shot = uneven_shot(1 << 13);
    shot.render.seed = 99;
    return render_frame(shot, 1001, ball());
  }();
  return film;
}

TEST(ErrorTarget, IsReachedAndToldAsTheReferenceSays) {
  const Film& reference = exact_picture();
  for (const double target : {0.001, 0.0003, 0.0001}) {
    Shot shot = uneven_shot(4096);
    shot.render.error = target;
    RenderStats stats;
    const double error = relative_mse(render_frame(shot, 1001, ball(), &stats), reference);
    EXPECT_LE(stats.relative_mse, 1.05 * target);
    EXPECT_LE(error, 1.25 * target);
    // Told from nets of an eighth of the samples or more, so above the truth, but no lone guess.
    EXPECT_GT(error, 0.2 * stats.relative_mse);
    EXPECT_LT(stats.camera_samples, uint64_t(32 * 32 * 4096));
  }
}

/// As many samples, spread evenly, err more.
TEST(ErrorTarget, BringsSamplesWhereTheyHelp) {
  const Film& reference = exact_picture();
  double aimed = 0, even = 0;
  for (uint32_t seed = 1; seed <= 4; ++seed) {
    Shot shot = uneven_shot(4096);
    shot.render.seed = seed;
    shot.render.error = 0.0003;
    shot.layers.samples = true;
    RenderStats stats;
    const Film film = render_frame(shot, 1001, ball(), &stats);
    aimed += relative_mse(film, reference);
    const double mean_samples = double(stats.camera_samples) / (32 * 32);
    float least = 1e9f, most = 0, total = 0;
    for (const float n : film.layer.at(0).value)
      least = std::min(least, n), most = std::max(most, n), total += n;
    EXPECT_EQ(total, float(stats.camera_samples));
    EXPECT_LT(least, mean_samples);
    EXPECT_GT(most, 1.5 * mean_samples);
    shot.render.error = 0;
    shot.render.samples = int(std::ceil(mean_samples));
    even += relative_mse(render_frame(shot, 1001, ball()), reference);
  }
  EXPECT_LT(aimed, even);
}

/// Pixels stop by their own samples' word; their mean must not follow from that.
TEST(ErrorTarget, LeavesTheMeanWhereItIs) {
  Shot shot = uneven_shot(1024, 16);
  shot.render.error = 0.002;
  const Mean aimed = mean_over_seeds(shot, ball(), {}, 48);
  shot.render.error = 0;
  const Mean even = mean_over_seeds(shot, ball(), {}, 16);
  EXPECT_NEAR(aimed.value, even.value, 4 * std::hypot(aimed.error, even.error));
}

TEST(ErrorTarget, GivesTheSameBitsForAnyThreads) {
  Shot shot = uneven_shot(512);
  shot.render.error = 0.001;
  std::vector<float> expected;
  for (const size_t threads : {1, 2, 16}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const Film film = render_frame(shot, 1001, ball());
    if (expected.empty()) expected = film.rgba;
    EXPECT_EQ(film.rgba, expected) << threads;
  }
}

TEST(SamplePlan, GoesByTheScatterOfSamples) {
  // Columns 0 to 15 have none, 16 to 31 scatter by 1, 32 to 47 by 2, of a mean of 1.
  constexpr int film_width = 48, film_height = 8;
  std::vector<PixelSum> pixels(film_width * film_height);
  SamplePlan plan(film_width, film_height, 1 << 20, 1e-4);
  int passes = 0;
  for (uint32_t state = 1; plan.next(pixels); ++passes) {
    ASSERT_LT(passes, 64);
    for (size_t p = 0; p < pixels.size(); ++p)
      while (pixels[p].samples() < plan.wanted(p)) {
        state = hash_bits(state + 1);
        const float scatter = float(p % film_width / 16);
        pixels[p].add(V3f(1 + (state & 1 ? scatter : -scatter)), 1);
      }
  }
  double error = 0;
  for (const PixelSum& pixel : pixels) error += relative_error(pixel) / double(pixels.size());
  EXPECT_NEAR(error, 1e-4, 1.5e-5);
  EXPECT_EQ(pixels[5].samples(), 32);
  // The least for the target: n = scatter x mean scatter / (1.01 target).
  for (const size_t scatter : {1, 2}) {
    double samples = 0;
    for (size_t y = 0; y < film_height; ++y)
      for (size_t x = 20; x < 28; ++x)
        samples += pixels[y * film_width + x + 16 * (scatter - 1)].samples() / (8. * film_height);
    EXPECT_NEAR(samples, double(scatter) / 1.01e-4, 0.1 * double(scatter) / 1.01e-4);
  }
}

TEST(Crop, IsAPartOfTheFrameToTheBit) {
  Shot shot = uneven_shot(4);
  shot.layers.depth = true;
  const Film whole = render_frame(shot, 1001, ball());
  shot.render.crop_min = V2i(7, 11);
  shot.render.crop_max = V2i(30, 29);
  const Film part = render_frame(shot, 1001, ball());
  ASSERT_EQ(part.width, 23);
  ASSERT_EQ(part.height, 18);
  for (int y = 0; y < 18; ++y)
    for (int x = 0; x < 23; ++x) {
      const size_t from = size_t(y + 11) * 32 + size_t(x + 7), to = size_t(y) * 23 + size_t(x);
      for (size_t c = 0; c < 4; ++c) ASSERT_EQ(part.rgba[4 * to + c], whole.rgba[4 * from + c]);
      ASSERT_EQ(part.layer[0].value[to], whole.layer[0].value[from]);
    }
  const TemporaryFolder folder;
  write_exr(folder / "a.exr", part, {});
  const Imf::InputFile file((folder / "a.exr").c_str());
  EXPECT_EQ(file.header().displayWindow(), Imath::Box2i({0, 0}, {31, 31}));
  EXPECT_EQ(file.header().dataWindow(), Imath::Box2i({7, 11}, {29, 28}));
  const Film back = read_exr(folder / "a.exr");
  EXPECT_EQ(back.width, 23);
  EXPECT_NEAR(back.rgba[4 * 100], part.rgba[4 * 100], part.rgba[4 * 100] / 1024);
}

TEST(Crop, BeyondTheFrameIsRefused) {
  Shot shot = uneven_shot(4);
  shot.render.crop_max = V2i(33, 10);
  EXPECT_THROW(render_frame(shot, 1001, {}), Error);
  shot.render.crop_min = V2i(5, 10);
  shot.render.crop_max = V2i(5, 12);
  EXPECT_THROW(render_frame(shot, 1001, {}), Error);
}

}  // namespace
}  // namespace drench::render::test
