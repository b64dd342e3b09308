// The table of rules: whole, in an order that can be carried out, with a function for each row.
#include "pipeline/driver/rules.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "pipeline/driver/make.h"
#include "tests/driver/toy_shot.h"

namespace drench {
namespace {

TEST(Rules, AreOneForEachStepButTheSimulation) {
  std::vector<Step> steps{Step::simulate};
  for (const Rule& rule : rules()) steps.push_back(rule.step);
  EXPECT_EQ(steps, all_steps());
  for (const Rule& rule : rules()) EXPECT_EQ(&rule_of(rule.step), &rule);
}

TEST(Rules, ReadOnlyWhatIsMadeBefore) {
  for (const Rule& rule : rules())
    for (const Input& input : rule.inputs) {
      if (input.step == rule.step) {
        EXPECT_LT(input.frames.last, 0) << step_name(rule.step);
      } else {
        EXPECT_LT(input.step, rule.step) << step_name(rule.step);
      }
    }
}

/// What waits for its neighbours is made where they are made; nothing else waits for a worker that
/// comes after its own.
TEST(Rules, AreCarriedOutInOrder) {
  Worker last = Worker::simulate;
  for (const Rule& rule : rules()) {
    EXPECT_GE(worker_of(rule.step), last) << step_name(rule.step);
    last = worker_of(rule.step);
    EXPECT_EQ(last == Worker::last, rule.frames == Frames::once) << step_name(rule.step);
  }
}

/// Every input of a shot that has everything is an output of the rule that it names.
TEST(Rules, ReadWhatOthersMake) {
  test::ToySettings settings;
  settings.foam = true;
  settings.denoise_frames = 1;
  const Targets targets = test::toy_targets(settings);
  for (const Rule& rule : rules())
    for (const Input& input : rule.inputs) {
      if (input.step == Step::simulate) continue;
      const std::vector<std::string> made = rule_of(input.step).outputs(targets, 3);
      for (const std::string& file : input.files(targets, 3))
        EXPECT_NE(std::find(made.begin(), made.end(), file), made.end()) << file;
    }
}

}  // namespace
}  // namespace drench
