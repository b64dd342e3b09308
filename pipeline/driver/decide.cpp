#include "pipeline/driver/decide.h"

#include <algorithm>
#include <set>

namespace drench {

namespace {

constexpr int64_t longest_timeline = 1'000'000;  // frames, of any shot

/// "camera changed", "device, fluid changed": the parts that differ between two keys.
std::string difference(const KeyParts& now, const KeyParts& recorded) {
  std::set<std::string> names;
  for (const auto& [name, value] : now) {
    const auto found = recorded.find(name);
    if (found == recorded.end() || found->second != value) names.insert(name);
  }
  for (const auto& [name, value] : recorded) {
    if (!now.contains(name)) names.insert(name);
  }
  if (names.empty()) return "settings changed";
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text + " changed";
}

/// Digests of intact input files; nothing if one is not there.
std::optional<InputDigests> digests_of(const std::vector<InputFile>& files, const Lookup& lookup) {
  InputDigests digests;
  for (const InputFile& file : files) {
    const std::optional<KnownFile> known = lookup(file.name);
    if (!known || known->state != FileState::intact) return {};
    digests.emplace_back(file.name, known->record.digest);
  }
  return digests;
}

/// Hundreds of frames: one name stands for them all.
KeyParts parts_of_all(const StageKey& stage, const InputDigests& inputs) {
  KeyParts parts = stage.parts;
  Hasher all;
  for (const auto& [file, digest] : inputs) all.text(file).digest(digest);
  parts["frames"] = short_hex(all.finish());
  return parts;
}

/// Whether none of the steps of this run up to `last` would change the files of a frame.
bool is_up_to_date(Step last, const Targets& targets, int frame, const Lookup& lookup) {
  for (const Rule& rule : rules()) {
    if (rule.step > last) break;
    if (rule.step != last && !is_active(rule, targets)) continue;
    const std::optional<Decision> decision = decide(rule, targets, frame, lookup);
    if (!decision || decision->make) return false;
  }
  if (!targets.includes(Step::simulate)) return true;
  const Digest key = simulation_keys(targets, frame).back();
  return !decide_simulation(targets, frame, key, lookup).make;
}

/// Whether a frame's files can be read as those of a neighbour.
bool is_current(const Input& input, const Targets& targets, int frame, const Lookup& lookup) {
  if (frame < targets.first) return false;
  for (const std::string& file : input.files(targets, frame))
    if (!is_intact(file, lookup)) return false;
  return targets.includes(frame) || is_up_to_date(input.step, targets, frame, lookup);
}

/// Frames delivered, and beside them those that are there already and have them for neighbours now.
std::vector<int> frames_with_neighbours(const Rule& rule, const Targets& targets,
                                        const Lookup& lookup) {
  std::set<int> frames(targets.frames.begin(), targets.frames.end());
  for (const Input& input : rule.inputs) {
    const int reach = input.neighbours ? targets.*input.neighbours : 0;
    for (const int near : targets.frames)
      for (int frame = near - reach; frame <= near + reach; ++frame)
        if (!frames.contains(frame) && is_current(input, targets, frame, lookup))
          frames.insert(frame);
  }
  return {frames.begin(), frames.end()};
}

}  // namespace

bool is_intact(const std::string& file, const Lookup& lookup) {
  const std::optional<KnownFile> known = lookup(file);
  return known && known->state == FileState::intact;
}

Decision compare(const std::vector<std::string>& files, const Key& key, const Lookup& lookup) {
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

std::optional<Decision> decide(const Rule& rule, const Targets& targets, int frame,
                               const Lookup& lookup) {
  std::vector<InputFile> inputs = inputs_of(rule, targets, frame, lookup);
  std::optional<InputDigests> digests = digests_of(inputs, lookup);
  if (!digests) return {};
  if (rule.obstacles) {
    const auto [first, last] = *rule.obstacles;
    for (auto& obstacles : sequence_inputs(targets, frame + first, frame + last))
      digests->push_back(std::move(obstacles));
  }
  const StageKey& settings = targets.*rule.settings;
  Key key = step_key(settings, rule.step, frame, *digests);
  if (rule.frames == Frames::once) key.parts = parts_of_all(settings, *digests);
  Decision decision = compare(rule.outputs(targets, frame), key, lookup);
  decision.inputs = std::move(inputs);
  return decision;
}

Decision decide_simulation(const Targets& targets, int frame, const Digest& key,
                           const Lookup& lookup) {
  return compare(simulated_files(targets, frame), {key, targets.simulate.parts}, lookup);
}

Decision decide_probes(const Targets& targets, int frame, const Lookup& lookup) {
  Decision latest{false, {{}, targets.simulate.parts}, unchanged};
  for (const std::string& file : probe_files(targets)) {
    const std::optional<KnownFile> known = lookup(file);
    // A record may say anything; keys are made for every frame up to the one it names.
    const bool later = known && known->record.frame > frame &&
                       int64_t(known->record.frame) - targets.first < longest_timeline;
    const int until = later ? known->record.frame : frame;
    const Key key{simulation_keys(targets, until).back(), targets.simulate.parts};
    latest = compare({file}, key, lookup);
    if (!latest.make) continue;
    if (known && known->record.frame < frame) latest.reason = "ends before this frame";
    return latest;
  }
  return latest;
}

std::vector<InputFile> inputs_of(const Rule& rule, const Targets& targets, int frame,
                                 const Lookup& lookup) {
  std::vector<InputFile> files;
  for (const Input& input : rule.inputs) {
    const auto add = [&](int at) {
      for (std::string& file : input.files(targets, at)) files.push_back({std::move(file), at});
    };
    for (const int at : frames_read(rule, input, targets, frame)) add(at);
    const int reach = input.neighbours ? targets.*input.neighbours : 0;
    for (int k = 1; k <= reach && is_current(input, targets, frame - k, lookup); ++k)
      add(frame - k);
    for (int k = 1; k <= reach && is_current(input, targets, frame + k, lookup); ++k)
      add(frame + k);
  }
  return files;
}

std::vector<int> frames_of(const Rule& rule, const Targets& targets, const Lookup& lookup) {
  switch (rule.frames) {
    case Frames::delivered:
      return targets.frames;
    case Frames::from_first: {
      std::vector<int> frames;
      for (int f = targets.first; f <= targets.frames.back(); ++f) frames.push_back(f);
      return frames;
    }
    case Frames::with_neighbours:
      return frames_with_neighbours(rule, targets, lookup);
    case Frames::once:
      return {0};
  }
  return {};
}

}  // namespace drench
