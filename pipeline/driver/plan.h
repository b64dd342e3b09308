#pragma once
// Targets + what the folder holds -> what to do, each with its reason. Pure: no input, no output.

#include <string>
#include <string_view>
#include <vector>

#include "pipeline/driver/decide.h"

namespace drench {

enum class Action {
  run,
  skip,
  depends  // runs if a step before it changes the file it reads
};
std::string_view action_name(Action action);

/// One step of one frame; the contact sheet and the movie have frame 0.
struct Task {
  Step step = Step::simulate;
  int frame = 0;
  Action action = Action::skip;
  std::string reason;
};

/// Where the simulation starts and how far it must go.
struct SimulationSpan {
  bool needed = false;
  std::string checkpoint;  // file, empty: from the initial state
  int from = 0;            // frame of the state it starts with
  int last = 0;            // last frame that is not there
};

struct Plan {
  SimulationSpan simulation;
  std::vector<Task> tasks;            // in order of step, then frame
  std::vector<std::string> problems;  // inputs that no step of this run makes: nothing can run
  std::vector<std::string> warnings;
  std::vector<std::string>
      beyond;  // listed files of frames, sheets or steps the shot does not have

  bool nothing_to_do() const;
};

Plan make_plan(const Targets& targets, const Snapshot& snapshot, int timeline_last);

}  // namespace drench
