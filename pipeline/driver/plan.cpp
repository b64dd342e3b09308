#include "pipeline/driver/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "pipeline/driver/frame_range.h"
#include "pipeline/driver/layout.h"

namespace drench {

namespace {

constexpr const char* unchanged = "key unchanged";
constexpr int64_t longest_timeline = 1'000'000;  // frames, of any shot

/// "camera changed", "device, fluid changed": the parts that differ between two keys.
std::string difference(const KeyParts& wanted, const KeyParts& recorded) {
  std::set<std::string> names;
  for (const auto& [name, value] : wanted) {
    const auto found = recorded.find(name);
    if (found == recorded.end() || found->second != value) names.insert(name);
  }
  for (const auto& [name, value] : recorded) {
    if (!wanted.contains(name)) names.insert(name);
  }
  if (names.empty()) return "settings changed";
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text + " changed";
}

/// Digests of intact input files; nothing if one is not there.
std::optional<InputDigests> digests_of(const std::vector<std::string>& files,
                                       const Lookup& lookup) {
  InputDigests inputs;
  for (const std::string& file : files) {
    const std::optional<KnownFile> known = lookup(file);
    if (!known || known->state != FileState::intact) return {};
    inputs.emplace_back(file, known->record.digest);
  }
  return inputs;
}

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
  Planner(const Wanted& wanted, const Snapshot& snapshot)
      : wanted_(wanted), lookup_([&snapshot](const std::string& file) -> std::optional<KnownFile> {
          const auto found = snapshot.find(file);
          return found == snapshot.end() ? std::nullopt : std::optional(found->second);
        }) {}

  void plan_simulation();
  void plan_mesh();
  void plan_foam();
  void plan_render();
  void plan_denoise();
  void plan_dailies(Step step);
  Plan finish(const Snapshot& snapshot, int timeline_last);

 private:
  void choose_start(const std::vector<Digest>& keys, int first_missing);
  void warn_of_stale_caches();
  void warn_of_stale_meshes();
  void check_inputs(const std::vector<std::string>& missing, const char* command);
  bool usable_checkpoint(const std::string& file, const Digest& key) const;
  bool simulates(int frame) const {
    return plan_.simulation.needed && frame <= plan_.simulation.last &&
           (plan_.simulation.checkpoint.empty() || frame > plan_.simulation.from);
  }
  void add(Step step, int frame, Action action, std::string reason) {
    plan_.tasks.push_back({step, frame, action, std::move(reason)});
  }
  void add_made_from(Step step, int frame, const std::optional<Decision>& decision, Action input,
                     const std::vector<std::string>& files, const StageKey& stage);

