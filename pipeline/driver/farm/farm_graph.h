#pragma once
// A plan cut into tasks for the machines of a farm: a step of a range of frames each, and the tasks
// that must be done before. Pure: no input, no output.

#include <string>
#include <vector>

#include "pipeline/driver/plan.h"

namespace drench {

/// One step of a range of frames: `drench run --steps STEP --frames FRAMES`.
struct FarmTask {
  std::vector<int> frames;  // sorted; of a step of all frames at once, all of them
  /// A task that must be done before.
  struct Before {
    Step step;
    int task;  // of the step's tasks
    bool operator==(const Before&) const = default;
  };
  std::vector<Before> before;
};

struct FarmStage {
  Step step;
  std::vector<FarmTask> tasks;
};

/// In order of step: a task comes after those that it waits for.
struct FarmGraph {
  std::vector<FarmStage> stages;

  /// Nothing if the step has no tasks.
  const FarmStage* stage(Step step) const;
  size_t task_count() const;
};

/// Tasks for all that the plan runs, or may have to. A simulation and a rule that makes each frame
/// of the one before are chains; any other task waits for what its rule reads.
/// @param chunk  most frames of a task, at least 1.
FarmGraph farm_graph(const Targets& targets, const Plan& plan, int chunk);

/// "contact_sheet": a step as a word of a command line.
std::string step_word(Step step);
/// "1001-1004"
std::string task_frames(const FarmTask& task);
/// "mesh.1001-1004": names a task, in lists of the farm and of its log.
std::string task_name(Step step, const FarmTask& task);

}  // namespace drench
