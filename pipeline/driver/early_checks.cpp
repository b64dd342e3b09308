#include "pipeline/driver/early_checks.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/shot_check.h"
#include "pipeline/contract/shot/unit_check.h"
#include "pipeline/contract/shot/view_check.h"
#include "pipeline/driver/json_lines.h"
#include "pipeline/driver/layout.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

constexpr double gib = double(1 << 30);

void check_memory(const Shot& shot, double memory_gib) {
  constexpr double least = 165;  // bytes a particle, of the plainest fluid (docs/benchmarks)
  const double count = particles_at_start(shot), needed = count * least,
               machine = double(::sysconf(_SC_PHYS_PAGES)) * double(::sysconf(_SC_PAGESIZE)),
               there = memory_gib > 0 ? memory_gib * gib : machine;
  if (needed <= there) return;
  throw Error(fmt::format(
      "{}: fluid.spacing is {:g} m, so that the shot starts with about {:.2g} particles, which "
      "take "
      "{:.3g} GiB at least, and {} {:.3g}. Use a spacing of {:.2g} m or more, or less fluid",
      shot.file.string(), shot.fluid.spacing, count, needed / gib,
      memory_gib > 0 ? "--memory is" : "this machine has", there / gib,
      1.01 * shot.fluid.spacing * std::cbrt(needed / there)));
}

bool lies_in(const fs::path& file, const fs::path& folder) {
  const fs::path relative = fs::absolute(file).lexically_relative(fs::absolute(folder));
  return !relative.empty() && *relative.begin() != "..";
}

}  // namespace

bool renders(const Plan& plan) {
  return std::any_of(plan.tasks.begin(), plan.tasks.end(), [](const Task& task) {
    return task.step == Step::render && task.action != Action::skip;
  });
}

void check_early(const Job& job, const Plan& plan, double memory_gib) {
  const int last = job.targets.frames.back(), end = job.shot.timeline.last;
  if (last > end && !plan.nothing_to_do())
    log_warning("driver",
                fmt::format("--frames goes on to {}, beyond the shot's last frame {}", last, end));
  if (plan.simulation.needed || renders(plan)) warn_of_units(job.shot);
  if (plan.simulation.needed) check_memory(job.shot, memory_gib);
  if (renders(plan)) warn_of_empty_pictures(job.shot);
}

void warn_of_another_shot(const Job& job) {
  fs::path before;
  for (const nlohmann::json& line : read_json_lines(job.folder / layout::stats))
    if (line.contains("shot") && line["shot"].is_string()) before = line["shot"].get<std::string>();
  std::error_code code;
  const fs::path& now = job.shot.file;
  // A farm works by copies within the folder.
  if (before.empty() || lies_in(before, job.folder) || lies_in(now, job.folder) ||
      !fs::exists(before, code) || fs::equivalent(before, now, code) || code)
    return;
  log_warning("driver",
              fmt::format("{}: holds frames of {}, which are made again where {} differs. "
                          "If both are wanted, give one its own shot.name or --out",
                          job.folder.string(), before.string(), now.string()));
}

}  // namespace drench
