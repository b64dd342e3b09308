#include "pipeline/driver/execute.h"

#include <gtest/gtest.h>
#include <sys/mount.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "pipeline/contract/error.h"
#include "tests/driver/folder.h"
#include "tests/driver/toy_shot.h"

namespace drench {
namespace {

using namespace std::chrono_literals;
using test::digests_in;
using test::error_of;
using test::Event;
using test::flip_bit_quietly;
using test::make_toy;
using test::Mark;
using test::TemporaryFolder;
using test::ToySettings;
using test::ToyStages;

/// Makes everything that is missing in the folder, and keeps what happened.
struct Made : ToyStages {
  Made(const ToySettings& settings, const TemporaryFolder& folder) : ToyStages(settings) {
    make_toy(settings, *this, folder.path());
  }
};

std::map<std::string, std::string> undisturbed(const ToySettings& settings) {
  const TemporaryFolder folder;
  const Made made(settings, folder);
  return digests_in(folder.path());
}

size_t position(const std::vector<Event>& events, Step step, int frame, Mark mark) {
  const auto found = std::find_if(events.begin(), events.end(), [&](const Event& event) {
    return event.step == step && event.frame == frame && event.mark == mark;
  });
  return size_t(found - events.begin());
}

TEST(Execute, MakesEveryFileOnceInTheOrderOfItsInputs) {
  const TemporaryFolder folder;
  const ToySettings settings;
  const Made stages(settings, folder);
  EXPECT_EQ(stages.count(Step::simulate), 24);  // the first frame is the initial state
  EXPECT_EQ(stages.count(Step::mesh), 25);
  EXPECT_EQ(stages.count(Step::render), 25);
  EXPECT_EQ(stages.count(Step::contact_sheet), 1);
  const std::vector<Event> events = stages.events();
  for (int frame = 2; frame <= 25; ++frame) {
    EXPECT_LT(position(events, Step::simulate, frame, Mark::end),
              position(events, Step::mesh, frame, Mark::begin));
    EXPECT_LT(position(events, Step::mesh, frame, Mark::end),
              position(events, Step::render, frame, Mark::begin));
  }
  EXPECT_EQ(events.back().step, Step::contact_sheet);
}

// Simulation of frame 5 waits for the image of frame 1: without overlap this would wait for ever
// (and fail after 20 s).
TEST(Execute, MeshesAndRendersWhileItSimulates) {
  const TemporaryFolder folder;
  const ToySettings settings;
  ToyStages stages(settings);
  std::atomic<bool> overlapped{false};
  stages.hook = [&](Step step, int frame) {
    if (step != Step::simulate || frame != 5) return;
    for (int k = 0; k < 2000 && !overlapped; ++k) {
      const std::vector<Event> events = stages.events();
      overlapped = position(events, Step::render, 1, Mark::end) < events.size();
      std::this_thread::sleep_for(10ms);
    }
  };
  make_toy(settings, stages, folder.path());
  EXPECT_TRUE(overlapped);
}

/// Frames that a step was at work on at once, at most.
int most_at_once(const std::vector<Event>& events, Step step) {
  int now = 0, most = 0;
  for (const Event& event : events)
    if (event.step == step) most = std::max(most, now += event.mark == Mark::begin ? 1 : -1);
  return most;
}

// Images wait until as many are in work as there should be, and a little for one too many.
TEST(Execute, RendersMoreFramesAtOnceOnMoreCores) {
  for (const auto& [threads, expected] : {std::pair(2, 2), {31, 2}, {32, 3}, {64, 4}, {256, 4}}) {
    const TemporaryFolder folder;
    ToySettings settings;
    settings.last = 9;
    ToyStages stages(settings);
    stages.hook = [&, expected = expected](Step step, int) {
      if (step != Step::render) return;
      for (int k = 0; k < 2000 && most_at_once(stages.events(), step) < expected; ++k)
        std::this_thread::sleep_for(10ms);
      std::this_thread::sleep_for(20ms);
    };
    ExecuteOptions options;
    options.threads = threads;
    make_toy(settings, stages, folder.path(), options);
    EXPECT_EQ(most_at_once(stages.events(), Step::render), expected) << threads;
    EXPECT_EQ(digests_in(folder.path()), undisturbed(settings)) << threads;
  }
}

// Two frames in the queue, one in work, one waiting to be queued, one being simulated; the log of a
// begin may lag behind the queue by one.
TEST(Execute, NeverRunsMoreThanTwoQueuedFramesAhead) {
  const TemporaryFolder folder;
  const ToySettings settings;
  ToyStages stages(settings);
  stages.hook = [](Step step, int) {
    if (step == Step::mesh) std::this_thread::sleep_for(5ms);
  };
  make_toy(settings, stages, folder.path());
  int simulated = 1, meshed = 0, most = 0;
  for (const Event& event : stages.events()) {
    if (event.step == Step::simulate && event.mark == Mark::begin) simulated = event.frame;
    if (event.step == Step::mesh && event.mark == Mark::begin) meshed = event.frame;
    most = std::max(most, simulated - meshed);
  }
  EXPECT_LE(most, 5);
}

TEST(Execute, DoesNothingTheSecondTime) {
  const TemporaryFolder folder;
  const ToySettings settings;
  const Made first(settings, folder);
  const std::string manifest = test::text_of(folder.path() / layout::manifest);
  const Made second(settings, folder);
  EXPECT_TRUE(second.events().empty());
  EXPECT_EQ(test::text_of(folder.path() / layout::manifest), manifest);
}

TEST(Execute, RendersOnlyAfterACameraEdit) {
  const TemporaryFolder folder;
  ToySettings settings;
  const Made first(settings, folder);
  settings.camera = "right";
  const Made second(settings, folder);
  EXPECT_EQ(second.count(Step::simulate), 0);
  EXPECT_EQ(second.count(Step::mesh), 0);
  EXPECT_EQ(second.count(Step::render), 25);
  EXPECT_EQ(digests_in(folder.path()), undisturbed(settings));
}

// A new program simulates again, but the files come out the same: meshing and rendering do not run.
TEST(Execute, StopsAChangeAtTheFirstFileThatComesOutTheSame) {
  const TemporaryFolder folder;
  ToySettings settings;
  const Made first(settings, folder);
  settings.program = "2";
  const Made second(settings, folder);
  EXPECT_EQ(second.count(Step::simulate), 24);
  EXPECT_EQ(second.count(Step::mesh), 0);
  EXPECT_EQ(second.count(Step::render), 0);
}

// With growth 2 the state is 0.34 at first and 0.5 from the second frame on: one digit more of the
// mesh changes the first frame's only.
TEST(Execute, RendersOnlyFramesWhoseMeshChanged) {
  const TemporaryFolder folder;
  ToySettings settings;
  settings.obstacles_move = true;  // or the later frames would not be meshed at all
  settings.mesh_digits = 1;
  settings.growth = 2;
  const Made first(settings, folder);
  settings.mesh_digits = 2;
  const Made second(settings, folder);
  EXPECT_EQ(second.count(Step::mesh), 25);
  EXPECT_EQ(second.frames(Step::render), (std::vector<int>{1}));
  EXPECT_EQ(digests_in(folder.path()), undisturbed(settings));
}

// The state stands still from the second frame on, and so do its files.
TEST(Execute, TakesTheMeshOfAHeldFrameFromTheFrameBefore) {
  const TemporaryFolder folder;
  ToySettings settings;
  settings.growth = 2;
  const Made held(settings, folder);
  EXPECT_EQ(held.frames(Step::mesh), (std::vector<int>{1, 2}));
  EXPECT_EQ(held.count(Step::render), 25);
  std::filesystem::remove(folder.path() / layout::fluid_mesh(7));
  const Made mended(settings, folder);
  EXPECT_EQ(mended.count(Step::mesh), 0);
  const std::map<std::string, std::string> files = digests_in(folder.path());
  settings.obstacles_move = true;
  EXPECT_EQ(files, undisturbed(settings));
  std::filesystem::remove(folder.path() / layout::fluid_mesh(7));
  EXPECT_EQ(Made(settings, folder).count(Step::mesh), 1);
}

TEST(Execute, MakesAMissingImageAlone) {
  const TemporaryFolder folder;
  const ToySettings settings;
  const Made first(settings, folder);
  std::filesystem::remove(folder.path() / layout::image("toy", 7));
  const Made second(settings, folder);
  EXPECT_EQ(second.frames(Step::render), (std::vector<int>{7}));
  EXPECT_EQ(second.count(Step::mesh) + second.count(Step::simulate), 0);
  EXPECT_EQ(second.count(Step::contact_sheet), 0);  // the image came out the same
  EXPECT_EQ(digests_in(folder.path()), undisturbed(settings));
}

// Frame 17 is lost: simulated again from the checkpoint of frame 11, no further than 17.
TEST(Execute, MakesALostCacheAgainFromTheCheckpointBefore) {
  const TemporaryFolder folder;
  const ToySettings settings;
  const Made first(settings, folder);
  std::filesystem::remove(folder.path() / layout::particles(17));
  const Made second(settings, folder);
  EXPECT_EQ(second.frames(Step::simulate), (std::vector<int>{12, 13, 14, 15, 16, 17}));
  EXPECT_EQ(second.count(Step::mesh), 0);
  EXPECT_EQ(digests_in(folder.path()), undisturbed(settings));
}

// Damage that neither size nor time shows is found by the stage that reads the file.
TEST(Execute, NeverReadsADamagedInputAndMakesItAgain) {
  const TemporaryFolder folder;
  ToySettings settings;
  const Made first(settings, folder);
  flip_bit_quietly(folder.path() / layout::fluid_mesh(9));
  settings.camera = "right";
  const Made second(settings, folder);
  EXPECT_EQ(second.frames(Step::mesh), (std::vector<int>{9}));
  EXPECT_EQ(digests_in(folder.path()), undisturbed(settings));
}

TEST(Execute, GoesOnWithoutADamagedCheckpoint) {
  const TemporaryFolder folder;
  ToySettings settings;
  const Made first(settings, folder);
  for (const int frame : {11, 21, 25}) flip_bit_quietly(folder.path() / layout::checkpoint(frame));
  settings.last = 30;
  const Made second(settings, folder);
  EXPECT_EQ(second.frames(Step::simulate).front(), 2);
  EXPECT_EQ(digests_in(folder.path()), undisturbed(settings));
}

TEST(Execute, KeepsTheLastThreeCheckpoints) {
  const TemporaryFolder folder;
  ToySettings settings;
  settings.last = 55;
  const Made stages(settings, folder);
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path() / "sim/checkpoint")) {
    files.push_back(entry.path().filename().string());
  }
  std::sort(files.begin(), files.end());
  EXPECT_EQ(files,
            (std::vector<std::string>{"frame.0041.ckpt", "frame.0051.ckpt", "frame.0055.ckpt"}));
}

