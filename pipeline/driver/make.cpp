#include "pipeline/driver/make.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "build_id.h"

namespace drench {

/// The makefile's recipes, beside its rules in rules.cpp: what makes a step's files.
struct Recipes {
  struct Recipe {
    Step step;
    Worker worker;
    /// @return the files that it wrote
    StageReport (Maker::*make)(int frame, const Decision& decision);
  };
  static constexpr auto all = std::to_array<Recipe>({
      {Step::mesh, Worker::mesh, &Maker::mesh},
      {Step::foam, Worker::mesh, &Maker::foam},
      {Step::render, Worker::render, &Maker::render},
      {Step::denoise, Worker::render, &Maker::denoise},
      {Step::contact_sheet, Worker::last, &Maker::contact_sheet},
      {Step::movie, Worker::last, &Maker::movie},
  });
  static const Recipe& of(Step step);
};
static_assert(Recipes::all.size() + 1 == size_t(Step::count), "each step but the simulation");

const Recipes::Recipe& Recipes::of(Step step) {
  return *std::find_if(all.begin(), all.end(),
                       [&](const Recipe& recipe) { return recipe.step == step; });
}

Worker worker_of(Step step) { return Recipes::of(step).worker; }

Maker::Maker(const Targets& targets, const std::filesystem::path& folder, Manifest& manifest,
             Stages& stages, Progress& progress, StageRunner& runner,
             std::function<bool()> stopping)
    : targets_(targets),
      folder_(folder),
      manifest_(manifest),
      stages_(stages),
      progress_(progress),
      runner_(runner),
      stopping_(std::move(stopping)),
      lookup_([this](const std::string& file) -> std::optional<KnownFile> {
        const std::optional<Record> record = manifest_.find(file);
        if (!record) return {};
        return KnownFile{*record, state_of(folder_, *record)};
      }) {}

void Maker::make(const Rule& rule, int frame) {
  manifest_.refresh();  // another driver may have made it
  const std::optional<Decision> decision = decide(rule, targets_, frame, lookup_);
  if (!decision) throw DamagedInput(fmt::format(fmt::runtime(rule.inputs_missing), frame), "");
  if (!decision->make) return progress_.not_needed(rule.step, frame);
  const StageRunner::Clock::time_point start = StageRunner::Clock::now();
  const Recipes::Recipe& recipe = Recipes::of(rule.step);
  StageReport report;
  runner_.compute_from(decision->inputs, recipe.worker,
                       [&] { report = (this->*recipe.make)(frame, *decision); });
  runner_.commit(report.files, step_name(rule.step), frame, decision->key);
  runner_.finished(rule.step, frame, start, report);
}

/// Whether the mesh of the frame before is that of this one: of the same bytes, with nothing around
/// that moves.
bool Maker::is_held(int frame) const {
  if (targets_.obstacles_move || frame == targets_.first) return false;
  const std::vector<std::string> now = simulated_files(targets_, frame),
                                 before = simulated_files(targets_, frame - 1);
  for (size_t k = 0; k < now.size(); ++k) {
    const auto file = manifest_.find(now[k]), earlier = manifest_.find(before[k]);
    if (!file || !earlier || file->digest != earlier->digest) return false;
  }
  const auto decision = decide(rule_of(Step::mesh), targets_, frame - 1, lookup_);
  return decision && !decision->make;
}

StageReport Maker::held_mesh(int frame) {
  StageReport report;
  const Rule& rule = rule_of(Step::mesh);
  const std::vector<std::string> files = rule.outputs(targets_, frame),
                                 before = rule.outputs(targets_, frame - 1);
  for (size_t k = 0; k < files.size(); ++k) {
    report.files.push_back(
        write_file_whole(folder_ / files[k], checked_bytes(folder_, manifest_, before[k])));
  }
  report.line = fmt::format("as frame {}", frame - 1);
  report.json = fmt::format("{{\"held\":{}}}", frame - 1);
  return report;
}

StageReport Maker::mesh(int frame, const Decision&) {
  return is_held(frame) ? held_mesh(frame) : stages_.mesh(folder_, frame);
}

StageReport Maker::foam(int frame, const Decision&) { return stages_.foam(folder_, frame); }

StageReport Maker::render(int frame, const Decision& decision) {
  // Only what the key covers: equal inputs give equal files.
  Attributes attributes{{"shot", targets_.shot},
                        {"frame", std::to_string(frame)},
                        {"version", std::string(build_id::version)},
                        {"key.render", decision.key.digest.hex()}};
  for (const InputFile& file : decision.inputs) {
    if (const auto record = manifest_.find(file.name))
      attributes.emplace_back(fmt::format("key.{}", file.name), record->digest.hex());
  }
  return stages_.render(folder_, frame, attributes, [&](double finished) {
    if (stopping_()) throw Stopped("stopped while rendering");
    progress_.share(Step::render, frame, finished);
  });
}

StageReport Maker::denoise(int frame, const Decision& decision) {
  NoisyFiles noisy;
  Attributes attributes{{"key.denoise", decision.key.digest.hex()}};
  for (const InputFile& file : decision.inputs) {
    if (file.frame == frame) noisy.frame = file.name;
    if (file.frame < frame) noisy.before.push_back(file.name);
    if (file.frame > frame) noisy.after.push_back(file.name);
    if (const auto record = manifest_.find(file.name))
      attributes.emplace_back(fmt::format("key.noisy.{}", file.frame), record->digest.hex());
  }
  return stages_.denoise(folder_, frame, noisy, attributes);
}

StageReport Maker::contact_sheet(int, const Decision&) {
  return stages_.contact_sheet(folder_, targets_.frames);
}

StageReport Maker::movie(int, const Decision&) {
  return stages_.movie(folder_, targets_.frames, [this] { return !stopping_(); });
}

}  // namespace drench
