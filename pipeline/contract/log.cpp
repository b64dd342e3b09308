#include "pipeline/contract/log.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstdio>

#include "pipeline/contract/printable.h"

namespace drench {

namespace {

std::atomic<LogLevel> level{LogLevel::normal};
const auto start = std::chrono::steady_clock::now();

// One fwrite a line: stderr is unbuffered, so lines of two threads do not mix.
void write_line(std::string_view part, std::string_view mark, std::string_view text) {
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - start;
  const std::string line =
      fmt::format("{:.3f} {} {}{}\n", since.count(), part, mark, printable(text, Lines::one));
  std::fwrite(line.data(), 1, line.size(), stderr);
}

}  // namespace

void set_log_level(LogLevel new_level) { level = new_level; }

void log_info(std::string_view part, std::string_view text) {
  if (level != LogLevel::quiet) write_line(part, "", text);
}

void log_verbose(std::string_view part, std::string_view text) {
  if (level == LogLevel::verbose) write_line(part, "", text);
}

void log_warning(std::string_view part, std::string_view text) {
  write_line(part, "warning: ", text);
}

}  // namespace drench
