#pragma once
// What commands print for a reader or a program.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace drench {

/// @throws Error if standard output takes no more.
void print(std::string_view text);

/// A JSON value on one line; bytes of file names that are not UTF-8 become U+FFFD.
std::string json_line(const nlohmann::json& value);

}  // namespace drench
