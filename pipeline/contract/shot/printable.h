#pragma once
// Text for a terminal: names of files and what stands in them may hold anything.

#include <string>
#include <string_view>

namespace drench {

enum class Lines { one, many };  // whether a line feed stays one

/// The same text with control characters (C0, DEL, C1), the marks that turn the direction of
/// writing, and bytes that are not UTF-8 as \xNN, one escape a byte. Tabs stay.
std::string printable(std::string_view text, Lines lines);

/// Whether all of it is UTF-8 without overlong forms, surrogates or values above U+10FFFF.
bool is_utf8(std::string_view text);

}  // namespace drench
