// A frame that was stopped goes on from its samples, to the same bits as one that was not.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "render/options.h"
#include "tests/render/support.h"
#include "tests/temporary_folder.h"

namespace drench::render::test {

using drench::test::TemporaryFolder;
namespace {

struct Stopped {};

/// Water and a sheet with every layer, the denoiser and samples by a target.
struct Frame {
  TemporaryFolder folder;
  Shot shot = plain_shot(64, 64);
  FrameGeometry geometry;
  RenderOptions options;
  RenderStats stats;

  Frame() {
    add_ground(shot, 0.5f);
    shot.material.push_back(dielectric("water", 1.333, V3f(1, 0.2f, 0.1f)));
    shot.camera.position = V3d(0, 2.5, 5);
    shot.camera.target = V3d(0, 0.5, 0);
    shot.light = {panel({-1, 4, 0}, 0.6, 0.5, 3), sky(0.5f)};
    shot.render.error = 1e-3;
    shot.render.denoise = true;
    LayerSettings& layers = shot.layers;
    layers.albedo = layers.normal = layers.depth = layers.position = layers.motion = true;
    layers.variance = layers.samples = layers.light_groups = layers.cryptomatte = true;
    geometry.fluid = sphere_mesh(3);
    options.checkpoint.file = folder / "frame.samples";
    options.checkpoint.inputs = {1, 2};
  }
  const std::filesystem::path& file() const { return options.checkpoint.file; }
  Film whole() {
    RenderOptions without = options;
    without.checkpoint = {};
    return render_frame(shot, 1001, geometry, without);
  }
  /// Renders until that fraction of the samples is there.
  void stop_at(double fraction) {
    EXPECT_THROW(render_frame(shot, 1001, geometry, options, nullptr,
                              [&](double done) {
                                if (done >= fraction) throw Stopped{};
                              }),
                 Stopped);
    EXPECT_TRUE(std::filesystem::is_regular_file(file()));
  }
  /// Samples that the frame needed in this call.
  Film go_on(double& first_fraction) {
    first_fraction = -1;
    return render_frame(shot, 1001, geometry, options, &stats, [&](double fraction) {
      if (first_fraction < 0) first_fraction = fraction;
    });
  }
};

void expect_equal(const Film& a, const Film& b) {
  EXPECT_EQ(a.rgba, b.rgba);
  ASSERT_EQ(a.layer.size(), b.layer.size());
  for (size_t k = 0; k < a.layer.size(); ++k)
    EXPECT_EQ(a.layer[k].value, b.layer[k].value) << a.layer[k].name;
}

TEST(FrameCheckpoint, GoesOnToTheSameBits) {
  Frame frame;
  const Film whole = frame.whole();
  double first = 0;
  for (const double fraction : {0.05, 0.4, 0.7})
    frame.stop_at(fraction);  // each goes on from the last
  expect_equal(frame.go_on(first), whole);
  EXPECT_GE(first, 0.6);
}

/// What plates need besides: how much of a backdrop is seen, and what catchers have of each light.
TEST(FrameCheckpoint, OfAPlateGoesOnToTheSameBits) {
  Frame frame;
  frame.shot.ground.matte = Matte::shadow_catcher;
  frame.shot.layers.opacity = true;
  const Film whole = frame.whole();
  double first = 0;
  frame.stop_at(0.4);
  expect_equal(frame.go_on(first), whole);
  EXPECT_GE(first, 0.4);
}

/// What `refined` gets: how many pictures, and how far each is from the frame.
std::vector<double> refinements(Frame& frame, const Film& whole) {
  std::vector<double> errors;
  frame.options.refined = [&](const Film& film) {
    double sum = 0;
    for (size_t k = 0; k < whole.rgba.size(); ++k)
      sum += std::pow(double(film.rgba[k]) - double(whole.rgba[k]), 2);
    errors.push_back(std::sqrt(sum / double(whole.rgba.size())));
  };
  double first = 0;
  expect_equal(frame.go_on(first), whole);
  return errors;
}

/// Pictures come of 1, 2, 4... samples, each nearer the frame by about the square root of two, and
/// the frame is the same bits with them.
TEST(FrameRefines, TowardsTheSameBits) {
  for (const bool plate : {false, true}) {
    Frame frame;
    frame.shot.render.denoise = false;
    frame.shot.render.samples = 64;
    frame.shot.render.error = 0;
    if (plate) frame.shot.ground.matte = Matte::shadow_catcher;
    const std::vector<double> errors = refinements(frame, frame.whole());
    ASSERT_EQ(errors.size(), 6u);  // 1 to 32 samples
    for (size_t k = 1; k < errors.size(); ++k) EXPECT_LT(errors[k], errors[k - 1]) << k;
    EXPECT_LT(errors[5], 0.3 * errors[0]);
  }
}

TEST(FrameRefines, FromWhereItWasStopped) {
  Frame frame;
  const Film whole = frame.whole();
  frame.stop_at(0.4);
  const size_t rest = refinements(frame, whole).size();
  std::filesystem::remove(frame.file());
  const size_t all = refinements(frame, whole).size();
  EXPECT_GT(rest, 0u);
  EXPECT_LT(rest, all);
}

TEST(FrameCheckpoint, IsWrittenNowAndThen) {
  Frame frame;
  const Film whole = frame.whole();
  frame.options.checkpoint.every_s = 0.02;
  double first = 0;
  expect_equal(frame.go_on(first), whole);
  ASSERT_TRUE(std::filesystem::is_regular_file(frame.file()));
  expect_equal(frame.go_on(first), whole);  // from the last one on
  EXPECT_GT(first, 0.05);
}

TEST(FrameCheckpoint, OfOtherInputsOrDamagedCountsForNothing) {
  Frame frame;
  const Film whole = frame.whole();
  double first = 0;
  frame.stop_at(0.5);
  frame.options.checkpoint.inputs = {1, 3};
  expect_equal(frame.go_on(first), whole);
  EXPECT_LT(first, 0.1);
  frame.stop_at(0.5);
  const auto size = std::filesystem::file_size(frame.file());
  {
    std::fstream file(frame.file(), std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(std::streamoff(size / 2));
    file.put('\x55').put('\x2a').put('\x55');
  }
  expect_equal(frame.go_on(first), whole);
  EXPECT_LT(first, 0.1);
  frame.stop_at(0.5);
  std::filesystem::resize_file(frame.file(), size / 3);
  expect_equal(frame.go_on(first), whole);
  EXPECT_LT(first, 0.1);
}

}  // namespace
}  // namespace drench::render::test
