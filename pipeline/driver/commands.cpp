#include "pipeline/driver/commands.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>

#include "build_id.h"
#include "pipeline/contract/error.h"
#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/printable.h"
#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/driver/disk.h"
#include "pipeline/driver/early_checks.h"
#include "pipeline/driver/execute.h"
#include "pipeline/driver/inputs.h"
#include "pipeline/driver/job.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/plan_text.h"
#include "pipeline/driver/process.h"
#include "pipeline/driver/scene_text.h"
#include "pipeline/driver/shell_word.h"
#include "pipeline/driver/standard_output.h"
#include "pipeline/driver/stats_file.h"
#include "render/bsdf/material.h"
#include "sim/probe_series.h"
#include "sim/setup/scene.h"

namespace drench {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

void report_beyond(const Plan& plan, const ShotArguments& arguments) {
  if (plan.beyond.empty()) return;
  log_info("driver",
           fmt::format("{} files belong to frames or sheets the shot no longer has, the first is "
                       "{}; `drench clean {}` removes them",
                       plan.beyond.size(), plan.beyond.front(), arguments.shot.string()));
}

/// shot.lock.toml: the resolved shot, kept with what was made from it.
void write_shot_lock(const Job& job, Manifest& manifest) {
  const std::string text = shot_lock(job.shot);
  const Digest digest = hash_bytes(text.data(), text.size());
  const std::string file(layout::shot_lock);
  const std::optional<Record> before = manifest.find(file);
  if (before && before->digest == digest && has_recorded_digest(job.folder, *before)) return;
  Record record = record_of_file(job.folder, write_file_whole(job.folder / file, text));
  record.step = shot_record;
  record.key = digest;
  manifest.add(record);
}

[[noreturn]] void abandon() {
  log_info("driver", "stopped while a frame was in work; it is made again next time");
  constexpr int stopped_exit_code = 75;
  ::_exit(stopped_exit_code);
}

struct Counts {
  int ran = 0, skipped = 0;
};

Counts count_of(const Plan& plan) {
  Counts counts;
  for (const Task& task : plan.tasks) ++(task.action == Action::skip ? counts.skipped : counts.ran);
  return counts;
}

std::vector<std::string> warning_texts() {
  std::vector<std::string> texts;
  for (const LoggedWarning& warning : logged_warnings()) texts.push_back(warning.text);
  return texts;
}

/// Says all warnings once more, as the last lines of a run, and keeps them with its times.
void repeat_warnings(const fs::path& folder) {
  const std::vector<LoggedWarning> warnings = logged_warnings();
  if (warnings.empty()) return;
  StatsFile stats(folder / layout::stats);
  log_info("driver", fmt::format("{} warning{}:", warnings.size(), warnings.size() > 1 ? "s" : ""));
  for (const LoggedWarning& warning : warnings) {
    const std::string times =
        warning.times > 1 ? fmt::format(" ({} times)", warning.times) : std::string();
    log_info(warning.part, fmt::format("warning: {}{}", warning.text, times));
    stats.add(
        "warning",
        json{{"part", warning.part}, {"text", warning.text}, {"times", warning.times}}.dump());
  }
}

void report_done(const Job& job, const ShotArguments& arguments, const Plan& first) {
  const bool nothing = first.nothing_to_do();
  const Counts counts = count_of(first);
  if (arguments.format == OutputFormat::json) {
    print(json_line({{"shot", job.shot.name},
                     {"folder", job.folder.string()},
                     {"frames", job.targets.frames},
                     {"nothing_to_do", nothing},
                     {"planned", nothing ? 0 : counts.ran},
                     {"skipped", counts.skipped},
                     {"warnings", logged_warnings().size()},
                     {"warning", warning_texts()}}));
  }
  if (nothing) {
    log_info("driver", fmt::format("nothing to do: all {} steps of {} are up to date",
                                   counts.skipped, job.folder.string()));
  } else {
    log_info("driver",
             fmt::format("done: {} frames in {}", job.targets.frames.size(), job.folder.string()));
  }
}

ExecuteOptions execute_options(const ShotArguments& arguments) {
  ExecuteOptions options;
  options.threads = arguments.threads;
  options.memory_gib = arguments.memory_gib;
  options.retry = arguments.retry;
  options.stop_requested = [] { return stop_requested(); };
  options.abandon = abandon;
  return options;
}

std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name"))
      return line.substr(std::min(line.size(), line.find(':') + 2));
  return "unknown";
}

