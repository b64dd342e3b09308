#pragma once
// Wanted state + what lies there -> what to do, each with its reason. Pure: no input, no output.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/driver/output_folder.h"
#include "pipeline/driver/wanted.h"

namespace drench {

enum class Action {
  run,
  skip,
  depends  // runs if a step before it changes the file it reads
};
std::string_view action_name(Action action);

/// One step of one frame; the contact sheet and the movie have frame 0.
struct Task {
  Step step = Step::simulate;
  int frame = 0;
  Action action = Action::skip;
  std::string reason;
};

/// Where the simulation starts and how far it must go.
struct SimulationSpan {
  bool needed = false;
  std::string checkpoint;  // file, empty: from the initial state
  int from = 0;            // frame of the state it starts with
  int last = 0;            // last frame that is not there
};

struct Plan {
  SimulationSpan simulation;
  std::vector<Task> tasks;            // in order of step, then frame
  std::vector<std::string> problems;  // inputs that no allowed step makes: nothing can run
  std::vector<std::string> warnings;
  std::vector<std::string> beyond;  // listed files of frames outside the timeline or not wanted

  bool nothing_to_do() const;
};

/// How a file is found: in a snapshot when planning, in the live manifest when executing.
using Lookup = std::function<std::optional<KnownFile>(const std::string& file)>;

/// Whether a step must run, the key its files get, and why.
struct Decision {
  bool make = false;
  Key key;
  std::string reason;
};

/// Names of noisy frames.
struct NoisyFiles {
  std::string frame;
  std::vector<std::string> before, after;
  std::vector<std::string> all() const;
};

/// Compares files with the key they should have. The first that does not match gives the reason.
Decision decide(const std::vector<std::string>& files, const Key& key, const Lookup& lookup);

/// The steps that the records of probes' files and of checkpoints name.
inline constexpr const char* probe_step = "probe";
inline constexpr const char* checkpoint_step = "checkpoint";

/// Whether the probes' files must be written when the simulation stands at `frame`: they hold every
/// frame up to the one they are recorded with, which may be a later one.
Decision decide_probes(const Wanted& wanted, int frame, const Lookup& lookup);
/// Decisions of one frame. Empty if an input is missing or damaged.
std::optional<Decision> decide_mesh(const Wanted& wanted, int frame, const Lookup& lookup);
std::optional<Decision> decide_foam(const Wanted& wanted, int frame, const Lookup& lookup);
std::optional<Decision> decide_render(const Wanted& wanted, int frame, const Lookup& lookup);
/// Noisy frames that a frame is denoised by, the nearest first on either side. A neighbour is one
/// of the frames wanted or lies there as the shot has it now; none counts beyond one that does not.
NoisyFiles denoise_inputs(const Wanted& wanted, int frame, const Lookup& lookup);
std::optional<Decision> decide_denoise(const Wanted& wanted, int frame, const Lookup& lookup);
/// Frames to denoise: those wanted, and beside them those that lie there already and have them for
/// neighbours now.
std::vector<int> denoised_frames(const Wanted& wanted, const Lookup& lookup);
/// Contact sheet or movie of all wanted frames.
std::optional<Decision> decide_dailies(const Wanted& wanted, Step step, const Lookup& lookup);

Plan make_plan(const Wanted& wanted, const Snapshot& snapshot, int timeline_last);

/// One line for each run of frames with the same action and reason.
std::string plan_text(const Plan& plan);
/// {"tasks": [{"step", "frame", "action", "reason"}], "simulation": {...}, ...}, a task a line,
/// handed on piece by piece: a million frames are half a gigabyte.
/// @param scene  a JSON object for "scene"; empty: none
void write_plan_json(const Plan& plan, const std::string& scene,
                     const std::function<void(std::string_view)>& write);

}  // namespace drench
