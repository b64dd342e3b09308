#include "pipeline/contract/shot/shot_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/shot/printable.h"

namespace drench::shot_table {

namespace fs = std::filesystem;

namespace {

template <class T>
const T& as(const void* field) {
  return *static_cast<const T*>(field);
}
std::string number_text(double value) {
  std::string text = fmt::format("{}", value);
  // TOML tells 1.0 from 1; a reader of the lock file should too.
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const unsigned char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += char(c);
    } else if (c < 0x20 || c == 0x7f) {
      out += fmt::format("\\u{:04x}", c);
    } else {
      out += char(c);
    }
  }
  return out + "\"";
}

template <class V>
std::string vector_text(const V& v) {
  return fmt::format("[{}, {}, {}]", number_text(v.x), number_text(v.y), number_text(v.z));
}

// A float needs only its own digits, not those of the double it becomes.
std::string colour_text(const V3f& v) {
  const auto one = [](float value) {
    std::string text = fmt::format("{}", value);
    return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
  };
  return fmt::format("[{}, {}, {}]", one(v.x), one(v.y), one(v.z));
}

template <class T, class OneText>
std::string track_text(const Animated<T>& track, OneText one) {
  if (track.keys.size() == 1 && track.keys[0].first == 0) return one(track.keys[0].second);
  std::string text;
  for (const auto& [frame, value] : track.keys) {
    text += fmt::format("{}[{}, {}]", text.empty() ? "[" : ", ", number_text(frame), one(value));
  }
  return text + "]";
}

}  // namespace

std::string printable(std::string text) {
  for (char& c : text) {
    if ((c >= 0 && c < 0x20) || c == 0x7f) c = '?';
  }
  return text;
}

const char* file_name_problem(std::string_view name) {
  const auto control = [](char c) { return (c >= 0 && c < 0x20) || c == 0x7f; };
  if (name.empty()) return "it names output files, so it must not be empty";
  if (name.size() > 200) return "it names output files; use at most 200 bytes";
  if (!is_utf8(name)) return "it names output files; use UTF-8";
  if (name.find('/') != name.npos || std::any_of(name.begin(), name.end(), control)) {
    return "it names output files; use neither '/' nor control characters";
  }
  if (name[0] == '.' || name[0] == '-')
    return "it names output files; start with a letter or digit";
  return nullptr;
}

std::string value_text(const Parameter& parameter, const void* field) {
  switch (parameter.kind) {
    case Kind::boolean:
      return as<bool>(field) ? "true" : "false";
    case Kind::integer:
      return fmt::format("{}", as<int>(field));
    case Kind::natural:
      return fmt::format("{}", as<uint32_t>(field));
    case Kind::number:
      return number_text(as<double>(field));
    case Kind::text:
    case Kind::label:
    case Kind::name:
      return as<std::string>(field).empty() ? "" : quoted(as<std::string>(field));
    case Kind::path:
    case Kind::mesh_files:
      return as<fs::path>(field).empty() ? "" : quoted(as<fs::path>(field).string());
    case Kind::choice:
    case Kind::track_mode:
      return quoted(std::string(parameter.chosen(field)));
    case Kind::vector:
      return vector_text(as<V3d>(field));
    case Kind::colour:
    case Kind::spectrum:
      return colour_text(as<V3f>(field));
    case Kind::cells:
      return fmt::format("[{}, {}]", as<V2i>(field).x, as<V2i>(field).y);
    case Kind::frames:
      return fmt::format("[{}, {}]", as<Timeline>(field).first, as<Timeline>(field).last);
    case Kind::number_track:
      return track_text(as<Animated<double>>(field), number_text);
    case Kind::vector_track:
      return track_text(as<Animated<V3d>>(field), vector_text<V3d>);
    case Kind::vertices: {
      const auto& list = as<std::vector<uint32_t>>(field);
      return list.empty() ? "" : fmt::format("[{}]", fmt::join(list, ", "));
    }
    case Kind::box: {
      const auto& box = as<std::optional<std::pair<V3d, V3d>>>(field);
      return box ? fmt::format("{{min = {}, max = {}}}", vector_text(box->first),
                               vector_text(box->second))
                 : "";
    }
    case Kind::place: {
      const auto& place = as<std::optional<V3d>>(field);
      return place ? vector_text(*place) : "";
    }
    case Kind::grid_pins:
      return "";
  }
  return "";
}

