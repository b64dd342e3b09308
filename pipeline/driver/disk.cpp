#include "pipeline/driver/disk.h"

#include <fmt/format.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "pipeline/driver/rules.h"

namespace drench {

namespace {

std::string size_text(double bytes) {
  if (bytes >= 1e9) return fmt::format("{:.3g} GB", bytes / 1e9);
  return fmt::format("{:.3g} MB", bytes / 1e6);
}

}  // namespace

std::map<std::string, DiskUse> disk_use(const std::map<std::string, Record>& records) {
  std::map<std::pair<std::string, int>, double> frames;
  for (const auto& [file, record] : records)
    frames[{record.step, record.frame}] += double(record.size);
  std::map<std::string, DiskUse> use;
  for (const auto& [frame, bytes] : frames) {
    DiskUse& of = use[frame.first];
    ++of.frames;
    of.mean += (bytes - of.mean) / of.frames;
    of.most = std::max(of.most, bytes);
  }
  return use;
}

DiskEstimate disk_estimate(const Plan& plan, const Targets& targets,
                           const std::map<std::string, Record>& records) {
  const std::map<std::string, DiskUse> use = disk_use(records);
  std::set<std::pair<std::string, int>> there;
  for (const auto& [file, record] : records) there.insert({record.step, record.frame});
  DiskEstimate estimate;
  for (const Task& task : plan.tasks) {
    const std::string name(step_name(task.step));
    if (task.action == Action::skip || there.contains({name, task.frame})) continue;
    const bool has_files = task.step == Step::simulate
                               ? !simulated_files(targets, task.frame).empty()
                               : !rule_of(task.step).outputs(targets, task.frame).empty();
    if (!has_files) continue;
    const auto found = use.find(name);
    if (found != use.end()) {
      estimate.bytes += found->second.mean;
    } else if (is_per_frame(task.step) &&
               std::find(estimate.unknown.begin(), estimate.unknown.end(), task.step) ==
                   estimate.unknown.end()) {
      estimate.unknown.push_back(task.step);
    }
  }
  return estimate;
}

double disk_reserve(const std::map<std::string, Record>& records) {
  double bytes = 0;
  for (const auto& [step, use] : disk_use(records)) bytes += use.most;
  constexpr double least = 4 << 20;
  return std::max(least, 2 * bytes);
}

double free_disk(const std::filesystem::path& folder) {
  struct statvfs status {};
  std::error_code code;
  std::filesystem::path there = std::filesystem::absolute(folder);
  while (!std::filesystem::exists(there, code) && there.has_relative_path())
    there = there.parent_path();
  if (::statvfs(there.c_str(), &status) != 0 || status.f_blocks == 0)
    return std::numeric_limits<double>::infinity();
  return double(status.f_bavail) * double(status.f_frsize);
}

std::string disk_text(const DiskEstimate& estimate, double free) {
  if (estimate.bytes == 0 || !std::isfinite(free)) return {};
  std::string text = fmt::format("about {} of disk are needed, {} are free",
                                 size_text(estimate.bytes), size_text(free));
  for (const Step step : estimate.unknown)
    text += fmt::format("{} {}", step == estimate.unknown.front() ? "; not counted:" : ",",
                        step_name(step));
  return text;
}

}  // namespace drench
