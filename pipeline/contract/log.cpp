#include "pipeline/contract/log.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <mutex>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/printable.h"

namespace drench {

namespace {

std::atomic<LogLevel> level{LogLevel::normal};
std::atomic<OnWarning> on_warning{OnWarning::go_on};
const auto start = std::chrono::steady_clock::now();

std::mutex warnings_mutex;
std::vector<LoggedWarning> warnings;

/// Whether it is the first of its cause.
bool remember(std::string_view part, std::string_view text, std::string_view cause) {
  const std::scoped_lock lock(warnings_mutex);
  const auto known = std::find_if(warnings.begin(), warnings.end(),
                                  [&](const LoggedWarning& w) { return w.cause == cause; });
  if (known != warnings.end()) {
    ++known->times;
    return false;
  }
  warnings.push_back({std::string(part), std::string(text), std::string(cause), 1});
  return true;
}

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

void log_error(std::string_view part, std::string_view text) { write_line(part, "", text); }

void log_verbose(std::string_view part, std::string_view text) {
  if (level == LogLevel::verbose) write_line(part, "", text);
}

void log_warning(std::string_view part, std::string_view text, std::string_view cause) {
  if (on_warning == OnWarning::fail) throw Error(std::string(text));
  if (remember(part, text, cause.empty() ? text : cause)) write_line(part, "warning: ", text);
}

void log_file_warning(std::string_view part, const std::filesystem::path& file,
                      std::string_view text) {
  std::string cause = file.filename().string() + ": " + std::string(text);
  std::replace_if(
      cause.begin(), cause.end(), [](char c) { return c >= '0' && c <= '9'; }, '#');
  cause.erase(
      std::unique(cause.begin(), cause.end(), [](char a, char b) { return a == '#' && b == '#'; }),
      cause.end());
  log_warning(part, file.string() + ": " + std::string(text),
              (file.parent_path() / cause).string());
}

void set_on_warning(OnWarning what) { on_warning = what; }

std::vector<LoggedWarning> logged_warnings() {
  const std::scoped_lock lock(warnings_mutex);
  return warnings;
}

void forget_warnings() {
  const std::scoped_lock lock(warnings_mutex);
  warnings.clear();
}

}  // namespace drench
