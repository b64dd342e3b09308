#pragma once
// What the executor drives: one simulation, and a frame of meshing or rendering. Every call reads
// files and writes files; nothing is handed on in memory. shot_stages() binds the real libraries.

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/contract/files/files.h"
#include "pipeline/contract/shot/shot.h"
#include "sim/simulator.h"

namespace drench {

/// What a call did: members of a JSON object for stats.jsonl, key=value pairs for the log.
struct StageReport {
  std::string json = "{}";
  std::string line;
  std::vector<WrittenFile> files;
};

/// The state of one simulation; begins before the pre-roll of the shot's first frame.
class Simulation {
 public:
  virtual ~Simulation() = default;
  virtual int frame() const = 0;
  /// How far it is on the way to the next frame, 0 to 1.
  virtual double share_of_frame() const { return 0; }
  /// To the first frame, before it is written; nothing to do after read_checkpoint. @throws as
  /// advance.
  virtual void preroll(const std::function<bool()>& keep_going) = 0;
  /// To the next frame. @throws Stopped when keep_going says so; BlowUp.
  virtual StageReport advance(const std::function<bool()>& keep_going) = 0;
  virtual std::vector<WrittenFile> write_frame(const std::filesystem::path& folder) const = 0;
  /// The probes' files, whole, with every step so far; a shot without probes has none.
  virtual std::vector<WrittenFile> write_probes(const std::filesystem::path&) const { return {}; }
  virtual WrittenFile write_checkpoint(const std::filesystem::path& file) const = 0;
  virtual void read_checkpoint(const std::filesystem::path& file) = 0;
};

/// Names of noisy frames: the one to denoise, and those beside it, the nearest first.
struct NoisyFiles {
  std::string frame;
  std::vector<std::string> before, after;
  std::vector<std::string> all() const;
};

using Attributes = std::vector<std::pair<std::string, std::string>>;

class Stages {
 public:
  virtual ~Stages() = default;
  virtual std::unique_ptr<Simulation> start_simulation() = 0;
  virtual StageReport mesh(const std::filesystem::path& folder, int frame) = 0;
  /// The foam of a frame, from the files of that frame and the one before. Called in order.
  virtual StageReport foam(const std::filesystem::path& folder, int frame) = 0;
  /// @param progress  called with the finished share; may throw Stopped.
  virtual StageReport render(const std::filesystem::path& folder, int frame,
                             const Attributes& attributes,
                             const std::function<void(double)>& progress) = 0;
  /// Makes a frame's image of noisy frames.
  virtual StageReport denoise(const std::filesystem::path& folder, int frame,
                              const NoisyFiles& noisy, const Attributes& attributes) = 0;
  virtual StageReport contact_sheet(const std::filesystem::path& folder,
                                    const std::vector<int>& frames) = 0;
  /// @param keep_going  asked between frames; false throws Stopped.
  virtual StageReport movie(const std::filesystem::path& folder, const std::vector<int>& frames,
                            const std::function<bool()>& keep_going) = 0;
  /// Why a file of the folder cannot be read as what its name says; empty if it can.
  virtual std::string why_unreadable(const std::filesystem::path&) const { return {}; }
};

struct StageOptions {
  Device device = Device::automatic;
  double memory_gib = 0;     // 0: the shot's own limit of surfacing grids stands
  bool progressive = false;  // frames are shown in a PNG as they refine
};

/// The simulator, the surfacing and the renderer of a shot.
std::unique_ptr<Stages> shot_stages(const Shot& shot, const StageOptions& options);

}  // namespace drench
