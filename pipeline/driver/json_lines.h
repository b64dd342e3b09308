#pragma once
// Files of one JSON object a line that several drivers append to: stats.jsonl, farm/tasks.jsonl.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string_view>
#include <vector>

namespace drench {

/// Appends whole lines, or nothing. @throws Error if that cannot be done.
void append_lines(const std::filesystem::path& file, std::string_view lines);

/// Every line that is whole, in order; none if there is no file. Lines that are no JSON object are
/// left out. @throws Error if the file cannot be read.
std::vector<nlohmann::json> read_json_lines(const std::filesystem::path& file);

}  // namespace drench
