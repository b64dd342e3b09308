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

/// Opens descriptors 0 to 2 where the caller closed them: the first file opened would get one of
/// these numbers, and lines for the terminal would go into it. Reading and writing them fails.
void open_standard_streams();

/// SIGINT and SIGTERM end the process at once with a line on stderr and exit code 75, unless a
/// GracefulStop lives. SIGPIPE and SIGXFSZ are ignored, so that the failing write itself says what
/// is wrong.
void install_signal_handlers();

/// While it lives, SIGINT and SIGTERM ask for a stop; a second one ends the process at once, which
/// loses no file.
class GracefulStop {
 public:
  GracefulStop();
  ~GracefulStop();
  GracefulStop(const GracefulStop&) = delete;
  GracefulStop& operator=(const GracefulStop&) = delete;
};
bool stop_requested();

/// From now on a thread that cannot be started where no one can catch it, within a library, ends
/// the process with a message and exit code 1 instead of an abort.
void explain_missing_threads();

/// Starts as many threads and ends them again: what a library starts cannot be caught.
/// @throws Error if the system does not give them.
void check_threads(int count);

/// Resident memory of this process in bytes; the most there was so far where the system has no
/// /proc.
uint64_t resident_memory();
/// The most that this process had resident so far, in bytes.
uint64_t peak_memory();

}  // namespace drench
