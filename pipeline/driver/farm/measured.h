#pragma once
// What the steps of a shot took so far, by stats.jsonl: time left is told by it, and memory asked
// for.

#include <filesystem>
#include <map>

#include "pipeline/driver/step.h"

namespace drench {

struct Measured {
  int frames = 0;          // that were made, again ones included
  double mean_s = 0;       // a frame, of wall time
  double peak_memory = 0;  // bytes, of the process that made them: other steps may be in it
};

/// What is asked for over what was measured: frames differ.
inline constexpr double memory_margin = 1.25;

/// By step; those that never ran are left out. @throws Error if the file cannot be read.
std::map<Step, Measured> measured_steps(const std::filesystem::path& stats);

}  // namespace drench
