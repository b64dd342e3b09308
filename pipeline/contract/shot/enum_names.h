#pragma once
// The names of an enum's values, from the enumerators themselves: what a shot file may say is what
// shot.h says, in number and order.

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>
#include <utility>

namespace drench {

/// "free" of Slip::free; empty where V is no enumerator.
template <auto V>
consteval std::string_view enumerator_name() {
  // GCC and Clang spell it "... [with auto V = drench::Slip::free; ...]", a number in parentheses
  // where there is no such enumerator.
  std::string_view text = __PRETTY_FUNCTION__;
  text.remove_prefix(text.find("V = ") + 4);
  text = text.substr(0, text.find_first_of(";]"));
  return text.front() == '(' ? std::string_view() : text.substr(text.rfind(':') + 1);
}

/// Of an enum whose values count from 0.
template <class Enum, size_t N = 0>
consteval size_t enumerator_count() {
  if constexpr (enumerator_name<Enum(N)>().empty()) {
    return N;
  } else {
    return enumerator_count<Enum, N + 1>();
  }
}

/// By value.
template <class Enum>
inline constexpr auto enum_names = []<size_t... I>(std::index_sequence<I...>) {
  static_assert(sizeof...(I) > 0, "its values do not count from 0");
  return std::array<std::string_view, sizeof...(I)>{enumerator_name<Enum(I)>()...};
}
(std::make_index_sequence<enumerator_count<Enum>()>());

/// @param name  one of enum_names.
template <class Enum>
constexpr Enum enum_of(std::string_view name) {
  const auto& names = enum_names<Enum>;
  return Enum(std::find(names.begin(), names.end(), name) - names.begin());
}

}  // namespace drench
