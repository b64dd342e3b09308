#pragma once
// Runs a plan in one process: a thread and a TBB arena for each stage, at most two frames queued
// between stages. A frame is meshed when its caches are committed and rendered when its mesh is.

#include <filesystem>
#include <functional>

#include "pipeline/driver/inputs.h"
#include "pipeline/driver/plan.h"
#include "pipeline/driver/progress.h"
#include "pipeline/driver/stages.h"

namespace drench {

struct ExecuteOptions {
  int threads = 0;            // 0: all cores
  double memory_gib = 0;      // 0: no limit; above it the run stops
  int checkpoint_every = 10;  // frames
  int checkpoints_kept = 3;
  int retry = 0;                         // times that a frame is tried again which failed
  std::function<bool()> stop_requested;  // asked often; nothing: never
  double patience_s = 8;  // after a stop: how long to wait for a mesh that cannot be interrupted
  std::function<void()> abandon;  // called when that is over; everything committed is safe
};

/// Brings the folder to its targets. A frame that cannot be made stops only what follows from it,
/// unless three of a step fail one after the other.
/// @param manifest  open for append, the folder's lock held.
/// @throws Stopped after a stop request; DamagedInput; Error of a stage or when memory or threads
/// are
///         short. The simulation wrote a checkpoint before if it had work to lose.
void execute(const Targets& targets, const Plan& plan, const std::filesystem::path& folder,
             Manifest& manifest, Stages& stages, Progress& progress, const ExecuteOptions& options);

}  // namespace drench
