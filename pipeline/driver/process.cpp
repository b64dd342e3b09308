#include "pipeline/driver/process.h"

#include <pmmintrin.h>
#include <signal.h>
#include <tbb/task_scheduler_observer.h>
#include <unistd.h>
#include <xmmintrin.h>

#include <atomic>
#include <cstdio>

namespace drench {

namespace {

std::atomic<int> stops{0};
static_assert(std::atomic<int>::is_always_lock_free, "written by a signal handler");

void flush_denormals() {
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
}

void on_stop(int) {
  constexpr int stopped_exit_code = 75;
  if (stops.fetch_add(1) > 0) ::_exit(stopped_exit_code);
}

}  // namespace

class ArithmeticMode::Observer : public tbb::task_scheduler_observer {
 public:
  Observer() { observe(true); }
  explicit Observer(tbb::task_arena& arena) : tbb::task_scheduler_observer(arena) { observe(true); }
  ~Observer() override { observe(false); }
  void on_scheduler_entry(bool) override { flush_denormals(); }
};

ArithmeticMode::ArithmeticMode() {
  flush_denormals();
  observer_ = std::make_unique<Observer>();
}
ArithmeticMode::ArithmeticMode(tbb::task_arena& arena) {
  flush_denormals();
  observer_ = std::make_unique<Observer>(arena);
}
ArithmeticMode::~ArithmeticMode() = default;

void install_signal_handlers() {
  struct sigaction action {};
  action.sa_handler = on_stop;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
}

bool stop_requested() { return stops.load() > 0; }

uint64_t resident_memory() {
  std::FILE* file = std::fopen("/proc/self/statm", "re");
  if (!file) return 0;
  unsigned long long total = 0, resident = 0;
  const int count = std::fscanf(file, "%llu %llu", &total, &resident);
  std::fclose(file);
  return count == 2 ? resident * uint64_t(::sysconf(_SC_PAGESIZE)) : 0;
}

}  // namespace drench
