#include "tests/driver/toy_shot.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "pipeline/contract/error.h"
#include "pipeline/driver/frame_range.h"
#include "tests/driver/folder.h"

namespace drench::test {

namespace fs = std::filesystem;

namespace {

StageKey toy_key(const std::string& name, const std::string& setting, const std::string& program) {
  Hasher hasher;
  hasher.text(name).text(setting).text(program);
  return {hasher.finish(), {{name, setting}, {"program", program}}};
}

class ToySimulation : public Simulation {
 public:
  ToySimulation(const ToySettings& settings, ToyStages& stages)
      : settings_(settings), stages_(stages), frame_(settings.first) {}

  int frame() const override { return frame_; }
  void preroll(const std::function<bool()>&) override {}
  StageReport advance(const std::function<bool()>& keep_going) override {
    stages_.log(Step::simulate, frame_ + 1, Mark::begin);
    if (stages_.hook) stages_.hook(Step::simulate, frame_ + 1);
    constexpr int steps = 100;
    for (; step_ < steps; ++step_) {
      if (keep_going && !keep_going()) throw Stopped("toy stopped");
      state_ = settings_.growth * state_ * (1 - state_);
    }
    step_ = 0;
    ++frame_;
    stages_.log(Step::simulate, frame_, Mark::end);
    return {};
  }
  std::vector<WrittenFile> write_frame(const fs::path& folder) const override {
    if (!settings_.fluid) return {write_file_whole(folder / layout::cloth("flag", frame_), text())};
    return {write_file_whole(folder / layout::particles(frame_), text())};
  }
  WrittenFile write_checkpoint(const fs::path& file) const override {
    return write_file_whole(file, fmt::format("{} {} {:a}", frame_, step_, state_));
  }
  void read_checkpoint(const fs::path& file) override {
    if (std::sscanf(text_of(file).c_str(), "%d %d %la", &frame_, &step_, &state_) != 3) {
      throw Error(file.string() + ": damaged checkpoint; remove it");
    }
  }

 private:
  std::string text() const { return fmt::format("{:a}\n", state_); }

