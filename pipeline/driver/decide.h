#pragma once
// Whether files must be made: the key they should have against the one they are recorded with.
// Pure: no input, no output.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/driver/keys.h"
#include "pipeline/driver/output_folder.h"
#include "pipeline/driver/rules.h"

namespace drench {

/// How a file is found: in a snapshot when planning, in the live manifest when executing.
using Lookup = std::function<std::optional<KnownFile>(const std::string& file)>;
/// Whether a file is there and is what was recorded.
bool is_intact(const std::string& file, const Lookup& lookup);

/// A file that a rule reads, and whose frame it is.
struct InputFile {
  std::string name;
  int frame = 0;
};

/// Whether files must be made, the key they get, and why.
struct Decision {
  bool make = false;
  Key key;
  std::string reason;
  std::vector<InputFile> inputs = {};  // that a rule makes them from
};
inline constexpr const char* unchanged = "key unchanged";

/// Compares files with the key they should have. The first that does not match gives the reason.
Decision compare(const std::vector<std::string>& files, const Key& key, const Lookup& lookup);

/// Of a rule's files of a frame. Empty if an input is missing or damaged.
std::optional<Decision> decide(const Rule& rule, const Targets& targets, int frame,
                               const Lookup& lookup);
/// Of a frame of the simulation. @param key  of simulation_keys()
Decision decide_simulation(const Targets& targets, int frame, const Digest& key,
                           const Lookup& lookup);
/// Whether the probes' files must be written when the simulation stands at `frame`: they hold every
/// frame up to the one they are recorded with, which may be a later one.
Decision decide_probes(const Targets& targets, int frame, const Lookup& lookup);

/// Files that a rule reads for a frame, in the order in which its key has them: of neighbours those
/// before the frame and then those after it, the nearest first. A neighbour is delivered by this
/// run, or there as the shot has it now; none counts beyond one that is neither.
std::vector<InputFile> inputs_of(const Rule& rule, const Targets& targets, int frame,
                                 const Lookup& lookup);
/// Frames of which a rule makes files.
std::vector<int> frames_of(const Rule& rule, const Targets& targets, const Lookup& lookup);

}  // namespace drench
