#include "pipeline/driver/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "pipeline/driver/frame_range.h"
#include "pipeline/driver/layout.h"

namespace drench {

namespace {

/// Whether the stage's own half of the key still holds, whatever its inputs became.
bool same_stage(const std::vector<std::string>& files, const StageKey& stage,
                const Lookup& lookup) {
  for (const std::string& file : files) {
    const std::optional<KnownFile> known = lookup(file);
    if (!known || known->state != FileState::intact) return false;
    for (const auto& [name, value] : stage.parts) {
      const auto found = known->record.parts.find(name);
      if (found == known->record.parts.end() || found->second != value) return false;
    }
  }
  return true;
}

class Planner {
 public:
  Planner(const Targets& targets, const Snapshot& snapshot)
      : targets_(targets), lookup_([&snapshot](const std::string& file) {
          const auto found = snapshot.find(file);
          return found == snapshot.end() ? std::nullopt : std::optional(found->second);
        }) {}

  void warn_of_stale_inputs();
  void plan_simulation();
  void plan_rule(const Rule& rule);
  void find_beyond(const Snapshot& snapshot, int timeline_last);
  Plan take() { return std::move(plan_); }

 private:
  void choose_start(const std::vector<Digest>& keys, int first_missing);
  void warn_of_stale_caches();
  void warn_of_stale_files(const Rule& rule);
  std::vector<std::string> plan_frame(const Rule& rule, int frame);
  void plan_once(const Rule& rule);
  void refuse_missing(const Rule& rule, const std::vector<std::string>& missing);
  bool usable_checkpoint(const std::string& file, const Digest& key) const;
  bool simulates(int frame) const {
    return plan_.simulation.needed && frame <= plan_.simulation.last &&
           (plan_.simulation.checkpoint.empty() || frame > plan_.simulation.from);
  }
  Action action_of_inputs(const Rule& rule, int frame) const;
  bool makes(const std::string& file, int frame) const;
  void add(Step step, int frame, Action action, std::string_view reason) {
    plan_.tasks.push_back({step, frame, action, std::string(reason)});
    actions_[size_t(step)][frame] = action;
  }

