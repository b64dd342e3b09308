#pragma once
// One value of a shot: from TOML into its field with every check of its row.

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

/// @throws Error naming location, key, value and limits when the value does not fit the row.
void read_value(const Parameter& parameter, void* field, const toml::node& value, const Site& site);
/// What grid_pins says. @throws Error as above.
std::vector<GridPins> read_grid_pins(const Parameter& parameter, const toml::node& value,
                                     const Site& site);

}  // namespace drench::shot_table
