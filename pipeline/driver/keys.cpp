#include "pipeline/driver/keys.h"

namespace drench {

InputDigests sequence_inputs(const Targets& targets, int first, int last) {
  InputDigests inputs;
  for (auto at = targets.sequence.lower_bound(first);
       at != targets.sequence.end() && at->first <= last; ++at)
    inputs.emplace_back("obstacles of frame " + std::to_string(at->first), at->second);
  return inputs;
}

std::vector<Digest> simulation_keys(const Targets& targets, int last) {
  std::vector<Digest> keys;
  Digest before;
  for (int frame = targets.first; frame <= last; ++frame) {
    Hasher hasher;
    hasher.text(step_name(Step::simulate)).digest(targets.simulate.digest);
    hasher.value(frame).digest(before);
    // A checkpoint may stand between this frame and the next.
    for (const auto& [name, digest] : sequence_inputs(targets, frame, frame + 1))
      hasher.digest(digest);
    before = hasher.finish();
    keys.push_back(before);
  }
  return keys;
}

Key step_key(const StageKey& stage, Step step, int frame, const InputDigests& inputs) {
  Key key{{}, stage.parts};
  Hasher hasher;
  hasher.text(step_name(step)).digest(stage.digest).value(frame);
  for (const auto& [name, digest] : inputs) {
    hasher.text(name).digest(digest);
    key.parts[name] = short_hex(digest);
  }
  key.digest = hasher.finish();
  return key;
}

}  // namespace drench
