#include "pipeline/contract/shot/printable.h"

#include <fmt/format.h>

#include <cstdint>

namespace drench {

namespace {

/// A character and its length in bytes; length 0 if the bytes begin none (Unicode 15, table 3-7).
struct Character {
  uint32_t code = 0;
  size_t length = 0;
};

Character character_at(std::string_view text) {
  const auto byte = [&](size_t k) { return uint8_t(text[k]); };
  const uint8_t first = byte(0);
  if (first < 0x80) return {first, 1};
  const size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < length) return {};
  uint32_t code = first & (0x7fu >> length);
  for (size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xc0) != 0x80) return {};
    code = code << 6 | (byte(k) & 0x3fu);
  }
  constexpr uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code < least[length] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return {};
  return {code, length};
}

bool steers_a_terminal(uint32_t code) {
  const bool control = code < 0x20 || (code >= 0x7f && code < 0xa0);
  const bool turns = code == 0x200e || code == 0x200f || (code >= 0x2028 && code <= 0x202e) ||
                     (code >= 0x2066 && code <= 0x2069);
  return (control && code != '\t') || turns;
}

}  // namespace

std::string printable(std::string_view text, Lines lines) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Character next = character_at(text);
    const size_t length = next.length == 0 ? 1 : next.length;
    const bool feed = next.length == 1 && next.code == '\n' && lines == Lines::many;
    if (next.length > 0 && (feed || !steers_a_terminal(next.code))) {
      out += text.substr(0, length);
    } else {
      for (const char c : text.substr(0, length)) out += fmt::format("\\x{:02x}", uint8_t(c));
    }
    text.remove_prefix(length);
  }
  return out;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const size_t length = character_at(text).length;
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

}  // namespace drench
