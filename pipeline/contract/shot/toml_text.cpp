#include "pipeline/contract/shot/toml_text.h"

#include <algorithm>

namespace drench {

namespace {

bool beyond_ascii(char c) { return static_cast<unsigned char>(c) >= 0x80; }

/// Walks over a string whose first quote stands at `at`; returns the offset after it, or the end of
/// the text if it is not closed (toml++ stops there with an error). Sets `stray` on a refused
/// character.
size_t skip_string(std::string_view text, size_t at, size_t& stray) {
  const char quote = text[at];
  const std::string_view triple = quote == '"' ? "\"\"\"" : "'''";
  const bool multi_line = text.substr(at, 3) == triple;
  const bool escapes = quote == '"';
  for (size_t i = at + (multi_line ? 3 : 1); i < text.size(); ++i) {
    if (multi_line && text.substr(i, 3) == triple) {
      i += 3;
      // Up to two more quotes belong to the string.
      for (int extra = 0; extra < 2 && i < text.size() && text[i] == quote; ++extra) ++i;
      return i;
    }
    if (!multi_line && text[i] == quote) return i + 1;
    if (!multi_line && text[i] == '\n') return text.size();
    const bool escaped = escapes && text[i] == '\\';
    if (escaped) ++i;
    const bool refused = escapes && (multi_line || escaped);
    if (refused && i < text.size() && beyond_ascii(text[i])) {
      stray = i;
      return text.size();
    }
  }
  return text.size();
}

}  // namespace

size_t find_stray_character(std::string_view text) {
  constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
  size_t at = text.starts_with(byte_order_mark) ? byte_order_mark.size() : 0;
  while (at < text.size()) {
    if (beyond_ascii(text[at])) return at;
    if (text[at] == '#') {
      at = std::min(text.find('\n', at), text.size());
    } else if (text[at] == '"' || text[at] == '\'') {
      size_t stray = no_stray_character;
      at = skip_string(text, at, stray);
      if (stray != no_stray_character) return stray;
    } else {
      ++at;
    }
  }
  return no_stray_character;
}

}  // namespace drench
