#include "pipeline/driver/farm/farm.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"
#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/driver/farm/farm_graph.h"
#include "pipeline/driver/farm/farm_record.h"
#include "pipeline/driver/farm/measured.h"
#include "pipeline/driver/farm/openjd.h"
#include "pipeline/driver/farm/slurm.h"
#include "pipeline/driver/file_lock.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/shell_word.h"
#include "pipeline/driver/standard_output.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

constexpr double least_task_s = 60;  // shorter ones are mostly start and end
constexpr int chunk_unmeasured = 4, most_chunk = 50;

/// Of an array; an element of it makes the frames of its number.
constexpr std::string_view task_script = R"END(#!/bin/bash
# {step} of {shot}: `drench farm` wrote it.
frames_of=({frames} )
logs=({logs} )
frames=${{frames_of[$SLURM_ARRAY_TASK_ID]}}
exec >> "${{logs[$SLURM_ARRAY_TASK_ID]}}" 2>&1
printf '%s: job %s on %s, start %s\n' "$(date -u +%FT%TZ)" "$SLURM_JOB_ID" "$(hostname)" \
  "$((${{SLURM_RESTART_COUNT:-0}} + 1))"
{command} &
task=$!
trap 'kill -TERM "$task"' USR1  # the time is nearly up
trap : TERM                     # the task gets that itself
while kill -0 "$task" 2> /dev/null; do wait "$task"; done
wait "$task"
code=$?
# 75: stopped, with what it had kept. Another turn, unless somebody ended it.
tries={retry}
if ((code == 75)); then tries=50; fi
if ((code != 0 && ${{SLURM_RESTART_COUNT:-0}} < tries)) &&
  [[ $(scontrol show job --oneliner "$SLURM_JOB_ID") == *JobState=RUNNING* ]]; then
  scontrol requeue "$SLURM_JOB_ID" && sleep 60
fi
exit "$code"
)END";

std::string log_name(Step step, const FarmTask& task) { return task_name(step, task) + ".log"; }

/// Jobs of the folder that Slurm still has, by log.
struct Queued {
  std::map<std::string, std::string> active;  // wait or run
  std::vector<std::string> stranded;          // held, by a submission that did not come to its end
};

/// Slurm may have given a number to another's job since: the name decides. One that was not let go
/// yet has the name of its array, which its own begins with.
Queued queued_jobs(const fs::path& folder) {
  Queued queued;
  const std::map<std::string, SubmittedTask> submitted = submitted_tasks(folder);
  if (submitted.empty()) return queued;
  const std::map<std::string, slurm::State> queue = slurm::queue();
  for (const auto& [log, task] : submitted) {
    const auto found = queue.find(task.job);
    if (found == queue.end() || task.name.find(found->second.name) != 0) continue;
    if (found->second.is_held()) {
      queued.stranded.push_back(task.job);
    } else if (found->second.is_active()) {
      queued.active[log] = task.job;
    }
  }
  return queued;
}

/// The shot as it is now: whoever edits the file while tasks wait does not change them.
fs::path keep_shot(const Job& job) {
  const std::string text = shot_lock(job.shot);
  const Digest digest = hash_bytes(text.data(), text.size());
  const fs::path file =
      job.folder / layout::farm / fmt::format("shot.{}.toml", digest.hex().substr(0, 12));
  write_file_whole(file, text);
  return file;
}

/// Puts a graph on the farm.
class Submission {
 public:
  Submission(const FarmArguments& arguments, const Job& job,
             const std::map<Step, Measured>& measured)
      : arguments_(arguments),
        job_(job),
        measured_(measured),
        queued_(queued_jobs(job.folder)),
        shot_(keep_shot(job)) {
    slurm::cancel(queued_.stranded);
  }
  /// Cancels what was not let go.
  ~Submission();
  Submission(const Submission&) = delete;
  Submission& operator=(const Submission&) = delete;

  /// @return tasks submitted: those that are not in the queue already.
  size_t submit(const FarmGraph& graph);

 private:
  using Numbers = std::vector<int>;  // of a stage's tasks
  void submit_stage(const FarmStage& stage);
  void submit_array(const FarmStage& stage, const Numbers& tasks);
  std::vector<std::string> jobs_before(const FarmTask& task) const;
  std::vector<std::string> arrays() const;
  std::vector<std::string> options(Step step) const;
  std::string script(const FarmStage& stage, const Numbers& tasks) const;

