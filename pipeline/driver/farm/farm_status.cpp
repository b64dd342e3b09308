// How far a shot is on the farm: what is made the manifest says, what runs Slurm, how long it takes
// stats.jsonl, and how far a running task is the end of its log.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>

#include "pipeline/driver/farm/farm.h"
#include "pipeline/driver/farm/farm_record.h"
#include "pipeline/driver/farm/measured.h"
#include "pipeline/driver/farm/slurm.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/progress.h"
#include "pipeline/driver/rules.h"
#include "pipeline/driver/standard_output.h"

namespace drench {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

struct StepStatus {
  int done = 0, frames = 0;
  int running = 0, waiting = 0;  // tasks
  std::optional<double> mean_s, left_s;
};

struct TaskStatus {
  SubmittedTask task;
  slurm::State state;
  std::optional<double> percent;  // of a task that runs
};

struct FarmStatus {
  std::map<Step, StepStatus> steps;
  std::vector<TaskStatus> running, failed;
};

/// The last of the lines "openjd_progress: 43.2" at the end of a log.
std::optional<double> progress_in(const fs::path& log) {
  std::ifstream file(log, std::ios::binary | std::ios::ate);
  if (!file) return {};
  constexpr std::streamoff most = 1 << 16;
  file.seekg(std::max<std::streamoff>(0, std::streamoff(file.tellg()) - most));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const size_t mark = text.rfind(openjd_progress);
  if (mark == std::string::npos) return {};
  return std::strtod(text.c_str() + mark + openjd_progress.size(), nullptr);
}

void count_frames(const Job& job, FarmStatus& status) {
  const Plan plan = plan_of(job, Manifest(job.folder / layout::manifest));
  for (const Task& task : plan.tasks) {
    StepStatus& step = status.steps[task.step];
    ++step.frames;
    step.done += task.action == Action::skip;
  }
}

void count_tasks(const Job& job, FarmStatus& status) {
  const std::map<std::string, SubmittedTask> submitted = submitted_tasks(job.folder);
  if (submitted.empty()) return;
  const std::map<std::string, slurm::State> queue = slurm::queue();
  for (const auto& [log, task] : submitted) {
    const auto found = queue.find(task.job);
    if (found == queue.end() || found->second.name != task.name) continue;
    const slurm::State& state = found->second;
    StepStatus& step = status.steps[task.step];
    if (state.is_waiting()) {
      ++step.waiting;
    } else if (state.is_active()) {
      ++step.running;
      status.running.push_back(
          {task, state, progress_in(job.folder / layout::farm_logs / task.log)});
    } else if (state.state != "COMPLETED") {
      status.failed.push_back({task, state, {}});
    }
  }
}

void tell_time_left(const Job& job, FarmStatus& status) {
  const std::map<Step, Measured> measured = measured_steps(job.folder / layout::stats);
  for (auto& [name, step] : status.steps) {
    const auto found = measured.find(name);
    if (found == measured.end()) continue;
    step.mean_s = found->second.mean_s;
    step.left_s = (step.frames - step.done) * found->second.mean_s / std::max(1, step.running);
  }
}

std::string failed_text(const fs::path& folder, const TaskStatus& task) {
  if (task.state.reason == slurm::never)
    return fmt::format("waited  {}: for one that failed\n", task.task.name);
  return fmt::format("failed  {}: {}, see {}\n", task.task.name, task.state.state,
                     (folder / layout::farm_logs / task.task.log).string());
}

std::string text_of(const fs::path& folder, const FarmStatus& status) {
  std::string text;
  for (const auto& [name, step] : status.steps) {
    text += fmt::format("{:13}  {}  {:>9}  {:>3} run  {:>3} wait", step_name(name),
                        bar_text(step.frames ? double(step.done) / step.frames : 1, 20),
                        fmt::format("{}/{}", step.done, step.frames), step.running, step.waiting);
    if (step.mean_s && is_per_frame(name)) text += fmt::format("  {:8.1f} s a frame", *step.mean_s);
    if (step.left_s && *step.left_s > 0) text += fmt::format("  {} left", clock_text(*step.left_s));
    text += '\n';
  }
  for (const TaskStatus& task : status.running) {
    const std::string percent = task.percent ? fmt::format("{:.0f} %", *task.percent) : "starts";
    text += fmt::format("runs    {}  {} on {}\n", task.task.name, percent, task.state.node);
  }
  for (const TaskStatus& task : status.failed) text += failed_text(folder, task);
  if (!status.failed.empty())
    text += "`drench farm` with the same words submits again what is missing\n";
  return text;
}

json number_or_null(const std::optional<double>& value) { return value ? json(*value) : json(); }

json json_of(const FarmStatus& status) {
  json steps = json::object(), running = json::array(), failed = json::array();
  for (const auto& [name, step] : status.steps) {
    steps[std::string(step_name(name))] = {{"done", step.done},
                                           {"frames", step.frames},
                                           {"running", step.running},
                                           {"waiting", step.waiting},
                                           {"mean_s", number_or_null(step.mean_s)},
                                           {"left_s", number_or_null(step.left_s)}};
  }
  for (const TaskStatus& task : status.running)
    running.push_back({{"name", task.task.name},
                       {"job", task.task.job},
                       {"node", task.state.node},
                       {"percent", number_or_null(task.percent)}});
  for (const TaskStatus& task : status.failed)
    failed.push_back({{"name", task.task.name},
                      {"job", task.task.job},
                      {"state", task.state.state},
                      {"reason", task.state.reason},
                      {"log", task.task.log}});
  return {{"steps", steps}, {"running", running}, {"failed", failed}};
}

}  // namespace

void farm_status(const FarmArguments& arguments) {
  const Job job = farm_job(arguments);
  FarmStatus status;
  count_frames(job, status);
  count_tasks(job, status);
  tell_time_left(job, status);
  print(arguments.shot.format == OutputFormat::json ? json_line(json_of(status))
                                                    : text_of(job.folder, status));
}

}  // namespace drench