  const Targets& targets_;
  const Lookup lookup_;
  Plan plan_;
  std::array<std::map<int, Action>, size_t(Step::count)> actions_;  // by frame: of what is planned
};

bool Planner::usable_checkpoint(const std::string& file, const Digest& key) const {
  const std::optional<KnownFile> known = lookup_(file);
  return known && known->state == FileState::intact && known->record.key == key;
}

void Planner::choose_start(const std::vector<Digest>& keys, int first_missing) {
  SimulationSpan& span = plan_.simulation;
  span.from = targets_.first;
  // A checkpoint on a frame can write that frame again; the one made on stop stands after its
  // frame.
  for (int frame = first_missing; frame > targets_.first; --frame) {
    if (usable_checkpoint(layout::checkpoint(frame), keys[size_t(frame - targets_.first)])) {
      span.checkpoint = layout::checkpoint(frame);
      span.from = frame;
      break;
    }
  }
  const std::string stop(layout::stop_checkpoint);
  const std::optional<KnownFile> known = lookup_(stop);
  if (!known) return;
  const int frame = known->record.frame;
  if (frame < span.from || frame < targets_.first || frame >= first_missing) return;
  if (!usable_checkpoint(stop, keys[size_t(frame - targets_.first)])) return;
  span.checkpoint = stop;
  span.from = frame;
}

void Planner::plan_simulation() {
  const int last = targets_.frames.back();
  const std::vector<Digest> keys = simulation_keys(targets_, last);
  std::vector<std::string> reasons;  // empty: the frame is there
  int first_missing = last + 1;
  for (int frame = targets_.first; frame <= last; ++frame) {
    const Digest& key = keys[size_t(frame - targets_.first)];
    Decision decision = decide_simulation(targets_, frame, key, lookup_);
    if (frame == last && !decision.make) decision = decide_probes(targets_, frame, lookup_);
    reasons.push_back(decision.make ? std::move(decision.reason) : "");
    if (!decision.make) continue;
    first_missing = std::min(first_missing, frame);
    plan_.simulation.last = frame;
  }
  plan_.simulation.needed = first_missing <= last;
  if (plan_.simulation.needed) choose_start(keys, first_missing);
  const std::string on_the_way = fmt::format("on the way to frame {}", plan_.simulation.last);
  for (int frame = targets_.first; frame <= last; ++frame) {
    const std::string& reason = reasons[size_t(frame - targets_.first)];
    // A frame whose file is there and right is simulated again only on the way to a later one.
    const bool make = !reason.empty(), again = !make && simulates(frame);
    add(Step::simulate, frame, make || again ? Action::run : Action::skip,
        make    ? reason
        : again ? on_the_way
                : unchanged);
    // What comes out again is what it was, unless something is wrong.
    if (again) actions_[size_t(Step::simulate)][frame] = Action::depends;
  }
}

/// Run if an input of the frame is made, depends if it may be.
Action Planner::action_of_inputs(const Rule& rule, int frame) const {
  Action most = Action::skip;
  for (const Input& input : rule.inputs) {
    const std::map<int, Action>& actions = actions_[size_t(input.step)];
    if (actions.empty()) continue;
    for (const int at : possible_frames(rule, input, targets_, frame)) {
      const auto found = actions.find(at);
      if (found == actions.end() || found->second == Action::skip) continue;
      if (input.files(targets_, at).empty()) continue;
      if (found->second == Action::run) return Action::run;
      most = Action::depends;
    }
  }
  return most;
}

/// @return inputs that are missing and that nothing before it makes
std::vector<std::string> Planner::plan_frame(const Rule& rule, int frame) {
  const bool changes = action_of_inputs(rule, frame) != Action::skip;
  const std::optional<Decision> decision = decide(rule, targets_, frame, lookup_);
  const std::vector<std::string> files = rule.outputs(targets_, frame);
  const StageKey& stage = targets_.*rule.settings;
  if (decision ? changes && !decision->make : same_stage(files, stage, lookup_)) {
    add(rule.step, frame, Action::depends, "runs if what it reads changes");
  } else if (decision) {
    add(rule.step, frame, decision->make ? Action::run : Action::skip, decision->reason);
  } else {
    add(rule.step, frame, Action::run, compare(files, {{}, stage.parts}, lookup_).reason);
  }
  std::vector<std::string> missing;
  if (decision || changes) return missing;
  for (InputFile& input : inputs_of(rule, targets_, frame, lookup_))
    if (!is_intact(input.name, lookup_)) missing.push_back(std::move(input.name));
  return missing;
}

void Planner::plan_once(const Rule& rule) {
  const Action inputs = action_of_inputs(rule, 0);
  const std::optional<Decision> decision = decide(rule, targets_, 0, lookup_);
  if (inputs == Action::run) {
    add(rule.step, 0, Action::run, "frames are rendered");
  } else if (decision && decision->make) {
    add(rule.step, 0, Action::run, decision->reason);
  } else if (inputs == Action::depends) {
    add(rule.step, 0, Action::depends, "runs if a frame changes");
  } else if (decision) {
    add(rule.step, 0, Action::skip, decision->reason);
  } else {
    add(rule.step, 0, Action::run, "not made yet");
  }
}

void Planner::plan_rule(const Rule& rule) {
  const std::optional<std::string_view> skipped = reason_to_skip(rule, targets_);
  if (skipped && skipped->empty()) return;
  std::vector<std::string> missing;
  for (const int frame : frames_of(rule, targets_, lookup_)) {
    if (skipped) {
      add(rule.step, frame, Action::skip, *skipped);
    } else if (rule.frames == Frames::once) {
      plan_once(rule);
    } else {
      for (std::string& file : plan_frame(rule, frame)) missing.push_back(std::move(file));
    }
  }
  refuse_missing(rule, missing);
}

/// Names the command of the step that makes the first of what the rule reads.
void Planner::refuse_missing(const Rule& rule, const std::vector<std::string>& missing) {
  if (missing.empty()) return;
  const auto input = std::find_if(rule.inputs.begin(), rule.inputs.end(), [&](const Input& i) {
    return !i.files(targets_, targets_.first).empty();
  });
  plan_.problems.push_back(
      fmt::format("{} of the files to read are missing or damaged, the first "
                  "is {}; run `drench {}` for these frames, or `drench run`",
                  missing.size(), missing.front(), step_name(input->step)));
}

/// A later stage alone works on what lies there, but says when that is not what the shot says now.
void Planner::warn_of_stale_inputs() {
  const auto is_read = [this](Step step) {
    return !targets_.includes(step) &&
           std::any_of(rules().begin(), rules().end(), [&](const Rule& rule) {
             return targets_.includes(rule.step) &&
                    std::any_of(rule.inputs.begin(), rule.inputs.end(),
                                [&](const Input& input) { return input.step == step; });
           });
  };
  if (is_read(Step::simulate)) warn_of_stale_caches();
  for (const Rule& rule : rules())
    if (is_read(rule.step) && !rule.used_as_they_are.empty()) warn_of_stale_files(rule);
}

void Planner::warn_of_stale_caches() {
  const std::vector<Digest> keys = simulation_keys(targets_, targets_.frames.back());
  std::vector<int> stale;
  for (const int frame : targets_.frames) {
    for (const std::string& file : simulated_files(targets_, frame)) {
      const std::optional<KnownFile> known = lookup_(file);
      if (!known || known->record.key == keys[size_t(frame - targets_.first)]) continue;
      stale.push_back(frame);
      break;
    }
  }
  if (stale.empty()) return;
  plan_.warnings.push_back(
      fmt::format("frames {} were simulated with other settings; they are used "
                  "as they are. `drench simulate` brings them up to date",
                  format_frames(stale)));
}

void Planner::warn_of_stale_files(const Rule& rule) {
  if (reason_to_skip(rule, targets_)) return;
  std::vector<int> stale;
  for (const int frame : targets_.frames) {
    const std::optional<Decision> decision = decide(rule, targets_, frame, lookup_);
    if (decision && decision->make && lookup_(rule.outputs(targets_, frame).front()))
      stale.push_back(frame);
  }
  if (stale.empty()) return;
  plan_.warnings.push_back(fmt::format(fmt::runtime(rule.used_as_they_are), format_frames(stale)));
}

/// Whether a file is one that the shot has for a frame.
bool Planner::makes(const std::string& file, int frame) const {
  const auto among = [&](const std::vector<std::string>& files) {
    return std::find(files.begin(), files.end(), file) != files.end();
  };
  if (among(simulated_files(targets_, frame))) return true;
  return std::any_of(rules().begin(), rules().end(), [&](const Rule& rule) {
    return rule.frames != Frames::once && !reason_to_skip(rule, targets_) &&
           among(rule.outputs(targets_, frame));
  });
}

void Planner::find_beyond(const Snapshot& snapshot, int timeline_last) {
  const int last = std::max(timeline_last, targets_.frames.back());
  const std::vector<std::string> probes = probe_files(targets_);
  for (const auto& [file, known] : snapshot) {
    const Record& record = known.record;
    if (record.step == probe_record &&
        std::find(probes.begin(), probes.end(), file) == probes.end())
      plan_.beyond.push_back(file);
    const std::optional<Step> step = step_named(record.step);
    if (!step || !is_per_frame(*step)) continue;
    if (record.frame > last || record.frame < targets_.first || !makes(file, record.frame))
      plan_.beyond.push_back(file);
  }
}

}  // namespace

std::string_view action_name(Action action) {
  switch (action) {
    case Action::run:
      return "run";
    case Action::skip:
      return "skip";
    case Action::depends:
      return "depends";
  }
  return "";
}

bool Plan::nothing_to_do() const {
  return std::all_of(tasks.begin(), tasks.end(),
                     [](const Task& task) { return task.action == Action::skip; });
}

Plan make_plan(const Targets& targets, const Snapshot& snapshot, int timeline_last) {
  Planner planner(targets, snapshot);
  planner.warn_of_stale_inputs();
  if (targets.includes(Step::simulate)) planner.plan_simulation();
  for (const Rule& rule : rules())
    if (targets.includes(rule.step)) planner.plan_rule(rule);
  planner.find_beyond(snapshot, timeline_last);
  return planner.take();
}

}  // namespace drench