  const FarmArguments& arguments_;
  const Job& job_;
  const std::map<Step, Measured>& measured_;
  const Queued queued_;
  const fs::path shot_;
  std::map<std::pair<Step, int>, std::string> jobs_;  // of the graph's tasks
  std::vector<slurm::Element> elements_;
  std::map<std::string, size_t> arrays_;  // elements of those that were submitted
  bool released_ = false;
};

Submission::~Submission() {
  if (released_) return;
  try {
    slurm::cancel(arrays());
  } catch (const Error& error) {
    log_info("farm", error.what());
  }
}

std::vector<std::string> Submission::arrays() const {
  std::vector<std::string> numbers;
  for (const auto& [array, size] : arrays_) numbers.push_back(array);
  return numbers;
}

std::vector<std::string> Submission::options(Step step) const {
  std::vector<std::string> options{
      fmt::format("--cpus-per-task={}", arguments_.cores),
      "--chdir=" + fs::absolute(job_.folder / layout::farm_logs).string(), "--output=slurm.log",
      "--signal=B:USR1@60"};
  const auto measured = measured_.find(step);
  double memory = arguments_.shot.memory_gib * double(1 << 30);
  if (memory == 0 && measured != measured_.end())
    memory = memory_margin * measured->second.peak_memory;
  if (memory > 0) options.push_back(fmt::format("--mem={:.0f}M", std::ceil(memory / (1 << 20))));
  if (step == Step::simulate && arguments_.shot.device == Device::cuda)
    options.emplace_back("--gres=gpu:1");
  options.insert(options.end(), arguments_.sbatch.begin(), arguments_.sbatch.end());
  return options;
}

std::string Submission::script(const FarmStage& stage, const Numbers& tasks) const {
  std::string frames, logs;
  for (const int k : tasks) {
    frames += fmt::format(" {}", task_frames(stage.tasks[size_t(k)]));
    logs += fmt::format(" {}", log_name(stage.step, stage.tasks[size_t(k)]));
  }
  std::string command = fmt::format(
      "{} run {} --out {} --steps {} --frames \"$frames\" --shared --openjd --device {} "
      "--threads \"${{SLURM_CPUS_PER_TASK:-1}}\"",
      shell_word(fs::read_symlink("/proc/self/exe").string()),
      shell_word(fs::absolute(shot_).string()), shell_word(fs::absolute(job_.folder).string()),
      step_word(stage.step), arguments_.shot.device == Device::cuda ? "cuda" : "cpu");
  if (arguments_.shot.memory_gib > 0)
    command += fmt::format(" --memory {}", arguments_.shot.memory_gib);
  return fmt::format(task_script, fmt::arg("step", step_word(stage.step)),
                     fmt::arg("shot", slurm::plain_name(job_.shot.name)),
                     fmt::arg("frames", frames), fmt::arg("logs", logs),
                     fmt::arg("command", command), fmt::arg("retry", arguments_.retry));
}

/// Jobs that a task waits for; of an array of which it waits for all, the array.
std::vector<std::string> Submission::jobs_before(const FarmTask& task) const {
  std::map<std::string, std::vector<std::string>> by_array;
  for (const FarmTask::Before& before : task.before) {
    const std::string& job = jobs_.at({before.step, before.task});
    by_array[job.substr(0, job.find('_'))].push_back(job);
  }
  std::vector<std::string> after;
  for (auto& [array, jobs] : by_array) {
    const auto size = arrays_.find(array);
    if (size != arrays_.end() && size->second == jobs.size()) jobs = {array};
    after.insert(after.end(), jobs.begin(), jobs.end());
  }
  return after;
}

void Submission::submit_array(const FarmStage& stage, const Numbers& tasks) {
  const std::string shot = slurm::plain_name(job_.shot.name);
  const std::string array = slurm::submit_held({.name = shot + "." + step_word(stage.step),
                                                .count = int(tasks.size()),
                                                .options = options(stage.step),
                                                .script = script(stage, tasks)});
  arrays_[array] = tasks.size();
  std::vector<SubmittedTask> submitted;
  for (size_t k = 0; k < tasks.size(); ++k) {
    const FarmTask& task = stage.tasks[size_t(tasks[k])];
    slurm::Element element{fmt::format("{}_{}", array, k),
                           fmt::format("{}.{}", shot, task_name(stage.step, task)),
                           jobs_before(task)};
    jobs_[{stage.step, tasks[k]}] = element.job;
    submitted.push_back(
        {stage.step, task_frames(task), element.job, element.name, log_name(stage.step, task)});
    elements_.push_back(std::move(element));
  }
  add_submitted_tasks(job_.folder, submitted);
}

