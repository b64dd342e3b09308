#pragma once
// Log lines on stderr: seconds since the start, the part, then key=value pairs.
// 12.204 sim frame=37 particles=4.10M substeps=6 density_error=0.0008 ms=318

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace drench {

enum class LogLevel { quiet, normal, verbose };
void set_log_level(LogLevel level);
void log_info(std::string_view part, std::string_view text);
void log_error(std::string_view part, std::string_view text);    // always shown
void log_verbose(std::string_view part, std::string_view text);  // shown with -v

/// What was dropped, guessed or mended: what, where, how many, what to do. Written once a cause;
/// later ones of the same cause are counted.
/// @param cause  the text itself if empty. A warning that a sequence would repeat with every frame
///               names what they have in common.
/// @throws Error with the text where warnings are errors.
void log_warning(std::string_view part, std::string_view text, std::string_view cause = {});

/// "FILE: text", of a file that may be one of a sequence: what differs in digits alone, of the text
/// or the file's name, is one cause.
void log_file_warning(std::string_view part, const std::filesystem::path& file,
                      std::string_view text);

enum class OnWarning { go_on, fail };
void set_on_warning(OnWarning what);

struct LoggedWarning {
  std::string part, text, cause;
  uint64_t times = 0;
};
/// All since the start of the process or the last call of forget_warnings, the first first.
std::vector<LoggedWarning> logged_warnings();
void forget_warnings();

}  // namespace drench
