#pragma once
// OUT/farm/tasks.jsonl: which job of the farm has which task. Append-only, one JSON object a line;
// the last of a task counts.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "pipeline/driver/step.h"

namespace drench {

struct SubmittedTask {
  Step step = Step::simulate;
  std::string frames;  // as task_frames() writes them
  std::string job;     // "12_3"
  std::string name;    // what the farm's lists call it
  std::string log;     // file name within farm/log
};

/// Last submission of each task, by log: a task of equal step and frames has an equal one. None if
/// there is no file. @throws Error if it cannot be read.
std::map<std::string, SubmittedTask> submitted_tasks(const std::filesystem::path& folder);

/// @throws Error if they cannot be written.
void add_submitted_tasks(const std::filesystem::path& folder,
                         const std::vector<SubmittedTask>& tasks);

}  // namespace drench
