#pragma once
// What toml++ 3.3 must not be shown.

#include <cstddef>
#include <string_view>

namespace drench {

constexpr size_t no_stray_character = size_t(-1);

/// Offset of the first character beyond ASCII outside strings and comments, or no_stray_character.
/// TOML allows none there, but toml++ 3.3 asks of each whether it is white space, by a function
/// that runs into __builtin_unreachable for most European letters. The same holds after a
/// backslash, and such characters are refused in multi-line basic strings altogether.
size_t find_stray_character(std::string_view toml);

}  // namespace drench
