// A shot on a real Slurm cluster, which loses a node and its controller on the way: it ends with
// the bits of a local run.
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "pipeline/driver/layout.h"
#include "tests/driver/farm/slurm_cluster.h"
#include "tests/driver/tiny_shot.h"

namespace drench {
namespace {

using namespace test;
using nlohmann::json;

#define NEEDS_SLURM() \
  if (const std::string why = SlurmCluster::why_not(); !why.empty()) GTEST_SKIP() << why

class Farm {
 public:
  explicit Farm(int frames) : shot(frames) {}

  Ended farm(const std::vector<std::string>& more) const {
    return run_program(DRENCH_PROGRAM, shot.words("farm", more), shot.folder(),
                       cluster.environment());
  }
  json status() const { return json::parse(farm({"--status", "--json"}).out); }
  int done(const std::string& step) const { return status()["steps"][step]["done"]; }

  /// Until nothing is left in the queue, healing on the way. @return whether it came to that
  bool finish(double seconds) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (cluster.tasks_left() > 0) {
      if (std::chrono::steady_clock::now() > end) return false;
      cluster.heal();
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
    }
    return true;
  }
  std::string logs() const {
    std::string text;
    for (const auto& entry : std::filesystem::directory_iterator(shot.out() / layout::farm_logs))
      text += "== " + entry.path().filename().string() + "\n" + text_of(entry.path());
    return text;
  }

  SlurmCluster cluster;
  TinyShot shot;
};

/// Of all files but checkpoints: a farm keeps one at the end of every task of the simulation.
std::map<std::string, std::string> frames_of(const TinyShot& shot) {
  std::map<std::string, std::string> digests = shot.digests();
  std::erase_if(digests,
                [](const auto& file) { return file.first.find(".ckpt") != std::string::npos; });
  return digests;
}

TEST(Farm, EndsWithTheBitsOfALocalRunAfterTheLossOfANodeAndOfItsController) {
  NEEDS_SLURM();
  Farm run(12);
  const TinyShot local(12);
  ASSERT_EQ(local.run("run").code, 0);

  const auto submit = [&] {
    const Ended submitted = run.farm({"--chunk", "2"});
    EXPECT_EQ(submitted.code, 0) << submitted.err;
  };
  const auto wait_for = [&](const std::string& step, int frames) {
    for (int k = 0; k < 300 && run.done(step) < frames; ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
  };
  submit();
  wait_for("simulate", 2);
  run.cluster.kill_controller();  // within seconds of the submission, which it has half forgotten
  std::this_thread::sleep_for(std::chrono::seconds(1));
  run.cluster.start_controller();
  submit();
  wait_for("mesh", 4);
  for (int k = 0; k < 100 && !run.cluster.runs_on("n1"); ++k) run.cluster.heal();
  run.cluster.kill_node("n1");
  std::this_thread::sleep_for(std::chrono::seconds(1));
  run.cluster.start_node("n1");
  for (int k = 0; k < 3 && run.done("movie") == 0; ++k) {
    ASSERT_TRUE(run.finish(60)) << run.cluster.run("squeue", {"--array"}) << run.logs();
    submit();
  }
  EXPECT_EQ(run.status()["failed"], json::array()) << run.logs();
  EXPECT_EQ(frames_of(run.shot), frames_of(local)) << run.logs();
  EXPECT_EQ(
      run_program(DRENCH_PROGRAM, {"verify", run.shot.out().string()}, run.shot.folder()).code, 0);
}

TEST(Farm, SubmitsOnlyWhatIsMissingAndNotQueued) {
  NEEDS_SLURM();
  const Farm run(4);
  ASSERT_EQ(run.shot.run("simulate").code, 0);
  run.cluster.run("scontrol", {"update", "PartitionName=film", "State=DOWN"});
  const Ended first = run.farm({"--chunk", "2"});
  ASSERT_EQ(first.code, 0) << first.err;
  const std::string queue =
      run.cluster.run("squeue", {"--noheader", "--array", "--format=%j", "--sort=j"});
  EXPECT_EQ(queue,
            "tiny.contact_sheet.1001-1004\ntiny.mesh.1001-1002\ntiny.mesh.1003-1004\n"
            "tiny.movie.1001-1004\ntiny.render.1001-1002\ntiny.render.1003-1004\n");
  const Ended second = run.farm({"--chunk", "2"});
  ASSERT_EQ(second.code, 0) << second.err;
  EXPECT_NE(second.err.find("0 tasks of up to 2 frames submitted, 6 were in the queue"),
            std::string::npos)
      << second.err;
  EXPECT_EQ(run.cluster.tasks_left(), 6);
  EXPECT_EQ(run.status()["steps"]["render"]["waiting"], 2);
  ASSERT_EQ(run.farm({"--cancel"}).code, 0);
  EXPECT_EQ(run.cluster.tasks_left(), 0);
}

/// One frame that fails stops what follows from it and nothing else.
TEST(Farm, GoesOnBesideAFrameThatFails) {
  NEEDS_SLURM();
  Farm run(4);
  ASSERT_EQ(run.shot.run("simulate").code, 0);
  // A folder stands where a mesh should be written.
  std::filesystem::create_directories(run.shot.out() / layout::fluid_mesh(1002));
  ASSERT_EQ(run.farm({"--chunk", "1"}).code, 0);
  ASSERT_TRUE(run.finish(60));
  const json status = run.status();
  EXPECT_EQ(status["steps"]["render"]["done"], 3) << run.logs();
  ASSERT_EQ(status["failed"].size(), 4u) << status["failed"];
  const std::string log = text_of(run.shot.out() / layout::farm_logs / "mesh.1002.log");
  EXPECT_NE(log.find("openjd_fail: "), std::string::npos) << log;
  EXPECT_NE(log.find("a folder stands where the file should be written"), std::string::npos) << log;

  std::filesystem::remove(run.shot.out() / layout::fluid_mesh(1002));
  ASSERT_EQ(run.farm({"--chunk", "1"}).code, 0);
  ASSERT_TRUE(run.finish(60));
  EXPECT_EQ(run.status()["failed"], json::array()) << run.logs();
  EXPECT_EQ(run.done("movie"), 1);
}

TEST(Farm, SaysWhatSlurmRefuses) {
  NEEDS_SLURM();
  const Farm run(2);
  const Ended ended = run.farm({"--cores", "64"});
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("ended with status 1: "), std::string::npos) << ended.err;
  EXPECT_EQ(run.cluster.tasks_left(), 0);
}

TEST(Farm, SaysWhereSlurmIsNot) {
  const TinyShot shot(2);
  const Ended ended =
      run_program(DRENCH_PROGRAM, shot.words("farm", {}), shot.folder(), {"PATH=/nowhere"});
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("sbatch: not found on PATH"), std::string::npos) << ended.err;
}

}  // namespace
}  // namespace drench