TEST(Execute, ContinuesALongerRangeWithoutSimulatingAgain) {
  const TemporaryFolder folder;
  ToySettings settings;
  const Made first(settings, folder);
  settings.last = 33;
  const Made second(settings, folder);
  EXPECT_EQ(second.frames(Step::simulate).front(), 26);
  EXPECT_EQ(digests_in(folder.path()).at(layout::image("toy", 33)),
            undisturbed(settings).at(layout::image("toy", 33)));
}

// Stops are asked for at every possible question of one frame's steps in turn: the end result has
// the same bits as an undisturbed run.
TEST(Execute, EndsWithTheSameBitsAfterStopsAnywhere) {
  ToySettings settings;
  settings.last = 13;
  const std::map<std::string, std::string> expected = undisturbed(settings);
  for (int questions = 1; questions < 400; questions += 23) {
    const TemporaryFolder folder;
    int runs = 0;
    for (bool done = false; !done; ++runs) {
      ASSERT_LT(runs, 1500) << "no progress";
      ToyStages stages(settings);
      std::atomic<int> asked{0};
      ExecuteOptions options;
      const int allowed = questions + 200;  // the watcher's and other stages' questions count too
      options.stop_requested = [&] { return ++asked > allowed; };
      try {
        make_toy(settings, stages, folder.path(), options);
        done = true;
      } catch (const Stopped&) {
      }
    }
    EXPECT_GT(runs, 1) << "never stopped";
    EXPECT_EQ(digests_in(folder.path()), expected) << questions;
  }
}

