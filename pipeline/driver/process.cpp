#include "pipeline/driver/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pmmintrin.h>
#include <signal.h>
#include <sys/resource.h>
#include <tbb/task_scheduler_observer.h>
#include <unistd.h>
#include <xmmintrin.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <latch>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include "pipeline/contract/error.h"

namespace drench {

namespace {

std::atomic<int> stops{0};
static_assert(std::atomic<int>::is_always_lock_free, "written by a signal handler");

void flush_denormals() {
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
}

std::atomic<int> graceful{0};
constexpr int stopped_exit_code = 75;

void on_stop(int) {
  if (graceful > 0 && stops.fetch_add(1) == 0) return;
  constexpr std::string_view words = "drench: stopped on request\n";
  if (graceful == 0) (void)!::write(STDERR_FILENO, words.data(), words.size());
  ::_exit(stopped_exit_code);
}

std::terminate_handler terminate_before = nullptr;

/// The system's lack of threads is the user's to mend; anything else is a bug and aborts.
[[noreturn]] void on_terminate() {
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) {
      constexpr std::string_view words =
          "drench: the system gives no more threads; raise the limit of processes (ulimit -u)\n";
      (void)!::write(STDERR_FILENO, words.data(), words.size());
      ::_exit(1);
    }
  } catch (...) {
  }
  if (terminate_before) terminate_before();
  std::abort();
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

void open_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    // The wrong way round: who asks for output and closed it is told that it went nowhere.
    const int flags = stream == STDIN_FILENO ? O_WRONLY : O_RDONLY;
    if (::open("/dev/null", flags) < 0) (void)!::open("/", O_PATH);
  }
}

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

GracefulStop::GracefulStop() { ++graceful; }
GracefulStop::~GracefulStop() { --graceful; }
bool stop_requested() { return stops.load() > 0; }

void explain_missing_threads() { terminate_before = std::set_terminate(on_terminate); }

void check_threads(int count) {
  std::vector<std::thread> threads;
  threads.reserve(size_t(count));
  std::latch all(1);
  try {
    for (int k = 0; k < count; ++k) threads.emplace_back([&all] { all.wait(); });
  } catch (const std::system_error&) {
  }
  all.count_down();
  for (std::thread& thread : threads) thread.join();
  if (int(threads.size()) == count) return;
  throw Error(
      fmt::format("the system gives {} of the {} threads a run takes; raise the limit of "
                  "processes (ulimit -u), or give --threads fewer",
                  threads.size(), count));
}

uint64_t peak_memory() {
  rusage usage{};
  return ::getrusage(RUSAGE_SELF, &usage) == 0 ? uint64_t(usage.ru_maxrss) * 1024 : 0;
}

uint64_t resident_memory() {
  std::FILE* file = std::fopen("/proc/self/statm", "re");
  if (!file) return peak_memory();
  unsigned long long total = 0, resident = 0;
  const int count = std::fscanf(file, "%llu %llu", &total, &resident);
  std::fclose(file);
  return count == 2 ? resident * uint64_t(::sysconf(_SC_PAGESIZE)) : 0;
}

}  // namespace drench