void Submission::submit_stage(const FarmStage& stage) {
  Numbers tasks;
  for (size_t k = 0; k < stage.tasks.size(); ++k) {
    const auto active = queued_.active.find(log_name(stage.step, stage.tasks[k]));
    if (active != queued_.active.end()) {
      jobs_[{stage.step, int(k)}] = active->second;
    } else {
      tasks.push_back(int(k));
    }
  }
  for (size_t begin = 0; begin < tasks.size(); begin += slurm::most_elements) {
    const size_t end = std::min(tasks.size(), begin + slurm::most_elements);
    submit_array(stage, {tasks.begin() + ptrdiff_t(begin), tasks.begin() + ptrdiff_t(end)});
  }
}

size_t Submission::submit(const FarmGraph& graph) {
  for (const FarmStage& stage : graph.stages) submit_stage(stage);
  slurm::release(elements_, arrays());
  released_ = true;
  return elements_.size();
}

/// Frames a task, so that none is mostly start and end.
int chunk_of(const FarmArguments& arguments, const std::map<Step, Measured>& measured) {
  if (arguments.chunk > 0) return arguments.chunk;
  double slowest = 0;
  for (const auto& [step, of] : measured)
    if (is_per_frame(step)) slowest = std::max(slowest, of.mean_s);
  if (slowest == 0) return chunk_unmeasured;
  return std::clamp(int(std::ceil(least_task_s / slowest)), 1, most_chunk);
}

/// Two that submit at once would submit everything twice.
void take(LockFile& lock, const fs::path& folder) {
  if (lock.try_take(LockKind::exclusive)) return;
  throw Error(fmt::format("{}: {} is submitting this shot; wait until it has ended",
                          folder.string(), lock.holder()));
}

}  // namespace

Job farm_job(const FarmArguments& arguments) {
  ShotArguments shot = arguments.shot;
  if (shot.device == Device::automatic) shot.device = Device::cpu;
  return job_of(shot, all_steps());
}

void farm_submit(const FarmArguments& arguments) {
  const Job job = farm_job(arguments);
  fs::create_directories(job.folder / layout::farm_logs);
  LockFile lock(job.folder / layout::farm_lock);
  take(lock, job.folder);
  const Plan plan = plan_of(job, Manifest(job.folder / layout::manifest));
  refuse_problems(job, plan);
  if (plan.nothing_to_do()) {
    return log_info(
        "farm", fmt::format("nothing to do: all steps of {} are up to date", job.folder.string()));
  }
  const std::map<Step, Measured> measured = measured_steps(job.folder / layout::stats);
  const int chunk = chunk_of(arguments, measured);
  const FarmGraph graph = farm_graph(job.targets, plan, chunk);
  Submission submission(arguments, job, measured);
  const size_t count = submission.submit(graph);
  log_info("farm",
           fmt::format("{} tasks of up to {} frames submitted, {} were in the queue; `drench farm "
                       "{} --status` tells how far they are",
                       count, chunk, graph.task_count() - count, arguments.shot.shot.string()));
}

void farm_template(const FarmArguments& arguments) {
  const Job job = farm_job(arguments);
  const std::map<Step, Measured> measured = measured_steps(job.folder / layout::stats);
  const int least = int((job.targets.frames.size() + openjd_most_tasks - 1) / openjd_most_tasks);
  const Plan everything = make_plan(job.targets, {}, job.shot.timeline.last);
  const FarmGraph graph =
      farm_graph(job.targets, everything, std::max(least, chunk_of(arguments, measured)));
  print(openjd_template(graph, {.name = job.shot.name,
                                .program = fs::read_symlink("/proc/self/exe"),
                                .shot = fs::absolute(keep_shot(job)),
                                .folder = fs::absolute(job.folder),
                                .cuda = arguments.shot.device == Device::cuda,
                                .cores = arguments.cores,
                                .measured = measured}));
}

void farm_cancel(const FarmArguments& arguments) {
  const Job job = farm_job(arguments);
  const Queued queued = queued_jobs(job.folder);
  std::vector<std::string> jobs = queued.stranded;
  for (const auto& [log, id] : queued.active) jobs.push_back(id);
  slurm::cancel(jobs);
  log_info("farm", fmt::format("{} tasks cancelled; what is made stays", jobs.size()));
}

}  // namespace drench
