#pragma once
// Values, rows and names of a shot as text, without toml++.

#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/shot/shot_table.h"

namespace drench::shot_table {

/// The value as TOML; reading it gives the same bits. Empty for an absent path or box and for an
/// empty list, which are left out.
std::string value_text(const Parameter& parameter, const void* field);

/// The text with '?' for control characters: it may go to a terminal, and a NUL would end it.
std::string printable(std::string text);

/// Why a shot cannot have this name, or null when it can.
const char* file_name_problem(std::string_view name);

/// "a number in m" and the like, and the limits in words, for errors and the reference.
std::string kind_text(const Parameter& parameter);
std::string limits_text(const Parameter& parameter);

/// The word of `words` that is most like `word` or has it as a part ("fov": "fov_deg"), or empty
/// when none is near.
std::string_view nearest_word(std::string_view word, const std::vector<std::string_view>& words);

}  // namespace drench::shot_table