TEST(Execute, WritesACheckpointOnStopAndContinuesFromIt) {
  const TemporaryFolder folder;
  const ToySettings settings;
  ToyStages first(settings), second(settings);
  std::atomic<bool> stop{false};
  ExecuteOptions options;
  options.stop_requested = [&] { return stop.load(); };
  first.hook = [&](Step step, int frame) {
    if (step == Step::simulate && frame == 8) stop = true;
  };
  EXPECT_THROW(make_toy(settings, first, folder.path(), options), Stopped);
  EXPECT_TRUE(std::filesystem::exists(folder.path() / layout::stop_checkpoint));
  make_toy(settings, second, folder.path());
  EXPECT_EQ(second.frames(Step::simulate).front(), 8);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / layout::stop_checkpoint));
  EXPECT_EQ(digests_in(folder.path()), undisturbed(settings));
}

// A blow-up leaves no file of its frame and says where to continue.
TEST(Execute, NamesTheLastGoodCheckpointWhenTheSimulationFails) {
  const TemporaryFolder folder;
  const ToySettings settings;
  ToyStages stages(settings);
  stages.hook = [](Step step, int frame) {
    if (step == Step::simulate && frame == 15) throw Error("particle 7 has no finite position");
  };
  try {
    make_toy(settings, stages, folder.path());
    FAIL() << "the failure was swallowed";
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("particle 7"), std::string::npos) << text;
    EXPECT_NE(text.find("frame.0011.ckpt"), std::string::npos) << text;
  }
  EXPECT_TRUE(std::filesystem::exists(folder.path() / layout::particles(14)));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / layout::particles(15)));
}

