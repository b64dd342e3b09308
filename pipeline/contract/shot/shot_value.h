#pragma once
// One value of a shot: from TOML into its field with every check of its row, and back to TOML.

#include <filesystem>
#include <string>

#include "pipeline/contract/shot/shot_table.h"
#include "pipeline/contract/shot/toml.h"

namespace drench::shot_table {

/// Where a value stands, for errors and for relative paths.
struct Site {
  std::string where;             // "shots/dam.toml:14" or "--set fluid.spacing=-1"
  std::string key;               // "cloth[0].cells"
  std::filesystem::path folder;  // paths in the value are relative to it
};

/// @throws Error naming place, key, value and limits when the value does not fit the row.
void read_value(const Parameter& parameter, void* field, const toml::node& value, const Site& site);
/// What grid_pins says. @throws Error as above.
std::vector<GridPins> read_grid_pins(const Parameter& parameter, const toml::node& value,
                                     const Site& site);

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
