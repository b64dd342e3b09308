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
  throw PlanAgain(fmt::format("{} is missing or damaged", file), file);
}

/// What a task reads, whether it lies there or not.
std::vector<std::string> read_by(const Wanted& wanted, const Task& task) {
  switch (task.step) {
    case Step::simulate:
      return {};
    case Step::mesh:
      return simulated_files(wanted, task.frame);
    case Step::foam:
      return foam_inputs(wanted, task.frame);
    case Step::render:
      return render_inputs(wanted, task.frame);
    case Step::denoise: {
      std::vector<std::string> files;
      for (int k = -wanted.denoise_frames; k <= wanted.denoise_frames; ++k)
        files.push_back(layout::noisy(wanted.shot, task.frame + k));
      return files;
    }
    case Step::contact_sheet:
    case Step::movie: {
      std::vector<std::string> files;
      for (const int frame : wanted.frames) files.push_back(layout::image(wanted.shot, frame));
      return files;
    }
  }
  return {};
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
                     const std::vector<std::string>& files,
                     const std::function<std::string(const fs::path&)>& why_unreadable) {
  for (const std::string& file : files) {
    const std::string why = why_unreadable(folder / file);
    if (why.empty()) continue;
    manifest.drop(file);
    throw PlanAgain(fmt::format("{} is what was recorded, but cannot be read: {}", file, why),
                    file);
  }
}

std::vector<std::string> inputs_of(const Wanted& wanted, const Plan& plan,
                                   const Manifest& manifest) {
  std::set<std::string> files;
  const auto add = [&](const std::string& file) {
    if (manifest.find(file)) files.insert(file);
  };
  for (const Task& task : plan.tasks) {
    if (task.action == Action::skip) continue;
    for (const std::string& file : read_by(wanted, task)) add(file);
  }
  if (plan.simulation.needed) {
    for (const auto& [file, record] : manifest.records())
      if (record.step == checkpoint_step) files.insert(file);
  }
  return {files.begin(), files.end()};
}

void Again::found(const PlanAgain& found) {
  const int times = ++found_[found.file];
  if (times < (found.file.empty() ? most_finds_without_file : most_finds)) return;
  throw Error(
      fmt::format("{}: {}, though it was made again; check the disk, and whether another "
                  "program writes there",
                  folder_.string(), found.what()));
}

bool Again::drops_inputs_of(const Wanted& wanted, const Plan& plan) {
  if (found_.empty()) return false;
  bool any = false;
  for (const std::string& file : inputs_of(wanted, plan, manifest_)) {
    if (!hashed_.insert(file).second) continue;
    const std::optional<Record> record = manifest_.find(file);
    if (!record || state_by_digest(folder_, *record) != FileState::changed) continue;
    manifest_.drop(file);
    log_warning("driver",
                fmt::format("{} is damaged; {}", file,
                            record && record->step == checkpoint_step ? "the run does without"
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
    if (record.step == checkpoint_step) {
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
