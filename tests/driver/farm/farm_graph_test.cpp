// A plan cut into tasks: each finds what it reads, whatever order the farm takes that keeps to what
// they wait for.
#include "pipeline/driver/farm/farm_graph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "pipeline/driver/rules.h"
#include "tests/driver/toy_shot.h"

namespace drench {
namespace {

using test::toy_targets;
using test::ToySettings;

ToySettings whole_shot(int denoise_frames) {
  ToySettings settings;
  settings.foam = true;
  settings.denoise_frames = denoise_frames;
  settings.steps = all_steps();
  return settings;
}

FarmGraph graph_of(const Targets& targets, int chunk) {
  return farm_graph(targets, make_plan(targets, {}, targets.frames.back()), chunk);
}

using TaskId = std::pair<Step, int>;

/// A task and all that must be done before it.
std::set<TaskId> ancestors(const FarmGraph& graph, const TaskId& id) {
  std::set<TaskId> found{id};
  std::vector<TaskId> open{id};
  while (!open.empty()) {
    const TaskId next = open.back();
    open.pop_back();
    for (const FarmTask::Before& before :
         graph.stage(next.first)->tasks.at(size_t(next.second)).before)
      if (found.insert({before.step, before.task}).second)
        open.emplace_back(before.step, before.task);
  }
  return found;
}

/// Frames of which a task makes files: a chain also those before that are nobody's.
std::set<int> frames_made(const Targets& targets, const FarmGraph& graph, const TaskId& id) {
  const FarmTask& task = graph.stage(id.first)->tasks.at(size_t(id.second));
  std::set<int> frames(task.frames.begin(), task.frames.end());
  const bool chain = id.first == Step::simulate || rule_of(id.first).frames == Frames::from_first;
  if (chain)
    for (int frame = targets.first; frame < task.frames.back(); ++frame) frames.insert(frame);
  return frames;
}

std::set<std::string> files_made(const Targets& targets, const FarmGraph& graph, const TaskId& id) {
  std::set<std::string> made;
  for (const int frame : frames_made(targets, graph, id)) {
    const std::vector<std::string> files = id.first == Step::simulate
                                               ? simulated_files(targets, frame)
                                               : rule_of(id.first).outputs(targets, frame);
    made.insert(files.begin(), files.end());
  }
  return made;
}

/// What a task may read and any task makes, itself or one before it makes.
void expect_every_task_finds_its_inputs(const Targets& targets, const FarmGraph& graph) {
  std::set<std::string> made_by_any;
  for (const FarmStage& stage : graph.stages)
    for (int k = 0; k < int(stage.tasks.size()); ++k)
      made_by_any.merge(files_made(targets, graph, {stage.step, k}));
  for (const FarmStage& stage : graph.stages) {
    if (stage.step == Step::simulate) continue;
    for (int k = 0; k < int(stage.tasks.size()); ++k) {
      const FarmTask& task = stage.tasks[size_t(k)];
      std::set<std::string> made_before;
      for (const TaskId& id : ancestors(graph, {stage.step, k}))
        made_before.merge(files_made(targets, graph, id));
      for (const int frame : task.frames)
        for (const std::string& file : possible_inputs(rule_of(stage.step), targets, frame))
          EXPECT_EQ(made_before.contains(file), made_by_any.contains(file))
              << task_name(stage.step, task) << " reads " << file;
    }
  }
}

TEST(FarmGraph, HasEveryFrameOnceAndEveryInputBefore) {
  std::mt19937 random(3);
  for (int k = 0; k < 60; ++k) {
    ToySettings settings = whole_shot(int(random() % 4));
    settings.foam = random() % 2 == 0;
    settings.first = 1001, settings.last = 1001 + int(random() % 30);
    for (int frame = settings.first; frame <= settings.last; ++frame)
      if (random() % 3 > 0 || frame == settings.last) settings.frames.push_back(frame);
    const Targets targets = toy_targets(settings);
    const int chunk = 1 + int(random() % 7);
    const FarmGraph graph = graph_of(targets, chunk);
    expect_every_task_finds_its_inputs(targets, graph);
    for (const FarmStage& stage : graph.stages) {
      std::vector<int> frames;
      for (const FarmTask& task : stage.tasks) {
        EXPECT_FALSE(task.frames.empty());
        EXPECT_LE(int(task.frames.size()), is_per_frame(stage.step) ? chunk : settings.last);
        frames.insert(frames.end(), task.frames.begin(), task.frames.end());
      }
      EXPECT_EQ(frames, targets.frames) << step_name(stage.step);
    }
  }
}

TEST(FarmGraph, ChainsTheSimulationAndLeavesTheRestParallel) {
  ToySettings settings = whole_shot(0);
  settings.first = 1, settings.last = 12;
  const FarmGraph graph = graph_of(toy_targets(settings), 4);
  const FarmStage *simulate = graph.stage(Step::simulate), *mesh = graph.stage(Step::mesh),
                  *render = graph.stage(Step::render), *sheet = graph.stage(Step::contact_sheet);
  ASSERT_EQ(simulate->tasks.size(), 3u);
  using Before = std::vector<FarmTask::Before>;
  EXPECT_EQ(simulate->tasks[0].before, Before{});
  EXPECT_EQ(simulate->tasks[2].before, (Before{{Step::simulate, 1}}));
  EXPECT_EQ(mesh->tasks[2].before, (Before{{Step::simulate, 2}}));
  const Before& frames = render->tasks[1].before;
  EXPECT_NE(std::find(frames.begin(), frames.end(), FarmTask::Before{Step::mesh, 1}), frames.end());
  EXPECT_EQ(std::find(frames.begin(), frames.end(), FarmTask::Before{Step::render, 0}),
            frames.end());
  ASSERT_EQ(sheet->tasks.size(), 1u);
  EXPECT_EQ(sheet->tasks[0].before,
            (Before{{Step::render, 0}, {Step::render, 1}, {Step::render, 2}}));
  EXPECT_EQ(task_name(Step::contact_sheet, sheet->tasks[0]), "contact_sheet.1-12");
  EXPECT_EQ(task_name(Step::mesh, mesh->tasks[1]), "mesh.5-8");
}

TEST(FarmGraph, NamesTasksOfManyFramesInFewLetters) {
  FarmTask task;
  for (int frame = 0; frame < 1000; ++frame)
    task.frames.push_back(1001 + 3 * frame + int(frame % 7 == 0));
  const std::string name = task_name(Step::movie, task);
  EXPECT_LT(name.size(), 60u);
  EXPECT_EQ(name.find("movie.1002-3998"), 0u) << name;
  task.frames.erase(task.frames.begin() + 500);
  EXPECT_NE(task_name(Step::movie, task), name);
}

}  // namespace
}  // namespace drench
