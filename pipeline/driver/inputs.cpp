#include "pipeline/driver/inputs.h"

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"
#include "pipeline/driver/layout.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

constexpr int most_finds = 3;               // of one file in one run
constexpr int most_finds_without_file = 5;  // of files that change beside the run

[[noreturn]] void drop(Manifest& manifest, const std::string& file) {
  manifest.drop(file);
  throw DamagedInput(fmt::format("{} is missing or damaged", file), file);
}

/// Recorded files that the tasks of a plan read.
std::vector<std::string> recorded_inputs(const Targets& targets, const Plan& plan,
                                         const Manifest& manifest) {
  std::set<std::string> files;
  const auto add = [&](const std::string& file) {
    if (manifest.find(file)) files.insert(file);
  };
  for (const Task& task : plan.tasks) {
    if (task.action == Action::skip || task.step == Step::simulate) continue;
    for (const std::string& file : possible_inputs(rule_of(task.step), targets, task.frame))
      add(file);
  }
  if (plan.simulation.needed) {
    for (const auto& [file, record] : manifest.records())
      if (record.step == checkpoint_record) files.insert(file);
  }
  return {files.begin(), files.end()};
}

}  // namespace

void check_input(const fs::path& folder, Manifest& manifest, const std::string& file) {
  const std::optional<Record> record = manifest.find(file);
  if (!record || state_by_digest(folder, *record) != FileState::intact) drop(manifest, file);
}

std::string checked_bytes(const fs::path& folder, Manifest& manifest, const std::string& file) {
  check_input(folder, manifest, file);
  std::string bytes = read_text(folder / file, uint64_t(1) << 36);
  // What is handed on are these bytes, not those that were checked a moment ago.
  const std::optional<Record> record = manifest.find(file);
  if (!record || hash_bytes(bytes.data(), bytes.size()) != record->digest) drop(manifest, file);
  return bytes;
}

void drop_unreadable(const fs::path& folder, Manifest& manifest,
                     const std::vector<InputFile>& files,
                     const std::function<std::string(const fs::path&)>& why_unreadable) {
  for (const auto& [file, frame] : files) {
    const std::string why = why_unreadable(folder / file);
    if (why.empty()) continue;
    manifest.drop(file);
    throw DamagedInput(fmt::format("{} is what was recorded, but cannot be read: {}", file, why),
                       file);
  }
}

void Retries::count(const DamagedInput& found) {
  const int times = ++found_[found.file];
  if (times < (found.file.empty() ? most_finds_without_file : most_finds)) return;
  throw Error(
      fmt::format("{}: {}, though it was made again; check the disk, and whether another "
                  "program writes there",
                  folder_.string(), found.what()));
}

bool Retries::drop_damaged_inputs(const Targets& targets, const Plan& plan) {
  if (found_.empty()) return false;
  bool any = false;
  for (const std::string& file : recorded_inputs(targets, plan, manifest_)) {
    if (!hashed_.insert(file).second) continue;
    const std::optional<Record> record = manifest_.find(file);
    if (!record || state_by_digest(folder_, *record) != FileState::changed) continue;
    manifest_.drop(file);
    log_warning("driver",
                fmt::format("{} is damaged; {}", file,
                            record && record->step == checkpoint_record ? "the run does without"
                                                                        : "it is made again"));
    any = true;
  }
  return any;
}

int drop_all_damaged(const fs::path& folder, Manifest& manifest) {
  int dropped = 0;
  for (const auto& [file, record] : manifest.records()) {
    if (state_by_digest(folder, record) == FileState::intact) continue;
    manifest.drop(file);
    ++dropped;
    if (record.step == checkpoint_record) {
      std::error_code code;
      fs::remove(folder / file, code);
      log_warning("driver", fmt::format("{} is missing or damaged; the run does without", file));
    } else {
      log_warning("driver", fmt::format("{} is missing or damaged; it is made again if the shot "
                                        "still has it",
                                        file));
    }
  }
  return dropped;
}

}  // namespace drench