TEST(Execute, GoesOnBesideAFrameThatFails) {
  const TemporaryFolder folder;
  const ToySettings settings;
  ToyStages first(settings), second(settings);
  first.hook = [](Step step, int frame) {
    if (step == Step::mesh && frame == 3) throw Error("no such mesh");
  };
  EXPECT_EQ(error_of([&] { make_toy(settings, first, folder.path()); }),
            "no such mesh\n2 of what follows was left out; once that is mended the same command "
            "goes on with it");
  EXPECT_EQ(first.count(Step::simulate), 24);
  EXPECT_EQ(first.count(Step::render), 24);
  EXPECT_EQ(first.count(Step::contact_sheet), 0);
  make_toy(settings, second, folder.path());
  EXPECT_EQ(second.frames(Step::mesh), std::vector<int>{3});
  EXPECT_EQ(second.frames(Step::render), std::vector<int>{3});
  EXPECT_EQ(digests_in(folder.path()), undisturbed(settings));
}

/// What is made of the frame before, or of frames beside it, waits for the frame that failed.
TEST(Execute, LeavesOutAllThatFollowsFromAFrameThatFails) {
  ToySettings settings;
  settings.foam = true;
  settings.denoise_frames = 1;
  settings.steps = all_steps();
  for (const Step failing : {Step::simulate, Step::foam, Step::render}) {
    const TemporaryFolder folder;
    ToyStages first(settings), second(settings);
    first.hook = [&](Step step, int frame) {
      if (step == failing && frame == 20) throw Error("as asked");
    };
    const std::string text = error_of([&] { make_toy(settings, first, folder.path()); });
    EXPECT_EQ(text.find("as asked"), 0u) << text;
    const int rendered = first.count(Step::render) - int(failing == Step::render),
              denoised = first.count(Step::denoise);
    EXPECT_EQ(rendered, failing == Step::render ? 24 : 19) << step_name(failing);
    EXPECT_EQ(denoised, failing == Step::render ? 22 : 18) << step_name(failing);
    make_toy(settings, second, folder.path());
    EXPECT_EQ(digests_in(folder.path()), undisturbed(settings)) << step_name(failing);
    EXPECT_EQ(second.count(Step::render), 25 - rendered) << step_name(failing);
    EXPECT_EQ(second.count(Step::denoise), 25 - denoised) << step_name(failing);
  }
}

/// The rest would fail as well: it stops, and the simulation's work is kept in a checkpoint.
TEST(Execute, GivesUpAfterThreeFramesThatFailInARow) {
  const TemporaryFolder folder;
  const ToySettings settings;
  ToyStages first(settings), second(settings);
  first.hook = [](Step step, int) {
    if (step == Step::mesh) throw Error("the disk is full");
  };
  EXPECT_THROW(make_toy(settings, first, folder.path()), Error);
  EXPECT_LE(first.count(Step::simulate), 8);
  const int reached = first.frames(Step::simulate).back();
  make_toy(settings, second, folder.path());
  EXPECT_GE(second.frames(Step::simulate).front(), reached);
  EXPECT_EQ(digests_in(folder.path()), undisturbed(settings));
}

