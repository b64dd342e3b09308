// The driver alone, whose stages are a few lines of arithmetic on files of some bytes, and frames
// on a farm.

#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>

#include "tests/bench/bench.h"
#include "tests/driver/farm/slurm_cluster.h"
#include "tests/driver/tiny_shot.h"
#include "tests/driver/toy_shot.h"
#include "tests/temporary_folder.h"

namespace drench::bench {
namespace {

using namespace test;

ToySettings settings_of(int frames) {
  ToySettings settings;
  settings.last = frames;
  return settings;
}

void emit_driver(const Emit& emit, const std::string& method, int steps, const Measured& cost,
                 double error, const std::string& error_of, double gate) {
  Line line;
  line.method = method;
  line.resolution = std::to_string(steps) + " steps";
  line.threads = hardware_threads();
  line.cost = cost;
  line.error = error, line.error_of = error_of, line.gate = gate;
  emit(line);
}

/// What a step costs beside its own work, what planning costs where nothing is there yet, and what
/// a run finds out that has nothing to do.
void driver_scale(const Emit& emit) {
  constexpr double shortest_step = 0.1;  // CPU s, of a frame that is worth a run of its own
  constexpr int many = 33334;
  const Measured planning = measure([&] {
    const TemporaryFolder folder;
    const Manifest manifest(folder.path() / layout::manifest);
    if (make_plan(toy_targets(settings_of(many)), take_snapshot(folder.path(), manifest), many)
            .nothing_to_do())
      throw std::runtime_error("nothing was planned");
  });
  emit_driver(emit, "plan", 3 * many, planning, planning.peak_mib, "peak, MiB", 200);

  for (const int frames : {100, 300, 1000}) {
    const TemporaryFolder folder;
    ToyStages stages(settings_of(frames));
    const auto run = [&] { make_toy(settings_of(frames), stages, folder.path()); };
    const Measured first = measure(run);
    const int steps = int(stages.events().size() / 2);
    emit_driver(emit, "run", steps, first, first.cpu_s / steps / shortest_step,
                "driver's share of steps of 0.1 CPU s", 0.01);
    const Measured again = measure(run);
    if (int(stages.events().size() / 2) != steps) throw std::runtime_error("a step ran again");
    emit_driver(emit, "nothing to do", steps, again, again.cpu_s / first.cpu_s,
                "CPU time over the first run's", 0.1);
  }
}

const Registration scale{"driver_scale", "planning, a step's overhead, a run with nothing to do",
                         driver_scale, InQuick::yes};

/// Frames of some seconds, on a cluster of two nodes of one core each and on one core alone.
void farm_scaling(const Emit& emit) {
  if (const std::string why = SlurmCluster::why_not(); !why.empty())
    throw std::runtime_error("farm_scaling: " + why);
  constexpr int frames = 48;
  const std::vector<std::string> picture{"--set", "render.samples=64", "--set", "render.width=256",
                                         "--set", "render.height=144"};
  const auto with_picture = [&](std::vector<std::string> words) {
    words.insert(words.end(), picture.begin(), picture.end());
    return words;
  };
  const auto must = [](const Ended& ended) {
    if (ended.code != 0) throw std::runtime_error("farm_scaling: " + ended.err);
  };
  const TinyShot local(frames), farmed(frames);
  for (const TinyShot* shot : {&local, &farmed}) {
    must(shot->run("simulate", picture));
    must(shot->run("mesh", picture));
  }
  const Measured alone = measure([&] { must(local.run("run", with_picture({"--threads", "1"}))); });
  const SlurmCluster cluster;
  const Measured both = measure([&] {
    must(run_program(DRENCH_PROGRAM, farmed.words("farm", with_picture({"--chunk", "8"})),
                     farmed.folder(), cluster.environment()));
    while (cluster.tasks_left() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  });
  if (farmed.digests() != local.digests()) throw std::runtime_error("farm_scaling: other bits");
  Line line;
  line.method = "two nodes of one core, tasks of 8 frames";
  line.resolution = std::to_string(frames) + " frames";
  line.threads = 1;
  line.cost = both;
  line.error = both.wall_s / (alone.wall_s / 2);
  line.error_of = "wall time over half of that of one core";
  line.gate = 1.15;
  line.more["one_core_wall_s"] = alone.wall_s;
  emit(line);
}

const Registration farm{"farm_scaling", "rendering by a Slurm cluster against one core",
                        farm_scaling};

}  // namespace
}  // namespace drench::bench