  const ToySettings& settings_;
  ToyStages& stages_;
  int frame_, step_ = 0;
  double state_ = 0.34;
};

}  // namespace

Targets toy_targets(const ToySettings& settings) {
  Targets targets;
  targets.shot = "toy";
  targets.first = settings.first;
  targets.frames =
      settings.frames.empty() ? all_frames({settings.first, settings.last, 24}) : settings.frames;
  targets.steps = settings.steps;
  targets.fluid = settings.fluid;
  if (!settings.fluid) targets.cloth = {"flag"};
  targets.simulate = toy_key("fluid", fmt::format("{:a}", settings.growth), settings.program);
  targets.mesh = toy_key("surface", std::to_string(settings.mesh_digits), "1");
  targets.obstacles_move = settings.obstacles_move;
  targets.has_foam = settings.foam;
  if (settings.foam) targets.steps.push_back(Step::foam);
  if (settings.foam) targets.foam = toy_key("foam", std::to_string(settings.foam_rate), "1");
  targets.render = toy_key("camera", settings.camera, "1");
  targets.denoise_frames = settings.denoise_frames;
  targets.denoised_later = settings.denoise_frames > 0;
  if (targets.denoised_later) {
    // As the commands have it: what renders denoises.
    if (targets.includes(Step::render)) targets.steps.push_back(Step::denoise);
    targets.denoise = toy_key("denoise", std::to_string(settings.denoise_frames), "1");
  }
  targets.dailies = toy_key("dailies", "", "1");
  return targets;
}

std::unique_ptr<Simulation> ToyStages::start_simulation() {
  return std::make_unique<ToySimulation>(settings_, *this);
}

StageReport ToyStages::mesh(const fs::path& folder, int frame) {
  log(Step::mesh, frame, Mark::begin);
  if (hook) hook(Step::mesh, frame);
  const double state = std::strtod(text_of(folder / layout::particles(frame)).c_str(), nullptr);
  const double unit = std::pow(10.0, -settings_.mesh_digits);
  StageReport report;
  report.files.push_back(
      write_file_whole(folder / layout::fluid_mesh(frame),
                       fmt::format("{:.9f}\n", std::round(state / unit) * unit)));
  log(Step::mesh, frame, Mark::end);
  return report;
}

/// A mean over frames: one wrong frame before shows in all that follow.
StageReport ToyStages::foam(const fs::path& folder, int frame) {
  log(Step::foam, frame, Mark::begin);
  if (hook) hook(Step::foam, frame);
  const auto number = [&](const std::string& file) {
    return std::strtod(text_of(folder / file).c_str(), nullptr);
  };
  const double fluid = number(layout::particles(frame));
  double foam = 0;
  if (frame != settings_.first) {
    const double change = fluid - number(layout::particles(frame - 1));
    foam = (1 - settings_.foam_rate) * number(layout::foam(frame - 1)) +
           settings_.foam_rate * std::abs(change);
  }
  StageReport report;
  report.files.push_back(
      write_file_whole(folder / layout::foam(frame), fmt::format("{:a}\n", foam)));
  log(Step::foam, frame, Mark::end);
  return report;
}

StageReport ToyStages::render(const fs::path& folder, int frame, const Attributes&,
                              const std::function<void(double)>& progress) {
  log(Step::render, frame, Mark::begin);
  if (hook) hook(Step::render, frame);
  progress(0.5);
  const std::string input =
      settings_.fluid ? layout::fluid_mesh(frame) : layout::cloth("flag", frame);
  StageReport report;
  const std::string foam = settings_.foam ? text_of(folder / layout::foam(frame)) : "";
  report.files.push_back(write_file_whole(folder / render_file(toy_targets(settings_), frame),
                                          settings_.camera + " " + text_of(folder / input) + foam));
  log(Step::render, frame, Mark::end);
  return report;
}

/// All of what it is given, in order.
StageReport ToyStages::denoise(const fs::path& folder, int frame, const NoisyFiles& noisy,
                               const Attributes&) {
  log(Step::denoise, frame, Mark::begin);
  if (hook) hook(Step::denoise, frame);
  std::string all;
  for (const std::string& file : noisy.all()) all += file + " " + text_of(folder / file);
  StageReport report;
  report.files.push_back(write_file_whole(folder / layout::image("toy", frame), all));
  log(Step::denoise, frame, Mark::end);
  return report;
}

StageReport ToyStages::contact_sheet(const fs::path& folder, const std::vector<int>& frames) {
  log(Step::contact_sheet, 0, Mark::begin);
  std::string all;
  for (const int frame : frames) all += text_of(folder / layout::image("toy", frame));
  StageReport report;
  report.files.push_back(write_file_whole(folder / layout::contact_sheet, all));
  log(Step::contact_sheet, 0, Mark::end);
  return report;
}

StageReport ToyStages::movie(const fs::path&, const std::vector<int>&,
                             const std::function<bool()>&) {
  throw std::logic_error("toys make no movie");
}

void ToyStages::log(Step step, int frame, Mark mark) {
  const std::scoped_lock lock(mutex_);
  events_.push_back({step, frame, mark});
}

std::vector<Event> ToyStages::events() const {
  const std::scoped_lock lock(mutex_);
  return events_;
}

int ToyStages::count(Step step) const { return int(frames(step).size()); }

std::vector<int> ToyStages::frames(Step step) const {
  std::vector<int> result;
  for (const Event& event : events()) {
    if (event.step == step && event.mark == Mark::begin) result.push_back(event.frame);
  }
  return result;
}

Plan make_toy(const ToySettings& settings, ToyStages& stages, const fs::path& folder,
              ExecuteOptions options) {
  const Targets targets = toy_targets(settings);
  const FolderLock lock(folder);
  Manifest manifest(folder / layout::manifest);
  manifest.open_for_append();
  Progress progress(ProgressStyle::quiet);
  std::optional<Plan> first;
  Retries retries(folder, manifest);
  for (;;) {
    const Plan plan = make_plan(targets, take_snapshot(folder, manifest), settings.last);
    if (retries.drop_damaged_inputs(targets, plan)) continue;
    if (!first) first = plan;
    if (!plan.problems.empty()) throw Error(plan.problems.front());
    if (plan.nothing_to_do()) return *first;
    try {
      execute(targets, plan, folder, manifest, stages, progress, options);
      return *first;
    } catch (const DamagedInput& found) {
      retries.count(found);
    }
  }
}

std::map<std::string, std::string> digests_in(const fs::path& folder) {
  std::map<std::string, std::string> digests;
  for (const auto& [file, record] : Manifest(folder / layout::manifest).records()) {
    if (file != layout::stop_checkpoint) digests[file] = hash_file(folder / file).hex();
  }
  return digests;
}

}  // namespace drench::test
