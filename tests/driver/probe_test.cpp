// A probe's file: one for all frames, made when it must be and never otherwise.

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "pipeline/driver/layout.h"
#include "tests/driver/tiny_shot.h"

namespace drench {
namespace {

using namespace test;
namespace fs = std::filesystem;

size_t rows_of(const std::string& csv) {
  return size_t(std::count(csv.begin(), csv.end(), '\n')) - 4;  // three lines say what it is
}

std::string gauge_of(const TinyShot& shot) { return text_of(shot.out() / layout::probe("gauge")); }

std::map<std::string, std::string> sim_digests(const TinyShot& shot) {
  std::map<std::string, std::string> digests = shot.digests();
  std::erase_if(digests, [](const auto& file) { return !file.first.starts_with("sim/probe"); });
  return digests;
}

TEST(ProbeFile, HasARowForTheStartAndForEveryStep) {
  const TinyShot shot(2);
  ASSERT_EQ(shot.run("simulate").code, 0);
  const std::string csv = gauge_of(shot);
  EXPECT_NE(csv.find("time [s],height [m]\n0,"), std::string::npos) << csv;
  EXPECT_NE(csv.find("\n0.0416666666667,"), std::string::npos) << csv;  // a step ends at 1/24 s
  const std::string stats = text_of(shot.out() / layout::stats);
  const size_t at = stats.find("\"steps\":");
  ASSERT_NE(at, std::string::npos) << stats;
  EXPECT_EQ(rows_of(csv), 1u + size_t(std::stoi(stats.substr(at + 8))));
}

// It is made from the last checkpoint, which holds its rows; nothing else is made again.
TEST(ProbeFile, IsMadeAgainWhenItIsMissing) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("run").code, 0);
  fs::remove(shot.out() / layout::probe("flag"));
  const Ended plan = shot.run("plan");
  EXPECT_NE(plan.out.find("file is missing"), std::string::npos) << plan.out;
  EXPECT_NE(plan.out.find("continues from frame 1012"), std::string::npos) << plan.out;
  EXPECT_EQ(shot.run("run").code, 0);
  EXPECT_EQ(shot.digests(), undisturbed_digests());
}

// A longer range goes on with it; a shorter one, or frames made again, leave it as it is.
TEST(ProbeFile, GrowsWithTheRangeAndNeverShrinks) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("simulate", {"--frames", "1001-1005"}).code, 0);
  const size_t before = rows_of(gauge_of(shot));
  ASSERT_EQ(shot.run("simulate").code, 0);
  EXPECT_GT(rows_of(gauge_of(shot)), before);
  const std::string whole = gauge_of(shot);
  fs::remove(shot.out() / layout::particles(1004));
  ASSERT_EQ(shot.run("simulate", {"--frames", "1001-1006"}).code, 0);
  EXPECT_EQ(gauge_of(shot), whole);
  const Ended plan = shot.run("plan", {"--frames", "1001-1006"});
  EXPECT_EQ(plan.out.find("simulate       run"), std::string::npos) << plan.out;
  ASSERT_EQ(shot.run("run").code, 0);
  EXPECT_EQ(sim_digests(shot).size(), 2u);
  for (const auto& [file, digest] : sim_digests(shot))
    EXPECT_EQ(digest, undisturbed_digests().at(file)) << file;
}

// Stopped on request within a frame, killed, and continued: the same bytes.
TEST(ProbeFile, IsTheSameAfterStopsAndKills) {
  const TinyShot shot;
  for (const int signal : {SIGTERM, SIGKILL, SIGTERM, SIGKILL}) {
    Child child(DRENCH_PROGRAM, shot.words("simulate"), shot.folder());
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    child.send(signal);
    child.wait();
  }
  ASSERT_EQ(shot.run("run").code, 0);
  EXPECT_EQ(shot.digests(), undisturbed_digests());
}

// What a probe of the shot no longer measures is left over; meshes and images do not change.
TEST(ProbeFile, IsLeftOverWhenItsProbeIsGone) {
  const TinyShot shot;
  ASSERT_EQ(shot.run("run").code, 0);
  std::string text = text_of(shot.file());
  const size_t gauge = text.rfind("[[probe]]"), rest = text.find("[surface]");
  put_text(shot.file(), text.erase(gauge, rest - gauge));
  const Ended plan = shot.run("plan");
  EXPECT_NE(plan.out.find("probe changed"), std::string::npos) << plan.out;
  const Ended ended = shot.run("run");
  EXPECT_EQ(ended.code, 0);
  EXPECT_NE(ended.err.find("probe.gauge.csv"), std::string::npos) << ended.err;
  EXPECT_EQ(shot.run("clean").code, 0);
  EXPECT_FALSE(fs::exists(shot.out() / layout::probe("gauge")));
  const auto digests = shot.digests();
  EXPECT_EQ(digests.at(layout::image("tiny", 1012)),
            undisturbed_digests().at(layout::image("tiny", 1012)));
  EXPECT_EQ(digests.at(layout::probe("flag")), undisturbed_digests().at(layout::probe("flag")));
}

}  // namespace
}  // namespace drench
