#pragma once
// A shot whose stages are a few lines of arithmetic on small files, so that a test can count calls,
// order them, fail them and make inputs come out the same. Only the executor's own rules are tested
// with it; the program is tested with the real stages.

#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "pipeline/driver/execute.h"
#include "pipeline/driver/layout.h"

namespace drench::test {

struct ToySettings {
  int first = 1, last = 25;
  std::vector<int> frames;  // empty: all
  double growth = 3.7;      // of the logistic map: chaotic, so that one lost bit shows
  int mesh_digits = 6;      // digits of the state that the mesh keeps
  std::string camera = "left";
  std::string program = "1";
  bool fluid = true;
  bool foam = false;
  bool obstacles_move = false;
  int denoise_frames = 0;
  double foam_rate = 0.25;
  std::vector<Step> steps{Step::simulate, Step::mesh, Step::render, Step::contact_sheet};
};

Targets toy_targets(const ToySettings& settings);

enum class Mark { begin, end };

/// What happened, in order: (simulate, 3, begin).
struct Event {
  Step step;
  int frame;
  Mark mark;
};

class ToyStages : public Stages {
 public:
  explicit ToyStages(ToySettings settings) : settings_(std::move(settings)) {}

  std::unique_ptr<Simulation> start_simulation() override;
  StageReport mesh(const std::filesystem::path& folder, int frame) override;
  StageReport foam(const std::filesystem::path& folder, int frame) override;
  StageReport render(const std::filesystem::path& folder, int frame, const Attributes& attributes,
                     const std::function<void(double)>& progress) override;
  StageReport denoise(const std::filesystem::path& folder, int frame, const NoisyFiles& noisy,
                      const Attributes& attributes) override;
  StageReport contact_sheet(const std::filesystem::path& folder,
                            const std::vector<int>& frames) override;
  StageReport movie(const std::filesystem::path& folder, const std::vector<int>& frames,
                    const std::function<bool()>& keep_going) override;

  std::string why_unreadable(const std::filesystem::path& file) const override {
    return !unreadable.empty() && file.string().ends_with(unreadable) ? "it is torn" : "";
  }

  void log(Step step, int frame, Mark mark);
  std::vector<Event> events() const;
  int count(Step step) const;  // calls
  std::vector<int> frames(Step step) const;

  /// Called at the beginning of a step; may wait or throw.
  std::function<void(Step, int)> hook;
  std::string unreadable;  // a file that no stage can read, however often it is made

 private:
  const ToySettings settings_;
  mutable std::mutex mutex_;
  std::vector<Event> events_;
};

/// Plans and executes in `folder` until nothing is left, as the program does.
/// @return the first plan.
Plan make_toy(const ToySettings& settings, ToyStages& stages, const std::filesystem::path& folder,
              ExecuteOptions options = {});

/// Digests of all files a manifest lists, but checkpoints made on stop.
std::map<std::string, std::string> digests_in(const std::filesystem::path& folder);

}  // namespace drench::test
