#pragma once
// Makes a rule's files of a frame. make.cpp holds, for each rule, the function that does it.

#include <functional>

#include "pipeline/driver/decide.h"
#include "pipeline/driver/stage_runner.h"

namespace drench {

/// Who carries a step's rule out.
Worker worker_of(Step step);

/// Safe from several threads.
class Maker {
 public:
  /// @param stopping  asked now and then: whether the run is to end.
  Maker(const Targets& targets, const std::filesystem::path& folder, Manifest& manifest,
        Stages& stages, Progress& progress, StageRunner& runner, std::function<bool()> stopping);
  Maker(const Maker&) = delete;
  Maker& operator=(const Maker&) = delete;

  /// Makes them unless they are there with the key they should have.
  /// @throws DamagedInput if an input is missing or damaged; Stopped; Error of the stage
  void make(const Rule& rule, int frame);

  /// Files of the folder as the live manifest has them.
  const Lookup& lookup() const { return lookup_; }

 private:
  friend struct Recipes;  // the functions by step
  StageReport mesh(int frame, const Decision& decision);
  StageReport foam(int frame, const Decision& decision);
  StageReport render(int frame, const Decision& decision);
  StageReport denoise(int frame, const Decision& decision);
  StageReport contact_sheet(int frame, const Decision& decision);
  StageReport movie(int frame, const Decision& decision);
  bool is_held(int frame) const;
  StageReport held_mesh(int frame);

  const Targets& targets_;
  const std::filesystem::path folder_;
  Manifest& manifest_;
  Stages& stages_;
  Progress& progress_;
  StageRunner& runner_;
  const std::function<bool()> stopping_;
  const Lookup lookup_;
};

}  // namespace drench