/// Before the disk is full: then not even a checkpoint could be kept.
TEST(Execute, StopsWithACheckpointOnADiskThatIsNearlyFull) {
  const TemporaryFolder folder;
  const char* small = "size=4400k";  // of which 4 MiB are kept
  if (::mount("none", folder.path().c_str(), "tmpfs", 0, small) != 0)
    GTEST_SKIP() << "needs root to mount a small file system";
  ToySettings settings;
  settings.last = 80;
  ToyStages first(settings), second(settings);
  first.hook = [](Step step, int) {
    if (step == Step::simulate) std::this_thread::sleep_for(50ms);
  };
  const std::string text = error_of([&] { make_toy(settings, first, folder.path()); });
  EXPECT_NE(text.find("the disk is nearly full"), std::string::npos) << text;
  EXPECT_NE(text.find("with a checkpoint"), std::string::npos) << text;
  const int reached = first.frames(Step::simulate).back();
  EXPECT_LT(reached, 80);
  EXPECT_EQ(::mount("none", folder.path().c_str(), "tmpfs", MS_REMOUNT, "size=20m"), 0);
  make_toy(settings, second, folder.path());
  EXPECT_GE(second.frames(Step::simulate).front(), reached);
  EXPECT_EQ(digests_in(folder.path()), undisturbed(settings));
  ::umount(folder.path().c_str());
}

TEST(Execute, TriesAFrameAgainThatFails) {
  const TemporaryFolder folder;
  const ToySettings settings;
  ToyStages stages(settings);
  std::atomic<int> left{2};
  stages.hook = [&](Step step, int frame) {
    if (step == Step::mesh && frame == 3 && left-- > 0) throw Error("the network is away");
  };
  ExecuteOptions options;
  options.retry = 2;
  make_toy(settings, stages, folder.path(), options);
  EXPECT_EQ(digests_in(folder.path()), undisturbed(settings));
}

TEST(Execute, MakesPartOfTheFramesButSimulatesAllBeforeThem) {
  const TemporaryFolder folder;
  ToySettings settings;
  settings.frames = {4, 8};
  const Made stages(settings, folder);
  EXPECT_EQ(stages.frames(Step::simulate), (std::vector<int>{2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(stages.frames(Step::mesh), settings.frames);
  std::vector<int> rendered = stages.frames(Step::render);  // two at once, in either order
  std::sort(rendered.begin(), rendered.end());
  EXPECT_EQ(rendered, settings.frames);
}

TEST(Execute, RunsAStageAloneOnWhatLiesThere) {
  const TemporaryFolder folder;
  ToySettings settings;
  settings.steps = {Step::simulate};
  const Made simulating(settings, folder);
  EXPECT_EQ(simulating.count(Step::mesh) + simulating.count(Step::render), 0);
  settings.steps = {Step::mesh};
  const Made meshing(settings, folder);
  EXPECT_EQ(meshing.count(Step::simulate), 0);
  EXPECT_EQ(meshing.count(Step::mesh), 25);
}

TEST(Execute, GivesTheSameFilesForAnyNumberOfThreads) {
  const ToySettings settings;
  const std::map<std::string, std::string> expected = undisturbed(settings);
  for (const int threads : {1, 2, 5}) {
    const TemporaryFolder folder;
    ToyStages stages(settings);
    ExecuteOptions options;
    options.threads = threads;
    make_toy(settings, stages, folder.path(), options);
    EXPECT_EQ(digests_in(folder.path()), expected) << threads;
  }
}

// A mesh cannot be interrupted. When it takes longer than the patience after a stop, the process
// may end: the simulation's checkpoint is written by then.
TEST(Execute, GivesUpALongMeshOnlyAfterTheCheckpointIsWritten) {
  const TemporaryFolder folder;
  const ToySettings settings;
  ToyStages stages(settings);
  std::atomic<bool> stop{false}, abandoned{false}, had_checkpoint{false};
  stages.hook = [&](Step step, int frame) {
    if (step != Step::mesh || frame != 3) return;
    stop = true;
    for (int k = 0; k < 2000 && !abandoned; ++k) std::this_thread::sleep_for(10ms);
  };
  ExecuteOptions options;
  options.stop_requested = [&] { return stop.load(); };
  options.patience_s = 0.05;
  options.abandon = [&] {
    had_checkpoint = std::filesystem::exists(folder.path() / layout::stop_checkpoint);
    abandoned = true;
  };
  EXPECT_THROW(make_toy(settings, stages, folder.path(), options), Stopped);
  EXPECT_TRUE(abandoned);
  EXPECT_TRUE(had_checkpoint);
}

TEST(Execute, StopsWithACheckpointAboveItsMemoryLimit) {
  const TemporaryFolder folder;
  const ToySettings settings;
  ToyStages stages(settings);
  stages.hook = [](Step, int) { std::this_thread::sleep_for(10ms); };
  ExecuteOptions options;
  options.memory_gib = 1e-3;  // less than this program's own code
  try {
    make_toy(settings, stages, folder.path(), options);
    FAIL() << "the limit was not seen";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("--memory"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace drench
