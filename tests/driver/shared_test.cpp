// Several drivers and one output folder: alone they refuse each other, sharing they work together.
//
// DRENCH_RACES=N (default 4) sets how often they are started at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <sstream>

#include "pipeline/driver/output_folder.h"
#include "tests/driver/tiny_shot.h"

namespace drench {
namespace {

using namespace test;

int races() {
  const char* text = std::getenv("DRENCH_RACES");
  return text ? std::atoi(text) : 4;
}

/// A run of the shot, in its own folder unless the words name another.
std::vector<std::string> words_of(const TinyShot& shot, const std::vector<std::string>& more) {
  if (std::find(more.begin(), more.end(), "--out") == more.end()) return shot.words("run", more);
  std::vector<std::string> words{"run", shot.file().string()};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// Starts them at once and waits for all.
std::vector<Ended> run_at_once(const TinyShot& shot,
                               const std::vector<std::vector<std::string>>& words) {
  std::vector<std::unique_ptr<Child>> children;
  for (const std::vector<std::string>& more : words)
    children.push_back(
        std::make_unique<Child>(DRENCH_PROGRAM, words_of(shot, more), shot.folder()));
  std::vector<Ended> ended;
  for (const auto& child : children) ended.push_back(child->wait());
  return ended;
}

void expect_whole(const TinyShot& shot) {
  EXPECT_EQ(shot.digests(), undisturbed_digests(4));
  const Ended verified =
      run_program(DRENCH_PROGRAM, {"verify", shot.out().string()}, shot.folder());
  EXPECT_EQ(verified.code, 0) << verified.err;
}

TEST(FolderLock, IsSharedByThoseThatSaySo) {
  const TemporaryFolder folder;
  {
    const FolderLock first(folder.path(), LockKind::shared);
    const FolderLock second(folder.path(), LockKind::shared);
    const std::string text = error_of([&] { FolderLock(folder.path()); });
    EXPECT_NE(text.find("is working in this folder"), std::string::npos) << text;
  }
  const FolderLock alone(folder.path());
  const std::string text = error_of([&] { FolderLock(folder.path(), LockKind::shared); });
  EXPECT_NE(text.find(std::to_string(::getpid())), std::string::npos) << text;
}

TEST(FolderLock, LeavesHalfWrittenFilesOfOthersThatShareIt) {
  const TemporaryFolder folder;
  const std::filesystem::path temporary = folder / ".of another machine.00000000.1-1.tmp.ply";
  const auto first = std::make_unique<FolderLock>(folder.path(), LockKind::shared);
  put_text(temporary, "half");
  { const FolderLock second(folder.path(), LockKind::shared); }
  EXPECT_TRUE(std::filesystem::exists(temporary));
}

TEST(Drivers, OfOneFolderRefuseEachOther) {
  for (int k = 0; k < races(); ++k) {
    const TinyShot shot(4);
    int done = 0;
    for (const Ended& ended : run_at_once(shot, {{}, {}, {}})) {
      done += ended.code == 0;
      if (ended.code == 0) continue;
      EXPECT_EQ(ended.code, 1);
      EXPECT_NE(ended.err.find(": process "), std::string::npos) << ended.err;
      EXPECT_NE(ended.err.find("is working in this folder"), std::string::npos) << ended.err;
    }
    EXPECT_GE(done, 1);
    expect_whole(shot);
  }
}

TEST(Drivers, ThatShareAFolderEndWithOneResult) {
  for (int k = 0; k < races(); ++k) {
    const TinyShot shot(4);
    for (const Ended& ended : run_at_once(shot, {{"--shared"}, {"--shared"}, {"--shared"}}))
      EXPECT_EQ(ended.code, 0) << ended.err;
    expect_whole(shot);
  }
}

/// A folder that is mounted twice by FUSE, with caches apart, as two machines have one of a file
/// server. Locks go through, nothing else tells one mount of what the other does.
class TwoMounts {
 public:
  TwoMounts() {
    for (const char* name : {"files", "a", "b"}) std::filesystem::create_directory(folder_ / name);
    for (const char* name : {"a", "b"}) {
      const Ended ended =
          run_program("/bin/sh",
                      {"-c", "exec bindfs --enable-lock-forwarding --multithreaded \"$0\" \"$1\"",
                       folder_ / "files", folder_ / name},
                      folder_.path());
      if (ended.code != 0) why_not_ = "bindfs: " + ended.err;
    }
  }
  ~TwoMounts() {
    for (const char* name : {"a", "b"})
      run_program("/bin/sh", {"-c", "exec fusermount -u \"$0\"", folder_ / name}, folder_.path());
  }
  const std::string& why_not() const { return why_not_; }
  std::filesystem::path at(const std::string& mount) const { return folder_ / mount / "out"; }

 private:
  TemporaryFolder folder_;
  std::string why_not_;
};

TEST(Drivers, ShareAFolderOverTwoMounts) {
  const TwoMounts mounts;
  if (!mounts.why_not().empty()) GTEST_SKIP() << mounts.why_not();
  const TinyShot shot(4);
  for (const Ended& ended : run_at_once(
           shot, {{"--shared", "--out", mounts.at("a")}, {"--shared", "--out", mounts.at("b")}}))
    EXPECT_EQ(ended.code, 0) << ended.err;
  const Ended verified =
      run_program(DRENCH_PROGRAM, {"verify", mounts.at("files").string()}, shot.folder());
  EXPECT_EQ(verified.code, 0) << verified.err;
  std::map<std::string, std::string> digests;
  for (const auto& [file, digest] : undisturbed_digests(4))
    digests[file] = hash_file(mounts.at("files") / file).hex();
  EXPECT_EQ(digests, undisturbed_digests(4));
}

/// As tasks of a farm: one step of a few frames each, some of them twice at once.
TEST(Drivers, MakeAShotInPieces) {
  const TinyShot shot(4);
  using Words = std::vector<std::string>;
  const auto task = [](const std::string& steps, const std::string& frames) {
    return Words{"--shared", "--steps", steps, "--frames", frames};
  };
  const auto expect_done = [&](const std::vector<Words>& tasks) {
    for (const Ended& ended : run_at_once(shot, tasks)) EXPECT_EQ(ended.code, 0) << ended.err;
  };
  expect_done({task("simulate", "1001-1002"), task("simulate", "1001-1002")});
  expect_done({task("simulate", "1003-1004"), task("mesh,foam", "1001-1002")});
  expect_done({task("mesh", "1003-1004"), task("render", "1001-1002")});
  expect_done({task("render", "1003-1004"), task("render", "1003-1004")});
  expect_done({task("contact_sheet,movie", "1001-1004")});
  std::map<std::string, std::string> digests = shot.digests();
  digests.erase("sim/checkpoint/frame.1002.ckpt");  // the end of the first task
  EXPECT_EQ(digests, undisturbed_digests(4));
}

TEST(Drivers, RefuseAStepThatThereIsNot) {
  const TinyShot shot(2);
  const Ended ended = shot.run("run", {"--steps", "simulate,polish"});
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("polish"), std::string::npos) << ended.err;
}

// ---- what a farm's worker reads ----

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(OpenJobDescription, IsToldTheProgressWithinFramesAndToItsEnd) {
  const TinyShot shot(2);
  // A frame takes a second and more: a share of one is told once a second.
  const Ended ended = shot.run("run", {"--openjd", "--set", "render.width=320", "--set",
                                       "render.height=180", "--set", "render.samples=128"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  double before = 0, last = 0;
  bool within_a_frame = false;
  for (const std::string& line : lines_of(ended.out)) {
    if (line.rfind("openjd_status: ", 0) == 0) continue;
    ASSERT_EQ(line.rfind("openjd_progress: ", 0), 0u) << line;
    last = std::stod(line.substr(17));
    EXPECT_GE(last, before);
    before = last;
    // Eight tasks in all: sim, mesh and render of two frames, contact sheet and movie.
    const double tasks = last / 100 * 8;
    within_a_frame = within_a_frame || std::abs(tasks - std::round(tasks)) > 0.01;
  }
  EXPECT_EQ(last, 100);
  EXPECT_TRUE(within_a_frame) << ended.out;
}

TEST(OpenJobDescription, IsToldWhatFailed) {
  const TinyShot shot(2);
  std::filesystem::create_directories(shot.out() / "sim/particles.1002.vdb");
  const Ended ended = shot.run("run", {"--openjd"});
  EXPECT_EQ(ended.code, 1);
  const std::vector<std::string> lines = lines_of(ended.out);
  ASSERT_FALSE(lines.empty());
  EXPECT_EQ(lines.back().rfind("openjd_fail: ", 0), 0u) << lines.back();
  EXPECT_NE(lines.back().find("a folder stands where"), std::string::npos) << lines.back();
}

}  // namespace
}  // namespace drench