std::string kind_text(const Parameter& parameter) {
  const std::string in = parameter.unit.empty() ? "" : fmt::format(" in {}", parameter.unit);
  switch (parameter.kind) {
    case Kind::boolean:
      return "true or false";
    case Kind::integer:
    case Kind::natural:
      return "a whole number" + in;
    case Kind::number:
      return "a number" + in;
    case Kind::text:
    case Kind::label:
    case Kind::name:
      return "a name in quotes";
    case Kind::path:
      return "the path of a file in quotes";
    case Kind::mesh_files:
      return "the path of a file or of a sequence in quotes";
    case Kind::track_mode:
    case Kind::choice:
      return fmt::format("one of \"{}\"", fmt::join(parameter.choices, "\", \""));
    case Kind::vector:
    case Kind::place:
      return "an array of 3 numbers" + in;
    case Kind::colour:
      return "a colour" + in;
    case Kind::spectrum:
      return "an array of 3 numbers (linear ACEScg)" + in;
    case Kind::cells:
      return "an array of 2 whole numbers";
    case Kind::frames:
      return "an array of 2 whole numbers, first and last frame,";
    case Kind::number_track:
      return fmt::format("a number{} or [[frame, number], ...]", in);
    case Kind::vector_track:
      return fmt::format("3 numbers{} or [[frame, [x, y, z]], ...]", in);
    case Kind::vertices:
      return "an array of whole numbers";
    case Kind::box:
      return "a table of min and max" + in;
    case Kind::grid_pins:
      return fmt::format("one or an array of \"{}\"", fmt::join(parameter.choices, "\", \""));
  }
  return "";
}

std::string limits_text(const Parameter& parameter) {
  const std::string unit = parameter.unit.empty() ? "" : fmt::format(" {}", parameter.unit);
  const auto plain = [](double value) {
    return value == std::floor(value) && std::abs(value) < 1e15 ? fmt::format("{:.0f}", value)
                                                                : fmt::format("{}", value);
  };
  return fmt::format("it must lie between {} and {}{}", plain(parameter.limits.lowest),
                     plain(parameter.limits.highest), unit);
}

std::string_view nearest_word(std::string_view word, const std::vector<std::string_view>& words) {
  // Edit distance (Levenshtein); one row of the table is kept.
  const auto distance = [&](std::string_view other) {
    std::vector<size_t> row(other.size() + 1);
    for (size_t j = 0; j <= other.size(); ++j) row[j] = j;
    for (size_t i = 1; i <= word.size(); ++i) {
      size_t diagonal = row[0]++;
      for (size_t j = 1; j <= other.size(); ++j) {
        const size_t replaced = diagonal + (word[i - 1] == other[j - 1] ? 0 : 1);
        diagonal = row[j];
        row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
      }
    }
    return row.back();
  };
  const auto is_part_of = [&](std::string_view other) {
    constexpr size_t least_beginning = 3;
    if (word.size() >= least_beginning && other.starts_with(word)) return true;
    return !word.empty() &&
           fmt::format("_{}_", other).find(fmt::format("_{}_", word)) != std::string::npos;
  };
  if (word.size() > 64) return {};
  std::string_view best;
  size_t least = std::max<size_t>(2, word.size() / 2) + 1;
  for (const std::string_view other : words) {
    const size_t d = is_part_of(other) ? 1 : distance(other);
    if (d < least && d < other.size()) {
      least = d;
      best = other;
    }
  }
  return best;
}

}  // namespace drench::shot_table
