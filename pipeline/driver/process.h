#pragma once
// What is set once for the whole process: floating-point mode, signals, memory watch.

#include <tbb/task_arena.h>

#include <cstdint>
#include <memory>

namespace drench {

/// Sets flush-to-zero and denormals-are-zero for this thread and, while it lives, every thread of
/// TBB that works for it (in its implicit arena) or in the arena given: a result must not depend on
/// which thread computed it. Threads started by this one inherit the mode.
class ArithmeticMode {
 public:
  ArithmeticMode();
  explicit ArithmeticMode(tbb::task_arena& arena);
  ~ArithmeticMode();
  ArithmeticMode(const ArithmeticMode&) = delete;
  ArithmeticMode& operator=(const ArithmeticMode&) = delete;

 private:
  class Observer;
  std::unique_ptr<Observer> observer_;
};

/// SIGINT and SIGTERM ask for a stop; a second one ends the process at once, which loses no file.
/// SIGPIPE and SIGXFSZ are ignored, so that the failing write itself says what is wrong.
void install_signal_handlers();
bool stop_requested();

/// Resident memory of this process in bytes; 0 if unknown.
uint64_t resident_memory();

}  // namespace drench
