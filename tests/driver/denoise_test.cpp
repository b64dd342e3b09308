// Frames denoised by their neighbours: the same bits in whatever order, ranges and pieces they are
// made, and nothing rendered because a neighbour came.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "pipeline/contract/error.h"
#include "tests/driver/tiny_shot.h"
#include "tests/driver/toy_shot.h"

namespace drench::test {
namespace {

using Digests = std::map<std::string, std::string>;

ToySettings neighbourly(std::vector<int> frames = {}, int radius = 1) {
  ToySettings settings;
  settings.last = 6;
  settings.frames = std::move(frames);
  settings.denoise_frames = radius;
  settings.steps = {Step::simulate, Step::mesh, Step::render};
  return settings;
}

/// Makes frames range by range. @return frames rendered, in the order of the calls
std::vector<int> make_ranges(const TemporaryFolder& folder, std::vector<std::vector<int>> ranges,
                             int radius = 1) {
  std::vector<int> rendered;
  for (std::vector<int>& frames : ranges) {
    const ToySettings settings = neighbourly(std::move(frames), radius);
    ToyStages stages(settings);
    make_toy(settings, stages, folder.path());
    for (const int frame : stages.frames(Step::render)) rendered.push_back(frame);
  }
  std::sort(rendered.begin(), rendered.end());
  return rendered;
}

/// Without the simulation's checkpoints, which are those of the last run.
Digests frames_in(const TemporaryFolder& folder) {
  Digests digests = digests_in(folder.path());
  std::erase_if(digests,
                [](const auto& file) { return file.first.find("ckpt") != file.first.npos; });
  return digests;
}

std::string image(const TemporaryFolder& folder, int frame) {
  return text_of(folder.path() / layout::image("toy", frame));
}

bool uses(const TemporaryFolder& folder, int frame, int neighbour) {
  return image(folder, frame).find(layout::noisy("toy", neighbour)) != std::string::npos;
}

TEST(DenoiseStep, UsesTheNeighboursThereAre) {
  const TemporaryFolder folder;
  make_ranges(folder, {{}}, 2);
  for (int frame = 1; frame <= 6; ++frame)
    for (int other = 1; other <= 6; ++other)
      EXPECT_EQ(uses(folder, frame, other), std::abs(frame - other) <= 2) << frame << " " << other;
}

TEST(DenoiseStep, OfRangesEndsWithTheBitsOfAllAtOnce) {
  for (const int radius : {1, 3}) {
    const TemporaryFolder at_once;
    make_ranges(at_once, {{}}, radius);
    for (const auto& ranges :
         std::vector<std::vector<std::vector<int>>>{{{1, 2, 3}, {4, 5, 6}},
                                                    {{4, 5, 6}, {1, 2, 3}},
                                                    {{1, 3, 5}, {2, 4, 6}},
                                                    {{3}, {6}, {1}, {5}, {2}, {4}}}) {
      const TemporaryFolder folder;
      EXPECT_EQ(make_ranges(folder, ranges, radius), (std::vector<int>{1, 2, 3, 4, 5, 6}));
      EXPECT_EQ(frames_in(folder), frames_in(at_once));
      // A range once more finds nothing to do.
      const ToySettings again = neighbourly({2, 3}, radius);
      ToyStages stages(again);
      EXPECT_TRUE(make_toy(again, stages, folder.path()).nothing_to_do());
    }
  }
}

/// A frame of another camera is no neighbour, and those of the old camera stay as they are.
TEST(DenoiseStep, TakesNoNeighbourOfOtherSettings) {
  const TemporaryFolder folder, fresh;
  make_ranges(folder, {{}});
  const std::string second = image(folder, 2);
  ToySettings settings = neighbourly({3});
  settings.camera = "right";
  ToyStages one(settings);
  make_toy(settings, one, folder.path());
  EXPECT_EQ(one.frames(Step::denoise), std::vector<int>{3});
  EXPECT_FALSE(uses(folder, 3, 2) || uses(folder, 3, 4));
  EXPECT_EQ(image(folder, 2), second);

  settings.frames = {};
  ToyStages rest(settings), all(settings);
  make_toy(settings, rest, folder.path());
  make_toy(settings, all, fresh.path());
  EXPECT_EQ(rest.frames(Step::render).size(), 5u);
  EXPECT_EQ(frames_in(folder), frames_in(fresh));
}

/// A simulation of other settings leaves noisy frames behind that fit their old meshes.
TEST(DenoiseStep, TakesNoNeighbourOfAnOldSimulation) {
  const TemporaryFolder folder;
  make_ranges(folder, {{}});
  ToySettings settings = neighbourly({5});
  settings.growth = 3.8;
  ToyStages stages(settings);
  make_toy(settings, stages, folder.path());
  EXPECT_FALSE(uses(folder, 5, 4) || uses(folder, 5, 6));
  EXPECT_EQ(stages.frames(Step::denoise), std::vector<int>{5});
}

/// No frame is denoised, and none missed, by a run that renders none.
TEST(DenoiseStep, IsPartOfRenderingAlone) {
  const TemporaryFolder folder;
  for (const Step step : {Step::simulate, Step::mesh}) {
    ToySettings settings = neighbourly();
    settings.steps = {step};
    ToyStages stages(settings);
    EXPECT_FALSE(make_toy(settings, stages, folder.path()).nothing_to_do()) << step_name(step);
    EXPECT_TRUE(stages.frames(Step::denoise).empty()) << step_name(step);
  }
}

TEST(DenoiseStep, OfAnotherRadiusRendersNothing) {
  const TemporaryFolder folder, wide;
  make_ranges(folder, {{}}, 1);
  EXPECT_TRUE(make_ranges(folder, {{}}, 2).empty());
  make_ranges(wide, {{}}, 2);
  EXPECT_EQ(frames_in(folder), frames_in(wide));
}

TEST(DenoiseStep, MakesADamagedNoisyFrameAgain) {
  const TemporaryFolder folder, whole;
  make_ranges(whole, {{}});
  make_ranges(folder, {{}});
  std::ofstream(folder.path() / layout::noisy("toy", 4), std::ios::app) << "x";
  std::filesystem::remove(folder.path() / layout::noisy("toy", 2));
  EXPECT_EQ(make_ranges(folder, {{}}), (std::vector<int>{2, 4}));
  EXPECT_EQ(frames_in(folder), frames_in(whole));
}

/// Whatever frame a run breaks off at, the next ends with the same bits and renders none twice.
TEST(DenoiseStep, GoesOnAfterItWasBrokenOff) {
  const TemporaryFolder whole;
  make_ranges(whole, {{}});
  for (const Step step : {Step::render, Step::denoise})
    for (const int at : {1, 3, 6}) {
      const TemporaryFolder folder;
      const ToySettings settings = neighbourly();
      ToyStages broken(settings);
      broken.hook = [&](Step now, int frame) {
        if (now == step && frame == at) throw Error("no such texture");
      };
      EXPECT_THROW(make_toy(settings, broken, folder.path()), Error);
      make_ranges(folder, {{}});
      EXPECT_EQ(frames_in(folder), frames_in(whole));
    }
}

TEST(DenoiseStep, OfNoFramesIsNone) {
  const TemporaryFolder folder;
  make_ranges(folder, {{}}, 0);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "noisy"));
  make_ranges(folder, {{}}, 1);
  make_ranges(folder, {{}}, 0);
  const ToySettings settings = neighbourly({}, 0);
  const Manifest manifest(folder.path() / layout::manifest);
  const Plan plan = make_plan(toy_targets(settings), take_snapshot(folder.path(), manifest), 6);
  EXPECT_TRUE(plan.nothing_to_do());
  EXPECT_EQ(plan.beyond.size(), 6u);  // noisy frames, for `drench clean`
}