  const Wanted& wanted_;
  const Lookup lookup_;
  Plan plan_;
  std::map<int, Action> simulated_, meshed_, foamed_, rendered_, delivered_;
};

bool Planner::usable_checkpoint(const std::string& file, const Digest& key) const {
  const std::optional<KnownFile> known = lookup_(file);
  return known && known->state == FileState::intact && known->record.key == key;
}

void Planner::choose_start(const std::vector<Digest>& keys, int first_missing) {
  SimulationSpan& span = plan_.simulation;
  span.from = wanted_.first;
  // A checkpoint on a frame can write that frame again; the one made on stop stands after its
  // frame.
  for (int frame = first_missing; frame > wanted_.first; --frame) {
    if (usable_checkpoint(layout::checkpoint(frame), keys[size_t(frame - wanted_.first)])) {
      span.checkpoint = layout::checkpoint(frame);
      span.from = frame;
      break;
    }
  }
  const std::string stop(layout::stop_checkpoint);
  const std::optional<KnownFile> known = lookup_(stop);
  if (!known) return;
  const int frame = known->record.frame;
  if (frame < span.from || frame < wanted_.first || frame >= first_missing) return;
  if (!usable_checkpoint(stop, keys[size_t(frame - wanted_.first)])) return;
  span.checkpoint = stop;
  span.from = frame;
}

void Planner::plan_simulation() {
  const int last = wanted_.frames.back();
  const std::vector<Digest> keys = simulation_keys(wanted_, last);
  Key key{{}, wanted_.simulate.parts};
  std::vector<std::string> reasons;  // empty: the frame is there
  int first_missing = last + 1;
  for (int frame = wanted_.first; frame <= last; ++frame) {
    key.digest = keys[size_t(frame - wanted_.first)];
    Decision decision = decide(simulated_files(wanted_, frame), key, lookup_);
    if (frame == last && !decision.make) decision = decide_probes(wanted_, frame, lookup_);
    reasons.push_back(decision.make ? std::move(decision.reason) : "");
    if (!decision.make) continue;
    first_missing = std::min(first_missing, frame);
    plan_.simulation.last = frame;
  }
  plan_.simulation.needed = first_missing <= last;
  if (plan_.simulation.needed) choose_start(keys, first_missing);
  for (int frame = wanted_.first; frame <= last; ++frame) {
    std::string& reason = reasons[size_t(frame - wanted_.first)];
    const bool make = !reason.empty();
    // A frame whose file is there and right is simulated again only on the way to a later one.
    const bool again = !make && simulates(frame);
    simulated_[frame] = make ? Action::run : again ? Action::depends : Action::skip;
    if (again) reason = fmt::format("on the way to frame {}", plan_.simulation.last);
    if (reason.empty()) reason = unchanged;
    add(Step::simulate, frame, make || again ? Action::run : Action::skip, std::move(reason));
  }
}

void Planner::add_made_from(Step step, int frame, const std::optional<Decision>& decision,
                            Action input, const std::vector<std::string>& files,
                            const StageKey& stage) {
  if (input != Action::skip && decision && !decision->make) {
    add(step, frame, Action::depends, "runs if what it reads changes");
  } else if (decision) {
    add(step, frame, decision->make ? Action::run : Action::skip, decision->reason);
  } else if (same_stage(files, stage, lookup_)) {
    add(step, frame, Action::depends, "runs if what it reads changes");
  } else {
    const Decision own = decide(files, {{}, stage.parts}, lookup_);
    add(step, frame, Action::run, own.reason);
  }
}

void Planner::check_inputs(const std::vector<std::string>& missing, const char* command) {
  if (missing.empty()) return;
  plan_.problems.push_back(
      fmt::format("{} of the files to read are missing or damaged, the first "
                  "is {}; run `drench {}` for these frames, or `drench run`",
                  missing.size(), missing.front(), command));
}

/// A later stage alone works on what lies there, but says when that is not what the shot says now.
void Planner::warn_of_stale_caches() {
  const std::vector<Digest> keys = simulation_keys(wanted_, wanted_.frames.back());
  std::vector<int> stale;
  for (const int frame : wanted_.frames) {
    for (const std::string& file : simulated_files(wanted_, frame)) {
      const std::optional<KnownFile> known = lookup_(file);
      if (!known || known->record.key == keys[size_t(frame - wanted_.first)]) continue;
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

void Planner::warn_of_stale_meshes() {
  std::vector<int> stale;
  for (const int frame : wanted_.frames) {
    const std::optional<Decision> decision = decide_mesh(wanted_, frame, lookup_);
    if (decision && decision->make && lookup_(layout::fluid_mesh(frame))) stale.push_back(frame);
  }
  if (stale.empty()) return;
  plan_.warnings.push_back(
      fmt::format("the meshes of frames {} were made with other settings; they "
                  "are used as they are. `drench mesh` brings them up to date",
                  format_frames(stale)));
}

void Planner::plan_mesh() {
  if (!wanted_.may(Step::simulate)) warn_of_stale_caches();
  std::vector<std::string> missing;
  for (const int frame : wanted_.frames) {
    if (!wanted_.fluid) {
      meshed_[frame] = Action::skip;
      add(Step::mesh, frame, Action::skip, "no fluid");
      continue;
    }
    const Action input = wanted_.may(Step::simulate) ? simulated_[frame] : Action::skip;
    const std::optional<Decision> decision = decide_mesh(wanted_, frame, lookup_);
    if (!decision && input == Action::skip) {
      for (const std::string& file : simulated_files(wanted_, frame)) {
        const auto known = lookup_(file);
        if (!known || known->state != FileState::intact) missing.push_back(file);
      }
    }
    add_made_from(Step::mesh, frame, decision, input, mesh_files(wanted_, frame), wanted_.mesh);
    meshed_[frame] = plan_.tasks.back().action;
  }
  check_inputs(missing, "simulate");
}

/// Every frame from the first on, whichever are asked for: each starts from the one before.
void Planner::plan_foam() {
  if (!wanted_.has_foam) return;
  std::vector<std::string> missing;
  Action before = Action::skip;
  for (int frame = wanted_.first; frame <= wanted_.frames.back(); ++frame) {
    Action input = before;
    if (wanted_.may(Step::simulate) && simulated_[frame] != Action::skip) input = Action::depends;
    const std::optional<Decision> decision = decide_foam(wanted_, frame, lookup_);
    if (!decision && input == Action::skip) {
      for (const std::string& file : foam_inputs(wanted_, frame)) {
        const auto known = lookup_(file);
        if (!known || known->state != FileState::intact) missing.push_back(file);
      }
    }
    add_made_from(Step::foam, frame, decision, input, {layout::foam(frame)}, wanted_.foam);
    before = foamed_[frame] = plan_.tasks.back().action;
  }
  check_inputs(missing, "simulate");
}

void Planner::plan_render() {
  if (!wanted_.may(Step::mesh)) {
    warn_of_stale_caches();
    if (wanted_.fluid) warn_of_stale_meshes();
  }
  std::vector<std::string> missing;
  for (const int frame : wanted_.frames) {
    Action input = Action::skip;
    if (wanted_.may(Step::mesh) && meshed_[frame] != Action::skip) input = Action::depends;
    if (wanted_.has_foam && wanted_.may(Step::foam) && foamed_[frame] != Action::skip)
      input = Action::depends;
    if (wanted_.may(Step::simulate) && simulated_[frame] != Action::skip) input = Action::depends;
    const std::optional<Decision> decision = decide_render(wanted_, frame, lookup_);
    if (!decision && input == Action::skip) {
      for (const std::string& file : render_inputs(wanted_, frame)) {
        const auto known = lookup_(file);
        if (!known || known->state != FileState::intact) missing.push_back(file);
      }
    }
    add_made_from(Step::render, frame, decision, input, {render_file(wanted_, frame)},
                  wanted_.render);
    rendered_[frame] = delivered_[frame] = plan_.tasks.back().action;
  }
  check_inputs(missing, wanted_.fluid ? "mesh" : "simulate");
}

void Planner::plan_denoise() {
  if (!wanted_.denoised_later) return;
  for (const int frame : denoised_frames(wanted_, lookup_)) {
    Action input = Action::skip;
    const auto end = rendered_.upper_bound(frame + wanted_.denoise_frames);
    for (auto at = rendered_.lower_bound(frame - wanted_.denoise_frames); at != end; ++at)
      if (at->second != Action::skip) input = Action::depends;
    add_made_from(Step::denoise, frame, decide_denoise(wanted_, frame, lookup_), input,
                  {layout::image(wanted_.shot, frame)}, wanted_.denoise);
    if (wanted_.wants(frame)) delivered_[frame] = plan_.tasks.back().action;
  }
}

void Planner::plan_dailies(Step step) {
  if (step == Step::movie && wanted_.frames.size() < 2) {
    return add(step, 0, Action::skip, "a single frame");
  }
  if (step == Step::movie && !wanted_.has_ffmpeg) {
    return add(step, 0, Action::skip, "ffmpeg is not installed");
  }
  Action input = Action::skip;
  for (const auto& [frame, action] : delivered_) {
    if (action == Action::run) input = Action::run;
    if (action == Action::depends && input == Action::skip) input = Action::depends;
  }
  const std::optional<Decision> decision = decide_dailies(wanted_, step, lookup_);
  if (input == Action::run) return add(step, 0, Action::run, "frames are rendered");
  if (decision && decision->make) return add(step, 0, Action::run, decision->reason);
  if (input == Action::depends) return add(step, 0, Action::depends, "runs if a frame changes");
  add(step, 0, decision ? Action::skip : Action::run, decision ? decision->reason : "not made yet");
}

Plan Planner::finish(const Snapshot& snapshot, int timeline_last) {
  const int last = std::max(timeline_last, wanted_.frames.back());
  const std::vector<std::string> probes = probe_files(wanted_);
  for (const auto& [file, known] : snapshot) {
    const bool of_probe = known.record.step == probe_step;
    if (of_probe && std::find(probes.begin(), probes.end(), file) == probes.end())
      plan_.beyond.push_back(file);
    const bool framed = known.record.step == "simulate" || known.record.step == "mesh" ||
                        known.record.step == "foam" || known.record.step == "render" ||
                        known.record.step == "denoise";
    if (!framed) continue;
    const int frame = known.record.frame;
    const std::string image = layout::image(wanted_.shot, frame);
    std::vector<std::string> wanted = simulated_files(wanted_, frame);
    for (std::string& mesh : mesh_files(wanted_, frame)) wanted.push_back(std::move(mesh));
    if (wanted_.has_foam) wanted.push_back(layout::foam(frame));
    wanted.push_back(render_file(wanted_, frame));
    const bool named =
        file == image || std::find(wanted.begin(), wanted.end(), file) != wanted.end();
    if (frame > last || frame < wanted_.first || !named) plan_.beyond.push_back(file);
  }
  return std::move(plan_);
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

Decision decide(const std::vector<std::string>& files, const Key& key, const Lookup& lookup) {
  for (const std::string& file : files) {
    const std::optional<KnownFile> known = lookup(file);
    if (!known) return {true, key, "not made yet"};
    if (known->record.key != key.digest) {
      return {true, key, difference(key.parts, known->record.parts)};
    }
    if (known->state == FileState::missing) return {true, key, "file is missing"};
    if (known->state == FileState::changed) return {true, key, "file was damaged or changed"};
  }
  return {false, key, unchanged};
}

Decision decide_probes(const Wanted& wanted, int frame, const Lookup& lookup) {
  Decision latest{false, {{}, wanted.simulate.parts}, unchanged};
  for (const std::string& file : probe_files(wanted)) {
    const std::optional<KnownFile> known = lookup(file);
    // A record may say anything; keys are made for every frame up to the one it names.
    const bool later = known && known->record.frame > frame &&
                       int64_t(known->record.frame) - wanted.first < longest_timeline;
    const int until = later ? known->record.frame : frame;
    latest = decide({file}, {simulation_keys(wanted, until).back(), wanted.simulate.parts}, lookup);
    if (!latest.make) continue;
    if (known && known->record.frame < frame) latest.reason = "ends before this frame";
    return latest;
  }
  return latest;
}

std::optional<Decision> decide_mesh(const Wanted& wanted, int frame, const Lookup& lookup) {
  auto inputs = digests_of(simulated_files(wanted, frame), lookup);
  if (!inputs) return {};
  for (auto& input : sequence_inputs(wanted, frame, frame)) inputs->push_back(input);
  return decide(mesh_files(wanted, frame), step_key(wanted.mesh, Step::mesh, frame, *inputs),
                lookup);
}

std::optional<Decision> decide_foam(const Wanted& wanted, int frame, const Lookup& lookup) {
  auto inputs = digests_of(foam_inputs(wanted, frame), lookup);
  if (!inputs) return {};
  for (auto& input : sequence_inputs(wanted, frame, frame)) inputs->push_back(input);
  return decide({layout::foam(frame)}, step_key(wanted.foam, Step::foam, frame, *inputs), lookup);
}

std::optional<Decision> decide_render(const Wanted& wanted, int frame, const Lookup& lookup) {
  auto inputs = digests_of(render_inputs(wanted, frame), lookup);
  if (!inputs) return {};
  // Velocities come from the frames on both sides.
  for (auto& input : sequence_inputs(wanted, frame - 1, frame + 1)) inputs->push_back(input);
  return decide({render_file(wanted, frame)}, step_key(wanted.render, Step::render, frame, *inputs),
                lookup);
}

std::vector<std::string> NoisyFiles::all() const {
  std::vector<std::string> files{frame};
  files.insert(files.end(), before.begin(), before.end());
  files.insert(files.end(), after.begin(), after.end());
  return files;
}

namespace {

/// Whether a noisy frame lies there and is what the shot says now, as far as this run's steps know.
bool lies_there(const Wanted& wanted, int frame, const Lookup& lookup) {
  const std::optional<KnownFile> known = lookup(layout::noisy(wanted.shot, frame));
  if (!known || known->state != FileState::intact || frame < wanted.first) return false;
  if (wanted.wants(frame)) return true;
  const auto stands = [](const std::optional<Decision>& decision) {
    return decision && !decision->make;
  };
  if (!stands(decide_render(wanted, frame, lookup))) return false;
  if (wanted.may(Step::mesh) && wanted.fluid && !stands(decide_mesh(wanted, frame, lookup)))
    return false;
  if (wanted.may(Step::foam) && wanted.has_foam && !stands(decide_foam(wanted, frame, lookup)))
    return false;
  if (!wanted.may(Step::simulate)) return true;
  const Key key{simulation_keys(wanted, frame).back(), wanted.simulate.parts};
  return stands(decide(simulated_files(wanted, frame), key, lookup));
}

}  // namespace

NoisyFiles denoise_inputs(const Wanted& wanted, int frame, const Lookup& lookup) {
  NoisyFiles files{layout::noisy(wanted.shot, frame), {}, {}};
  const int reach = wanted.denoise_frames;
  for (int k = 1; k <= reach && lies_there(wanted, frame - k, lookup); ++k)
    files.before.push_back(layout::noisy(wanted.shot, frame - k));
  for (int k = 1; k <= reach && lies_there(wanted, frame + k, lookup); ++k)
    files.after.push_back(layout::noisy(wanted.shot, frame + k));
  return files;
}

std::optional<Decision> decide_denoise(const Wanted& wanted, int frame, const Lookup& lookup) {
  const auto inputs = digests_of(denoise_inputs(wanted, frame, lookup).all(), lookup);
  if (!inputs) return {};
  return decide({layout::image(wanted.shot, frame)},
                step_key(wanted.denoise, Step::denoise, frame, *inputs), lookup);
}

std::vector<int> denoised_frames(const Wanted& wanted, const Lookup& lookup) {
  std::set<int> frames(wanted.frames.begin(), wanted.frames.end());
  for (const int near : wanted.frames)
    for (int frame = near - wanted.denoise_frames; frame <= near + wanted.denoise_frames; ++frame)
      if (!frames.contains(frame) && lies_there(wanted, frame, lookup)) frames.insert(frame);
  return {frames.begin(), frames.end()};
}

std::optional<Decision> decide_dailies(const Wanted& wanted, Step step, const Lookup& lookup) {
  std::vector<std::string> images;
  for (const int frame : wanted.frames) images.push_back(layout::image(wanted.shot, frame));
  const auto inputs = digests_of(images, lookup);
  if (!inputs) return {};
  Key key = step_key(wanted.dailies, step, 0, *inputs);
  key.parts = wanted.dailies.parts;  // hundreds of frames: one name stands for them all
  Hasher all;
  for (const auto& [file, digest] : *inputs) all.text(file).digest(digest);
  key.parts["frames"] = all.finish().hex().substr(0, 8);
  const std::string file =
      step == Step::movie ? layout::movie(wanted.shot) : std::string(layout::contact_sheet);
  return decide({file}, key, lookup);
}

Plan make_plan(const Wanted& wanted, const Snapshot& snapshot, int timeline_last) {
  Planner planner(wanted, snapshot);
  if (wanted.may(Step::simulate)) planner.plan_simulation();
  if (wanted.may(Step::mesh)) planner.plan_mesh();
  if (wanted.may(Step::foam)) planner.plan_foam();
  if (wanted.may(Step::render)) planner.plan_render();
  if (wanted.may(Step::denoise)) planner.plan_denoise();
  if (wanted.may(Step::contact_sheet)) planner.plan_dailies(Step::contact_sheet);
  if (wanted.may(Step::movie)) planner.plan_dailies(Step::movie);
  return planner.finish(snapshot, timeline_last);
}

std::string plan_text(const Plan& plan) {
  std::string text;
  for (size_t begin = 0, end = 0; begin < plan.tasks.size(); begin = end) {
    const Task& task = plan.tasks[begin];
    std::vector<int> frames;
    for (end = begin; end < plan.tasks.size(); ++end) {
      const Task& next = plan.tasks[end];
      if (next.step != task.step || next.action != task.action || next.reason != task.reason) break;
      frames.push_back(next.frame);
    }
    const bool framed = task.step != Step::contact_sheet && task.step != Step::movie;
    text += fmt::format("{:13}  {:7}  {:24}  {}\n", step_name(task.step), action_name(task.action),
                        framed ? format_frames(frames) : "", task.reason);
  }
  const SimulationSpan& span = plan.simulation;
  if (span.needed) {
    text += span.checkpoint.empty() ? fmt::format("simulation starts at frame {}\n", span.from)
                                    : fmt::format("simulation continues from frame {} ({})\n",
                                                  span.from, span.checkpoint);
  }
  if (!plan.beyond.empty()) {
    text += fmt::format(
        "{} files belong to frames or sheets the shot no longer has; `drench clean` "
        "removes them\n",
        plan.beyond.size());
  }
  return text;
}

void write_plan_json(const Plan& plan, const std::string& scene,
                     const std::function<void(std::string_view)>& write) {
  const auto text_of = [](const nlohmann::json& value) {
    return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  };
  const SimulationSpan& span = plan.simulation;
  const nlohmann::json simulation{{"needed", span.needed},
                                  {"checkpoint", span.checkpoint},
                                  {"from", span.from},
                                  {"last", span.last}};
  std::string text = fmt::format(
      "{{\n\"beyond\": {},\n\"problems\": {},\n\"simulation\": {},\n\"warnings\": "
      "{},\n\"tasks\": [",
      text_of(plan.beyond), text_of(plan.problems), text_of(simulation), text_of(plan.warnings));
  if (!scene.empty()) text.insert(2, fmt::format("\"scene\": {},\n", scene));
  constexpr size_t piece = 1 << 16;
  std::string_view before = "\n";
  for (const Task& task : plan.tasks) {
    text += fmt::format(R"({}{{"action": "{}", "frame": {}, "reason": {}, "step": "{}"}})", before,
                        action_name(task.action), task.frame, text_of(task.reason),
                        step_name(task.step));
    before = ",\n";
    if (text.size() < piece) continue;
    write(text);
    text.clear();
  }
  write(text + "\n]\n}\n");
}

}  // namespace drench
