#pragma once
// Stages overlap as long as their frames fit into memory together; else they take turns.

#include <condition_variable>
#include <functional>
#include <list>
#include <map>
#include <mutex>

#include "pipeline/driver/step.h"

namespace drench {

/// Safe from several threads.
class MemoryBudget {
 public:
  /// @param limit  bytes; 0: none, and nothing ever waits.
  /// @param resident  bytes that the process has now.
  MemoryBudget(double limit, std::function<double()> resident);

  /// A frame in work, for as long as it lives.
  class Frame {
   public:
    Frame(MemoryBudget& budget, Step step, const std::function<bool()>& keep_going);
    ~Frame();
    Frame(const Frame&) = delete;
    Frame& operator=(const Frame&) = delete;

   private:
    friend class MemoryBudget;
    MemoryBudget& budget_;
    const Step step_;
    double before_ = 0;  // bytes, when it began
  };

  /// To be called now and then: how much frames in work have grown the process by.
  void sample();

 private:
  bool fits(Step step) const;

  const double limit_;
  const std::function<double()> resident_;
  std::mutex mutex_;
  std::condition_variable ended_;
  std::list<Frame*> in_work_;
  std::map<Step, double>
      most_;  // bytes that a frame of a step took; what ran beside it may be in it
};

}  // namespace drench
