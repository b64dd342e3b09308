#pragma once
// Frames of a run that could not be made: what does not follow from them goes on.

#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include "pipeline/driver/rules.h"

namespace drench {

/// Safe from several threads.
class Failures {
 public:
  explicit Failures(const Targets& targets) : targets_(targets) {}

  /// A frame of a step failed, for good; of a simulation it takes those after it along.
  void add(Step step, int frame, const std::string& text);
  void succeeded(Step step);
  /// Whether a frame of a rule follows from one that failed.
  bool leave_out(const Rule& rule, int frame) const;
  /// Whether a step has failed so often, one frame after the other, that the rest would too.
  bool are_hopeless() const;
  bool any() const;
  /// What failed first, and how much else.
  std::string text() const;

 private:
  using Made = std::pair<Step, int>;  // a frame of a step
  bool follows(const Rule& rule, int frame) const;
  void find_what_follows();

  const Targets& targets_;
  mutable std::mutex mutex_;
  std::set<Made> failed_, left_out_;
  std::map<Step, int> in_a_row_;
  std::string first_;
};

}  // namespace drench
