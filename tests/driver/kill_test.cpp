// kill -9 and a full disk at any moment: the run continues and ends with the same bits.
//
// DRENCH_KILLS=N (default 8) sets how many points of each kind are tried.

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "pipeline/driver/layout.h"
#include "pipeline/driver/output_folder.h"
#include "tests/driver/tiny_shot.h"

namespace drench {
namespace {

using namespace test;
namespace fs = std::filesystem;

int wanted_points() {
  const char* text = std::getenv("DRENCH_KILLS");
  return text ? std::atoi(text) : 8;
}

/// Calls of each kind in an undisturbed run.
std::map<std::string, int> calls_of_a_run() {
  const TinyShot shot;
  const fs::path counts = shot.folder() / "counts";
  EXPECT_EQ(shot.run_with_fault("count:" + counts.string()).code, 0);
  std::map<std::string, int> calls;
  std::istringstream lines(text_of(counts));
  for (std::string name; lines >> name;) lines >> calls[name];
  return calls;
}

/// Evenly spread over 1 ... count, both ends among them.
std::set<int> spread(int count, int points) {
  std::set<int> chosen;
  for (int k = 0; k < points; ++k) {
    chosen.insert(1 + int(int64_t(k) * (count - 1) / std::max(1, points - 1)));
  }
  return chosen;
}

void expect_whole(const TinyShot& shot, const std::string& what) {
  const Ended ended = shot.run("run");
  ASSERT_EQ(ended.code, 0) << what << ": " << ended.err;
  EXPECT_EQ(shot.digests(), undisturbed_digests()) << what;
  const Manifest manifest(shot.out() / layout::manifest);
  EXPECT_TRUE(unlisted_files(shot.out(), manifest).empty())
      << what << ": " << unlisted_files(shot.out(), manifest).front();
}

// Every kind of call by which a file or a record is committed, before and after it.
TEST(Kill, AtCommitPointsLosesNothing) {
  const std::map<std::string, int> calls = calls_of_a_run();
  for (const std::string call : {"write", "fsync", "fdatasync", "rename"}) {
    ASSERT_GT(calls.at(call), 12) << call << " is not seen: the test would prove nothing";
    const char* when = "kill-before";
    std::set<int> points = spread(calls.at(call), wanted_points());
    // While the movie's frames are sent: the encoder must not outlive the program.
    if (call == "write") points.insert({calls.at(call) - 8, calls.at(call) - 6});
    for (const int at : points) {
      const TinyShot shot;
      const std::string fault = std::string(when) + ":" + call + ":" + std::to_string(at);
      const Ended ended = shot.run_with_fault(fault);
      // Threads race for the calls: the last of them may not come in this run.
      EXPECT_TRUE(ended.signal == SIGKILL || at > calls.at(call) - 8) << fault << ended.err;
      expect_whole(shot, fault);
      when = when == std::string("kill-before") ? "kill-after" : "kill-before";
    }
  }
}

// Random times within the length of a run; the seed is fixed, the scheduler is not.
TEST(Kill, AtRandomTimesLosesNothing) {
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(TinyShot().run("run").code, 0);
  const std::chrono::duration<double> length = std::chrono::steady_clock::now() - start;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0, 1);
  int killed = 0;
  for (int k = 0; k < wanted_points(); ++k) {
    const TinyShot shot;
    Child child(DRENCH_PROGRAM, shot.words("run"), shot.folder());
    std::this_thread::sleep_for(share(random) * length);
    child.send(SIGKILL);
    killed += child.wait().signal == SIGKILL;
    expect_whole(shot, "random kill " + std::to_string(k));
  }
  EXPECT_GT(killed, 0);
}

// Killed again and again: every run gets further, the last has the same bits.
TEST(Kill, ManyTimesInOneShotLosesNothing) {
  const TinyShot shot;
  int runs = 0;
  for (int at = 20; runs < 40; ++runs, at += 3) {
    if (shot.run_with_fault("kill-after:fsync:" + std::to_string(at)).signal != SIGKILL) break;
  }
  EXPECT_GT(runs, 2);
  expect_whole(shot, "many kills");
}

// From the n-th write on the disk is full: a clear message, nothing half-named, and the run goes on
// when there is room again.
TEST(DiskFull, IsReportedAndLosesNothing) {
  const std::map<std::string, int> calls = calls_of_a_run();
  for (const std::string call : {"write", "fsync", "rename"}) {
    for (const int at : spread(calls.at(call) - 8, wanted_points() / 2)) {
      const TinyShot shot;
      const std::string fault = "fail:" + call + ":" + std::to_string(at);
      const Ended ended = shot.run_with_fault(fault);
      EXPECT_EQ(ended.code, 1) << fault << ended.err;
      EXPECT_NE(ended.err.find("drench: "), std::string::npos) << ended.err;
      const Manifest manifest(shot.out() / layout::manifest);
      for (const auto& [file, record] : manifest.records()) {
        EXPECT_TRUE(has_recorded_digest(shot.out(), record)) << fault << ' ' << file;
      }
      expect_whole(shot, fault);
    }
  }
}

// The kernel's own limit: files above 8 KiB cannot be written (ulimit counts blocks of 512 bytes).
TEST(DiskFull, ByTheFileSizeLimitIsReported) {
  const TinyShot shot;
  const Ended ended = run_program("/bin/sh",
                                  {"-c", "ulimit -f 16; exec \"$0\" run \"$1\" --out \"$2\"",
                                   DRENCH_PROGRAM, shot.file().string(), shot.out().string()},
                                  shot.folder());
  EXPECT_EQ(ended.code, 1) << ended.err << " signal " << ended.signal;
  EXPECT_NE(ended.err.find("limit"), std::string::npos) << ended.err;
  expect_whole(shot, "file size limit");
}

}  // namespace
}  // namespace drench