/// What made the rows that follow in stats.jsonl, and how to make them again.
void record_run(const Job& job, const ShotArguments& arguments) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  const int threads =
      arguments.threads > 0 ? arguments.threads : tbb::this_task_arena::max_concurrency();
  StatsFile(job.folder / layout::stats)
      .add("run", json{{"started", fmt::format("{:%FT%TZ}", utc)},
                       {"command", arguments.command},
                       {"shot", fs::absolute(arguments.shot).string()},
                       {"host", host_name()},
                       {"cpu", processor_name()},
                       {"threads", threads},
                       {"version", build_id::version}}
                      .dump(-1, ' ', false, json::error_handler_t::replace));
}

void warn_of_small_disk(const Job& job, const Plan& plan, const Manifest& manifest) {
  const DiskEstimate estimate = disk_estimate(plan, job.targets, manifest.records());
  const double free = free_disk(job.folder);
  if (estimate.bytes <= free) return;
  log_warning("driver", fmt::format("{}: {}; free space or choose another output folder",
                                    job.folder.string(), disk_text(estimate, free)));
}

/// Plans and executes until nothing is left; a damaged input found on the way is planned again.
Plan make_all(const Job& job, const ShotArguments& arguments, Manifest& manifest) {
  Progress progress(arguments.quiet ? ProgressStyle::quiet : progress_style(), arguments.openjd);
  const std::unique_ptr<Stages> stages =
      shot_stages(job.shot, {arguments.device, arguments.memory_gib, arguments.progressive});
  Retries retries(job.folder, manifest);
  for (int attempt = 1;; ++attempt) {
    const Plan plan = plan_of(job, manifest);
    if (retries.drop_damaged_inputs(job.targets, plan)) continue;
    refuse_problems(job, plan);
    if (attempt == 1) report_beyond(plan, arguments);
    if (attempt == 1) check_early(job, plan, arguments.memory_gib);
    write_shot_lock(job, manifest);
    if (plan.nothing_to_do()) return plan;
    if (attempt == 1) {
      warn_of_small_disk(job, plan, manifest);
      warn_of_another_shot(job);
      record_run(job, arguments);
    }
    try {
      const GracefulStop graceful;
      execute(job.targets, plan, job.folder, manifest, *stages, progress,
              execute_options(arguments));
      return plan;
    } catch (const DamagedInput& found) {
      log_warning("driver", fmt::format("{}; it is made again", found.what()));
      retries.count(found);
    }
  }
}

/// Opens the manifest for a run, without the lines of it that are damaged.
void open_without_damage(Manifest& manifest, const fs::path& folder, bool alone) {
  if (!alone)
    manifest.open_for_append();  // cuts off what another was killed in, not what it writes
  if (const int damaged = manifest.damaged_lines(); damaged > 0) {
    log_warning("driver", fmt::format("{}: {} damaged lines dropped; what they named is checked or "
                                      "made again",
                                      (folder / layout::manifest).string(), damaged));
    if (alone) manifest.rewrite();
  }
  if (alone) manifest.open_for_append();
}

}  // namespace

