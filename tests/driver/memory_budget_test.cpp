#include "pipeline/driver/memory_budget.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

namespace drench {
namespace {

using namespace std::chrono_literals;
using Frame = MemoryBudget::Frame;

bool always() { return true; }

/// Tries to begin a frame in a thread of its own.
class Beginner {
 public:
  Beginner(MemoryBudget& budget, Step step)
      : thread_([this, &budget, step] {
          const Frame frame(budget, step, [this] { return !stop_.load(); });
          begun_ = true;
          while (!stop_) std::this_thread::sleep_for(1ms);
        }) {}
  ~Beginner() {
    stop_ = true;
    thread_.join();
  }
  bool begins_within(std::chrono::milliseconds time) const {
    const auto end = std::chrono::steady_clock::now() + time;
    while (!begun_ && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(1ms);
    return begun_;
  }

 private:
  std::atomic<bool> begun_{false}, stop_{false};
  std::thread thread_;
};

struct Process {
  std::atomic<double> resident{100};
  std::function<double()> asked() {
    return [this] { return resident.load(); };
  }
};

TEST(MemoryBudget, NeverWaitsWithoutALimit) {
  Process process;
  MemoryBudget budget(0, process.asked());
  const Frame first(budget, Step::render, always);
  EXPECT_TRUE(Beginner(budget, Step::render).begins_within(5s));
}

TEST(MemoryBudget, LetsFramesOverlapThatFitTogether) {
  Process process;
  MemoryBudget budget(1000, process.asked());
  {
    const Frame alone(budget, Step::render, always);  // takes 300
    process.resident = 400;
    budget.sample();
    process.resident = 100;
  }
  const Frame first(budget, Step::render, always);
  process.resident = 400;
  EXPECT_TRUE(Beginner(budget, Step::render).begins_within(5s));
}

TEST(MemoryBudget, MakesFramesTakeTurnsThatDoNot) {
  Process process;
  MemoryBudget budget(500, process.asked());
  auto first = std::make_unique<Frame>(budget, Step::render, always);
  process.resident = 400;
  budget.sample();
  const Beginner second(budget, Step::render);
  EXPECT_FALSE(second.begins_within(200ms));
  process.resident = 100;
  first.reset();
  EXPECT_TRUE(second.begins_within(5s));
}

TEST(MemoryBudget, LearnsWhatAStepTakesByItsFirstFrameAlone) {
  Process process;
  MemoryBudget budget(1000, process.asked());
  auto mesh = std::make_unique<Frame>(budget, Step::mesh, always);
  const Beginner render(budget, Step::render);
  EXPECT_FALSE(render.begins_within(200ms));
  mesh.reset();
  EXPECT_TRUE(render.begins_within(5s));
}

TEST(MemoryBudget, WaitsNoLongerThanTheRunGoesOn) {
  Process process;
  MemoryBudget budget(150, process.asked());
  const Frame first(budget, Step::render, always);
  const Frame second(budget, Step::render, [] { return false; });
}

}  // namespace
}  // namespace drench
