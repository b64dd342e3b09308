#pragma once
// Keys: everything that a file depends on, hashed.
//
//   simulate(f) = H(stage, f, simulate(f - 1))        stage = settings, input files, build, device
//   step(f)     = H(stage, f, digests of inputs)      digests, not keys: inputs that come out the
//                                                     same stop a change from spreading further
//
// Which inputs a step has stands in rules.cpp.

#include <string>
#include <utility>
#include <vector>

#include "pipeline/driver/step.h"
#include "pipeline/driver/targets.h"

namespace drench {

/// A key and what it is made of.
struct Key {
  Digest digest;
  KeyParts parts;
};

/// Names and digests of files, in order.
using InputDigests = std::vector<std::pair<std::string, Digest>>;
/// Of what Targets::sequence has for these frames.
InputDigests sequence_inputs(const Targets& targets, int first, int last);

/// Keys of frames first ... last of the simulation, in order; their parts are
/// targets.simulate.parts.
std::vector<Digest> simulation_keys(const Targets& targets, int last);
/// Key of a step made from files.
Key step_key(const StageKey& stage, Step step, int frame, const InputDigests& inputs);

}  // namespace drench