void make_command(const ShotArguments& arguments, const std::vector<Step>& steps) {
  std::optional<tbb::global_control> limit;
  if (arguments.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, size_t(arguments.threads));
  }
  const ArithmeticMode mode;
  const Job job = job_of(arguments, steps);
  const FolderLock lock(job.folder, arguments.shared ? LockKind::shared : LockKind::exclusive);
  std::optional<SimulationLock> simulation_lock;
  if (arguments.shared && job.targets.includes(Step::simulate)) simulation_lock.emplace(job.folder);
  Manifest manifest(job.folder / layout::manifest);
  open_without_damage(manifest, job.folder, !arguments.shared);
  try {
    if (arguments.verify) drop_all_damaged(job.folder, manifest);
    const Plan plan = make_all(job, arguments, manifest);
    report_done(job, arguments, plan);
  } catch (...) {
    try {
      repeat_warnings(job.folder);
    } catch (const Error&) {  // a full disk again: what came first is what is wrong
    }
    throw;
  }
  repeat_warnings(job.folder);
}

void plan_command(const ShotArguments& arguments) {
  const Job job = job_of(arguments, all_steps());
  const Manifest manifest(job.folder / layout::manifest);
  Plan plan = plan_of(job, manifest);
  for (const std::string& warning : plan.warnings) log_warning("driver", warning);
  check_early(job, plan, arguments.memory_gib);
  const DiskEstimate disk = disk_estimate(plan, job.targets, manifest.records());
  const double free = free_disk(job.folder);
  std::string text = plan_text(plan);
  if (const std::string line = disk_text(disk, free); !line.empty()) text += line + "\n";
  std::map<std::string, std::string> more{
      {"disk", json_line({{"needed_bytes", disk.bytes}, {"free_bytes", free}})}};
  if (plan.simulation.needed) {
    const sim::Scene scene = sim::build_scene(job.shot, level_sets_within(arguments.memory_gib));
    const sim::ProbeSeries probes(job.shot, scene);  // finds those that can never read
    for (const std::string& warning : sim::warnings_of(scene.report)) log_warning("sim", warning);
    text += scene_text(scene.report);
    more["scene"] = json_line(scene_json(scene.report));
  }
  if (plan.simulation.needed || renders(plan)) check_obstacle_meshes(job.shot);
  if (renders(plan))
    render::check_pictures(job.shot, render::PictureMemory::within(arguments.memory_gib));
  plan.warnings = warning_texts();
  if (arguments.format == OutputFormat::json) return write_plan_json(plan, more, print);
  print(printable(text, Lines::many));
}

void clean_command(const ShotArguments& arguments) {
  const Job job = job_of(arguments, {});  // makes nothing, so that nothing needs to be installed
  if (!fs::exists(job.folder / layout::manifest)) {
    throw Error(
        fmt::format("{}: holds no manifest; nothing was made here. Give the --out or "
                    "--quality it was made with",
                    job.folder.string()));
  }
  const FolderLock lock(job.folder);
  Manifest manifest(job.folder / layout::manifest);
  manifest.open_for_append();
  const Plan plan = plan_of(job, manifest);
  for (const std::string& file : plan.beyond) {
    manifest.drop(file);
    std::error_code code;
    fs::remove(job.folder / file, code);
    if (code) {
      throw Error(fmt::format("{}: cannot be removed: {}", (job.folder / file).string(),
                              system_reason(code.value())));
    }
  }
  remove_frames_in_work(job.folder);
  if (arguments.format == OutputFormat::json) print(json_line({{"removed", plan.beyond}}));
  log_info("driver", fmt::format("removed {} files", plan.beyond.size()));
}

void init_command(const fs::path& name, InitialShot kind) {
  fs::path file = name;
  if (file.extension() != ".toml") file += ".toml";
  if (file.stem().empty()) throw Error(fmt::format("'{}': names no shot", name.string()));
  if (fs::exists(file)) {
    throw Error(fmt::format("{}: exists already; it was left as it is. Choose another name",
                            file.string()));
  }
  const std::string shot = file.stem().string();
  write_file_whole(file,
                   kind == InitialShot::reference ? reference_shot(shot) : starting_shot(shot));
  log_info("driver", fmt::format("wrote {}; `drench run {}` makes its frames", file.string(),
                                 shell_word(file.string())));
}

}  // namespace drench
