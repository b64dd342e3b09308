#pragma once
// The dependency graph as data: a rule for each step, as a makefile has them. The function that
// makes a rule's files stands in make.cpp. The simulation has no rule: its frames are a chain that
// starts at a checkpoint.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/driver/targets.h"

namespace drench {

/// Names of files of a frame; none where the shot has no such file.
using FilesOf = std::vector<std::string> (*)(const Targets& targets, int frame);

/// Frames first ... last, counted from the one that is made.
struct Offsets {
  int first = 0, last = 0;
};

/// Files of a step that another reads.
struct Input {
  Step step;
  FilesOf files;
  Offsets frames = {};
  int Targets::*neighbours = nullptr;  // and up to so many frames on either side that are current
};

/// What a shot or a run must have for a rule to apply.
struct Condition {
  bool (*holds)(const Targets& targets);
  std::string_view otherwise;  // why its tasks are skipped; empty: there are none
};

/// The frames of which a rule makes files.
enum class Frames {
  delivered,
  from_first,       // to the last delivered, in order: each is made of the one before
  with_neighbours,  // delivered, and those there already that have these for neighbours
  once              // one file, with frame 0, of all that are delivered
};

struct Rule {
  Step step;
  Frames frames;
  std::vector<Condition> when;
  std::vector<Input> inputs;
  FilesOf outputs;
  StageKey Targets::*settings;          // part of the key
  std::optional<Offsets> obstacles;     // frames whose files of obstacles are part of the key
  std::string_view inputs_missing;      // says that of a frame
  std::string_view used_as_they_are{};  // says that of frames made with other settings
};

/// In order of step: a rule reads what those before it make.
const std::vector<Rule>& rules();
/// @param step  any but the simulation.
const Rule& rule_of(Step step);

/// Whether a step makes files of single frames.
bool is_per_frame(Step step);
/// Why there is nothing for a rule to make; nothing if it applies.
std::optional<std::string_view> reason_to_skip(const Rule& rule, const Targets& targets);
/// Whether this run may carry a rule out.
bool is_active(const Rule& rule, const Targets& targets);

/// Files a frame of the simulation consists of: particles if there is fluid, one for each sheet.
std::vector<std::string> simulated_files(const Targets& targets, int frame);
/// Files of the probes, which hold every frame up to the one they are recorded with.
std::vector<std::string> probe_files(const Targets& targets);
/// The file that rendering a frame makes: the image, or a noisy frame to be denoised later.
std::string render_file(const Targets& targets, int frame);

/// Frames of whose files a rule reads an input, but for neighbours, and with all that there may be.
std::vector<int> frames_read(const Rule& rule, const Input& input, const Targets& targets,
                             int frame);
std::vector<int> possible_frames(const Rule& rule, const Input& input, const Targets& targets,
                                 int frame);
/// Everything that a rule may read for a frame, whether it is there or not.
std::vector<std::string> possible_inputs(const Rule& rule, const Targets& targets, int frame);

}  // namespace drench
