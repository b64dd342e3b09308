#pragma once
// Log lines on stderr: seconds since the start, the part, then key=value pairs.
// 12.204 sim frame=37 particles=4.10M substeps=6 density_error=0.0008 ms=318

#include <string_view>

namespace drench {

enum class LogLevel { quiet, normal, verbose };
void set_log_level(LogLevel level);
void log_info(std::string_view part, std::string_view text);
void log_verbose(std::string_view part, std::string_view text);  // shown with -v
void log_warning(std::string_view part, std::string_view text);

}  // namespace drench