/// The program itself: at once, by ranges on other threads, and frame by frame backwards.
TEST(DenoiseStep, OfARealShotHasTheSameBitsByRanges) {
  const std::vector<std::string> settings{"--set", "render.denoise=true", "--set",
                                          "render.samples=16"};
  const auto images = [](const TinyShot& shot) {
    Digests digests = shot.digests();
    std::erase_if(digests, [](const auto& file) {
      return !file.first.starts_with("render/") && !file.first.starts_with("noisy/");
    });
    return digests;
  };
  const auto run = [&](const TinyShot& shot, std::vector<std::string> more) {
    more.insert(more.end(), settings.begin(), settings.end());
    const Ended ended = shot.run("run", more);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return ended.err;
  };
  const TinyShot at_once(4), ranges(4), single(4);
  run(at_once, {});
  run(ranges, {"--frames", "1001-1002", "--threads", "1"});
  run(ranges, {"--frames", "1003-1004", "--threads", "2"});
  for (const char* frame : {"1004", "1002", "1003", "1001"}) run(single, {"--frames", frame});
  EXPECT_EQ(images(at_once).size(), 8u);
  EXPECT_EQ(images(ranges), images(at_once));
  EXPECT_EQ(images(single), images(at_once));
}

/// With a library that stands for Open Image Denoise (oidn_double.cpp): each frame alone, and
/// nothing is rendered when the denoiser changes, unless rendering denoises.
TEST(DenoiseStep, ByAnotherDenoiserRendersNothing) {
  const TinyShot shot(3);
  const auto run = [&](const std::string& denoiser, const std::string& frames) {
    const Ended ended =
        run_program(DRENCH_PROGRAM,
                    shot.words("run", {"--set", "render.denoise=true", "--set", "render.samples=16",
                                       "--set", "render.denoiser=\"" + denoiser + "\"", "--set",
                                       "render.denoise_frames=" + frames}),
                    shot.folder(), {"LD_LIBRARY_PATH=" OIDN_DOUBLE_FOLDER});
    EXPECT_EQ(ended.code, 0) << ended.err;
    return shot.digests();
  };
  const Digests built_in = run("regression", "1"), oidn = run("oidn", "1"),
                alone = run("oidn", "0");
  for (const char* frame : {"1001", "1002", "1003"}) {
    const std::string noisy = fmt::format("noisy/tiny.{}.exr", frame),
                      image = fmt::format("render/tiny.{}.exr", frame);
    EXPECT_EQ(built_in.at(noisy), oidn.at(noisy));
    EXPECT_NE(built_in.at(image), oidn.at(image));
    EXPECT_NE(alone.at(image), oidn.at(image)) << "its header names no noisy files";
  }
  EXPECT_EQ(run("oidn", "0"), alone);
  EXPECT_EQ(run("regression", "1"), built_in);
}

/// To clean a folder up none is needed.
TEST(DenoiseStep, NamesAMissingDenoiserBeforeAnythingIsMade) {
  const TinyShot shot(3);
  // Files that are no libraries, found before any that is installed.
  for (const char* version : {"", ".1", ".2"})
    std::ofstream(shot.folder() / (std::string("libOpenImageDenoise.so") + version));
  const auto with_it = [&](const char* command) {
    return run_program(
        DRENCH_PROGRAM,
        shot.words(command, {"--set", "render.denoise=true", "--set", "render.samples=16", "--set",
                             "render.denoiser=\"oidn\""}),
        shot.folder(), {"LD_LIBRARY_PATH=" + shot.folder().string()});
  };
  const Ended ended = with_it("run");
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("LD_LIBRARY_PATH"), std::string::npos) << ended.err;
  EXPECT_FALSE(std::filesystem::exists(shot.out() / "sim"));
  EXPECT_EQ(shot.run("simulate").code, 0);
  EXPECT_EQ(with_it("clean").code, 0);
}

}  // namespace
}  // namespace drench::test
