#include "tests/bench/instructions.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace drench::bench {

namespace {
constexpr const char* variable = "DRENCH_BENCH_COUNT";
}

/// callgrind counts from where this is entered to where it is left.
extern "C" __attribute__((noinline)) void drench_bench_counted(const std::function<void()>& work) {
  work();
  asm volatile("");  // or the call above would be a jump, and this never be left
}

const char* variant_to_count() { return std::getenv(variable); }

void count_instructions(const std::function<void()>& work) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  drench_bench_counted(work);
}

double instructions(const std::string& case_name, const std::string& variant) {
  const std::string self = std::filesystem::read_symlink("/proc/self/exe");
  const std::string command = fmt::format(
      "{}='{}' valgrind --tool=callgrind --callgrind-out-file=/dev/null "
      "--toggle-collect=drench_bench_counted '{}' {} 2>&1",
      variable, variant, self, case_name);
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) throw std::runtime_error(case_name + ": valgrind cannot be started");
  std::string said;
  for (int c; (c = std::fgetc(pipe)) != EOF;) said += char(c);
  const size_t found = said.find("Collected : ");
  if (pclose(pipe) != 0 || found == std::string::npos)
    throw std::runtime_error(case_name + ": valgrind failed (./bench installs it): " + said);
  const double count = std::stod(said.substr(found + 12));
  if (!(count > 0)) throw std::runtime_error(case_name + ": no instruction was counted: " + said);
  return count;
}

}  // namespace drench::bench
