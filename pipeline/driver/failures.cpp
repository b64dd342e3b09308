#include "pipeline/driver/failures.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "pipeline/contract/log.h"

namespace drench {

namespace {

constexpr int hopeless = 3;  // frames of a step in a row

std::string name_of(Step step, int frame) {
  return is_per_frame(step) ? fmt::format("{} frame={}", step_name(step), frame)
                            : std::string(step_name(step));
}

/// Frames that a rule makes when all goes well.
std::vector<int> frames_to_make(const Rule& rule, const Targets& targets) {
  if (rule.frames == Frames::once) return {0};
  if (rule.frames != Frames::from_first) return targets.frames;
  std::vector<int> frames(size_t(targets.frames.back() - targets.first + 1));
  std::iota(frames.begin(), frames.end(), targets.first);
  return frames;
}

}  // namespace

void Failures::add(Step step, int frame, const std::string& text) {
  const std::scoped_lock lock(mutex_);
  if (failed_.empty()) first_ = text;
  failed_.insert({step, frame});
  if (step == Step::simulate)
    for (int at = frame + 1; at <= targets_.frames.back(); ++at) left_out_.insert({step, at});
  ++in_a_row_[step];
  find_what_follows();
  std::string line = text;
  std::replace(line.begin(), line.end(), '\n', ' ');
  log_error("driver", fmt::format("{} failed: {}", name_of(step, frame), line));
}

void Failures::succeeded(Step step) {
  const std::scoped_lock lock(mutex_);
  in_a_row_[step] = 0;
}

bool Failures::follows(const Rule& rule, int frame) const {
  return std::any_of(rule.inputs.begin(), rule.inputs.end(), [&](const Input& input) {
    const std::vector<int> frames = possible_frames(rule, input, targets_, frame);
    return std::any_of(frames.begin(), frames.end(), [&](int at) {
      const Made made{input.step, at};
      return (failed_.contains(made) || left_out_.contains(made)) &&
             !input.files(targets_, at).empty();
    });
  });
}

/// In order of the rules and of the frames, as they are made.
void Failures::find_what_follows() {
  for (const Rule& rule : rules()) {
    if (!is_active(rule, targets_)) continue;
    for (const int frame : frames_to_make(rule, targets_))
      if (follows(rule, frame)) left_out_.insert({rule.step, frame});
  }
}

bool Failures::leave_out(const Rule& rule, int frame) const {
  const std::scoped_lock lock(mutex_);
  return left_out_.contains({rule.step, frame}) || follows(rule, frame);
}

bool Failures::are_hopeless() const {
  const std::scoped_lock lock(mutex_);
  return std::any_of(in_a_row_.begin(), in_a_row_.end(),
                     [](const auto& step) { return step.second >= hopeless; });
}

bool Failures::any() const {
  const std::scoped_lock lock(mutex_);
  return !failed_.empty();
}

std::string Failures::text() const {
  const std::scoped_lock lock(mutex_);
  std::string text = first_;
  if (failed_.size() > 1) text += fmt::format("\n{} frames failed, this one first", failed_.size());
  if (!left_out_.empty()) {
    text += fmt::format(
        "\n{} of what follows was left out; once that is mended the same command "
        "goes on with it",
        left_out_.size());
  }
  return text;
}

}  // namespace drench
