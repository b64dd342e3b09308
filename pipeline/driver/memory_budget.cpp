#include "pipeline/driver/memory_budget.h"

#include <algorithm>
#include <chrono>

namespace drench {

MemoryBudget::MemoryBudget(double limit, std::function<double()> resident)
    : limit_(limit), resident_(std::move(resident)) {}

/// The first frame of a step has the process for itself: what it takes is not known before.
bool MemoryBudget::fits(Step step) const {
  if (limit_ <= 0 || in_work_.empty()) return true;
  const auto most = most_.find(step);
  return most != most_.end() && resident_() + most->second <= limit_;
}

void MemoryBudget::sample() {
  if (limit_ <= 0) return;
  const double now = resident_();
  const std::scoped_lock lock(mutex_);
  for (const Frame* frame : in_work_) {
    double& most = most_[frame->step_];
    most = std::max(most, now - frame->before_);
  }
}

MemoryBudget::Frame::Frame(MemoryBudget& budget, Step step, const std::function<bool()>& keep_going)
    : budget_(budget), step_(step) {
  std::unique_lock lock(budget_.mutex_);
  while (!budget_.fits(step) && keep_going())
    budget_.ended_.wait_for(lock, std::chrono::milliseconds(50));
  before_ = budget_.limit_ > 0 ? budget_.resident_() : 0;
  budget_.in_work_.push_back(this);
}

MemoryBudget::Frame::~Frame() {
  budget_.sample();
  const std::scoped_lock lock(budget_.mutex_);
  budget_.in_work_.remove(this);
  budget_.most_.try_emplace(step_, 0);
  budget_.ended_.notify_all();
}

}  // namespace drench
