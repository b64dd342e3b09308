#pragma once
// Restart files of a simulation: every tenth frame, the last three, and one on stop.

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/driver/manifest.h"
#include "pipeline/driver/stages.h"
#include "pipeline/driver/targets.h"

namespace drench {

/// Writes, finds and removes checkpoints of one simulation. The folder's lock is held.
class CheckpointKeeper {
 public:
  /// @param keys  of frames first ... last, simulation_keys().
  CheckpointKeeper(std::filesystem::path folder, Manifest& manifest, const Targets& targets,
                   std::vector<Digest> keys, int every, int kept);

  /// Removes checkpoints of other keys and files that no record names.
  void remove_stale();
  /// Before the files of `frame` are written: writes a checkpoint if one is due, then removes old
  /// ones.
  void before_frame(const Simulation& simulation, int frame);
  /// On stop: the state may stand between `frame`, which is committed, and the next.
  /// @return whether there is something to continue, and so a checkpoint.
  bool on_stop(const Simulation& simulation, int frame);
  /// The file of the last one; empty if there is none.
  std::filesystem::path last_good() const;

 private:
  std::vector<Record> on_frames() const;  // sorted by frame
  void write(const Simulation& simulation, int frame, const std::string& file);
  void remove(const std::string& file);
  void remove_unlisted();

  const std::filesystem::path folder_;
  Manifest& manifest_;
  const int first_;
  const std::vector<Digest> keys_;
  const KeyParts parts_;
  const int every_, kept_;
};

}  // namespace drench
