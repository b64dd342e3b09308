// Planning is pure: these tests make up records and look at what is decided and why.
#include "pipeline/driver/plan.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "pipeline/driver/plan_text.h"
#include "tests/driver/toy_shot.h"

namespace drench {
namespace {

using test::toy_targets;
using test::ToySettings;

void put(Snapshot& snapshot, const std::string& file, Step step, int frame, const Key& key,
         const std::string& content) {
  Record record;
  record.file = file;
  record.step = step_name(step);
  record.frame = frame;
  record.digest = hash_bytes(content.data(), content.size());
  record.key = key.digest;
  record.parts = key.parts;
  snapshot[file] = {record, FileState::intact};
}

Lookup in(const Snapshot& snapshot) {
  return [&snapshot](const std::string& file) -> std::optional<KnownFile> {
    const auto found = snapshot.find(file);
    return found == snapshot.end() ? std::nullopt : std::optional(found->second);
  };
}

/// Everything made and intact.
Snapshot complete(const ToySettings& settings) {
  const Targets targets = toy_targets(settings);
  const std::vector<Digest> keys = simulation_keys(targets, targets.frames.back());
  Snapshot snapshot;
  for (const int frame : targets.frames) {
    const Key key{keys[size_t(frame - targets.first)], targets.simulate.parts};
    for (const std::string& file : simulated_files(targets, frame)) {
      put(snapshot, file, Step::simulate, frame, key, file);
    }
    if (targets.fluid) {
      put(snapshot, layout::fluid_mesh(frame), Step::mesh, frame,
          decide(rule_of(Step::mesh), targets, frame, in(snapshot))->key,
          "mesh" + std::to_string(frame));
    }
    put(snapshot, layout::image(targets.shot, frame), Step::render, frame,
        decide(rule_of(Step::render), targets, frame, in(snapshot))->key,
        "image" + std::to_string(frame));
  }
  put(snapshot, std::string(layout::contact_sheet), Step::contact_sheet, 0,
      decide(rule_of(Step::contact_sheet), targets, 0, in(snapshot))->key, "sheet");
  return snapshot;
}

void put_checkpoint(Snapshot& snapshot, const ToySettings& settings, int frame,
                    const std::string& file) {
  const Targets targets = toy_targets(settings);
  const Key key{simulation_keys(targets, frame).back(), targets.simulate.parts};
  put(snapshot, file, Step::simulate, frame, key, file);
  snapshot[file].record.step = checkpoint_record;
}

std::vector<Task> tasks_of(const Plan& plan, Step step) {
  std::vector<Task> tasks;
  for (const Task& task : plan.tasks) {
    if (task.step == step) tasks.push_back(task);
  }
  return tasks;
}

void expect_all(const Plan& plan, Step step, Action action, const std::string& reason) {
  const std::vector<Task> tasks = tasks_of(plan, step);
  ASSERT_FALSE(tasks.empty());
  for (const Task& task : tasks) {
    EXPECT_EQ(task.action, action) << step_name(step) << ' ' << task.frame << ' ' << task.reason;
    EXPECT_EQ(task.reason, reason) << step_name(step) << ' ' << task.frame;
  }
}

TEST(Plan, RunsEverythingInAnEmptyFolder) {
  const ToySettings settings;
  const Plan plan = make_plan(toy_targets(settings), {}, settings.last);
  for (const Step step : settings.steps) {
    for (const Task& task : tasks_of(plan, step)) EXPECT_EQ(task.action, Action::run);
  }
  EXPECT_EQ(plan.tasks.size(), 3 * 25u + 1);
  EXPECT_TRUE(plan.simulation.needed);
  EXPECT_EQ(plan.simulation.checkpoint, "");
  EXPECT_TRUE(plan.problems.empty());
}

TEST(Plan, HasNothingToDoWhenEveryKeyIsUnchanged) {
  const ToySettings settings;
  const Plan plan = make_plan(toy_targets(settings), complete(settings), settings.last);
  EXPECT_TRUE(plan.nothing_to_do());
  for (const Step step : settings.steps) expect_all(plan, step, Action::skip, "key unchanged");
}

TEST(Plan, RendersOnlyAfterACameraEdit) {
  ToySettings settings;
  const Snapshot snapshot = complete(settings);
  settings.camera = "right";
  const Plan plan = make_plan(toy_targets(settings), snapshot, settings.last);
  expect_all(plan, Step::simulate, Action::skip, "key unchanged");
  expect_all(plan, Step::mesh, Action::skip, "key unchanged");
  expect_all(plan, Step::render, Action::run, "camera changed");
  expect_all(plan, Step::contact_sheet, Action::run, "frames are rendered");
}

TEST(Plan, MeshesAgainAfterASurfaceEditAndLetsRenderingDependOnIt) {
  ToySettings settings;
  const Snapshot snapshot = complete(settings);
  settings.mesh_digits = 3;
  const Plan plan = make_plan(toy_targets(settings), snapshot, settings.last);
  expect_all(plan, Step::simulate, Action::skip, "key unchanged");
  expect_all(plan, Step::mesh, Action::run, "surface changed");
  expect_all(plan, Step::render, Action::depends, "runs if what it reads changes");
}

TEST(Plan, RestartsTheSimulationWhenAnythingOfItsKeyChanges) {
  for (const bool program : {false, true}) {
    ToySettings settings;
    Snapshot snapshot = complete(settings);
    put_checkpoint(snapshot, settings, 21, layout::checkpoint(21));
    (program ? settings.program : settings.camera) = "2";
    if (!program) settings.growth = 3.8;
    const Plan plan = make_plan(toy_targets(settings), snapshot, settings.last);
    expect_all(plan, Step::simulate, Action::run, program ? "program changed" : "fluid changed");
    EXPECT_EQ(plan.simulation.checkpoint, "") << "a checkpoint of other settings was taken";
    EXPECT_EQ(plan.simulation.from, 1);
  }
}

TEST(Plan, SkipsMeshingWithoutFluid) {
  ToySettings settings;
  settings.fluid = false;
  const Plan plan = make_plan(toy_targets(settings), {}, settings.last);
  expect_all(plan, Step::mesh, Action::skip, "no fluid");
  expect_all(plan, Step::render, Action::run, "not made yet");
}

TEST(Plan, ContinuesALongerRangeFromTheLastCheckpoint) {
  ToySettings settings;
  Snapshot snapshot = complete(settings);
  put_checkpoint(snapshot, settings, 11, layout::checkpoint(11));
  put_checkpoint(snapshot, settings, 21, layout::checkpoint(21));
  settings.last = 40;
  const Plan plan = make_plan(toy_targets(settings), snapshot, settings.last);
  EXPECT_EQ(plan.simulation.checkpoint, layout::checkpoint(21));
  EXPECT_EQ(plan.simulation.last, 40);
  const std::vector<Task> tasks = tasks_of(plan, Step::simulate);
  EXPECT_EQ(tasks[20].action, Action::skip);              // 21: the checkpoint's own frame
  EXPECT_EQ(tasks[21].reason, "on the way to frame 40");  // 22: there, but passed again
  EXPECT_EQ(tasks[25].reason, "not made yet");            // 26
}

// A checkpoint on a frame can write that frame; one made on stop stands after its frame.
TEST(Plan, TakesTheStopCheckpointOnlyWhenItsFrameIsThere) {
  const ToySettings settings;
  const std::string stop(layout::stop_checkpoint);
  Snapshot snapshot = complete(settings);
  put_checkpoint(snapshot, settings, 11, layout::checkpoint(11));
  put_checkpoint(snapshot, settings, 14, stop);
  snapshot.erase(layout::particles(15));
  const Targets targets = toy_targets(settings);
  EXPECT_EQ(make_plan(targets, snapshot, settings.last).simulation.checkpoint, stop);
  snapshot.erase(layout::particles(14));
  EXPECT_EQ(make_plan(targets, snapshot, settings.last).simulation.checkpoint,
            layout::checkpoint(11));
  snapshot.erase(layout::particles(11));
  EXPECT_EQ(make_plan(targets, snapshot, settings.last).simulation.from, 11);
  snapshot.erase(layout::particles(10));
  EXPECT_EQ(make_plan(targets, snapshot, settings.last).simulation.checkpoint, "");
}

TEST(Plan, MakesAMissingOrDamagedFileAgainAndNothingElse) {
  const ToySettings settings;
  for (const FileState state : {FileState::missing, FileState::changed}) {
    Snapshot snapshot = complete(settings);
    snapshot[layout::image("toy", 7)].state = state;
    const Plan plan = make_plan(toy_targets(settings), snapshot, settings.last);
    EXPECT_FALSE(plan.simulation.needed);
    expect_all(plan, Step::mesh, Action::skip, "key unchanged");
    for (const Task& task : tasks_of(plan, Step::render)) {
      EXPECT_EQ(task.action, task.frame == 7 ? Action::run : Action::skip) << task.frame;
    }
    EXPECT_EQ(tasks_of(plan, Step::render)[6].reason,
              state == FileState::missing ? "file is missing" : "file was damaged or changed");
  }
}

TEST(Plan, SaysWhatALaterStageAloneIsMissing) {
  ToySettings settings;
  settings.steps = {Step::mesh};
  const Plan plan = make_plan(toy_targets(settings), {}, settings.last);
  ASSERT_EQ(plan.problems.size(), 1u);
  EXPECT_NE(plan.problems[0].find("drench simulate"), std::string::npos) << plan.problems[0];
}

TEST(Plan, NamesTheSheetThatMeshingIsMissing) {
  ToySettings settings;
  settings.steps = {Step::mesh};
  Targets targets = toy_targets(settings);
  const Snapshot snapshot = complete(settings);  // particles of every frame, and no sheet
  targets.cloth = {"flag"};
  const Plan plan = make_plan(targets, snapshot, settings.last);
  ASSERT_EQ(plan.problems.size(), 1u);
  EXPECT_NE(plan.problems[0].find("25 of the files"), std::string::npos) << plan.problems[0];
  EXPECT_NE(plan.problems[0].find(layout::cloth("flag", 1)), std::string::npos);
}

TEST(Plan, ReportsFramesBeyondAShortenedRange) {
  ToySettings settings;
  const Snapshot snapshot = complete(settings);
  settings.last = 20;
  const Plan plan = make_plan(toy_targets(settings), snapshot, settings.last);
  EXPECT_EQ(plan.beyond.size(), 5 * 3u);  // frames 21 to 25: particles, mesh, image
  EXPECT_TRUE(tasks_of(plan, Step::render).size() == 20u);
}

std::string json_of(const Plan& plan) {
  std::string text;
  write_plan_json(plan, {}, [&](std::string_view piece) { text += piece; });
  return text;
}

TEST(Plan, PrintsEveryTaskAsJson) {
  const ToySettings settings;
  const Plan plan = make_plan(toy_targets(settings), {}, settings.last);
  const nlohmann::json json = nlohmann::json::parse(json_of(plan));
  ASSERT_EQ(json["tasks"].size(), plan.tasks.size());
  EXPECT_EQ(json["tasks"][0]["step"], "simulate");
  EXPECT_EQ(json["tasks"][0]["frame"], 1);
  EXPECT_EQ(json["tasks"][0]["action"], "run");
  EXPECT_EQ(json["tasks"][0]["reason"], "not made yet");
}

TEST(Plan, GroupsFramesOfEqualFateInItsText) {
  const ToySettings settings;
  Snapshot snapshot = complete(settings);
  snapshot[layout::image("toy", 7)].state = FileState::missing;
  const std::string text = plan_text(make_plan(toy_targets(settings), snapshot, settings.last));
  EXPECT_NE(text.find("1-6"), std::string::npos) << text;
  EXPECT_NE(text.find("8-25"), std::string::npos) << text;
}

}  // namespace
}  // namespace drench
