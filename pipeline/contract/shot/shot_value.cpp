#include "pipeline/contract/shot/shot_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/named_file.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/shot/colour.h"
#include "pipeline/contract/shot/enum_names.h"
#include "pipeline/contract/shot/printable.h"
#include "pipeline/contract/shot/shot_text.h"

namespace drench::shot_table {

namespace fs = std::filesystem;

namespace {

constexpr const char* not_utf8 = "its folder's name is not UTF-8; rename the folder";

std::string shown(const toml::node& value) {
  constexpr size_t longest = 60;
  if (const auto* text = value.as_string()) {
    return fmt::format("\"{}\"", text->get().substr(0, longest));
  }
  if (const auto* number = value.as_integer()) return fmt::format("{}", number->get());
  if (const auto* number = value.as_floating_point()) return fmt::format("{}", number->get());
  if (const auto* flag = value.as_boolean()) return flag->get() ? "true" : "false";
  if (const auto* array = value.as_array()) {
    std::string text = "[";
    for (const toml::node& item : *array) {
      if (text.size() > longest) return text + "...]";
      text += (text.size() > 1 ? ", " : "") + shown(item);
    }
    return text + "]";
  }
  return value.is_table() ? "a table" : "a date or time";
}

const char* example_of(Kind kind) {
  switch (kind) {
    case Kind::boolean:
      return "true";
    case Kind::integer:
    case Kind::natural:
      return "3";
    case Kind::number:
      return "0.5";
    case Kind::vector:
    case Kind::place:
      return "[0.0, 1.0, 0.0]";
    case Kind::colour:
      return "[0.8, 0.4, 0.1] or \"srgb(230, 170, 90)\"";
    case Kind::spectrum:
      return "[0.2, 0.05, 0.01]";
    case Kind::cells:
      return "[64, 64]";
    case Kind::frames:
      return "[1001, 1048]";
    case Kind::number_track:
      return "40.0 or [[1001, 40.0], [1048, 30.0]]";
    case Kind::vector_track:
      return "[0.0, 1.0, 3.0] or [[1001, [0.0, 1.0, 3.0]], [1048, [1, 1, 3]]]";
    case Kind::vertices:
      return "[0, 64]";
    case Kind::box:
      return "{min = [0, 0, 0], max = [1, 1, 1]}";
    default:
      return "\"...\"";
  }
}

/// A track is written as its one value, or as pairs of a frame and a value.
enum class TrackForm { constant, keys };

/// Reads the parts of one value; every failure names the whole of it.
class ValueReader {
 public:
  ValueReader(const Parameter& parameter, const toml::node& value, const Site& site)
      : parameter_(parameter), value_(value), site_(site) {}

  [[noreturn]] void fail(const std::string& why) const {
    throw Error(
        printable(fmt::format("{}: {} is {}; {}", site_.where, site_.key, shown(value_), why)));
  }

  [[noreturn]] void wrong_type() const {
    fail(fmt::format("{} is expected, for example {} = {}", kind_text(parameter_), parameter_.key,
                     example_of(parameter_.kind)));
  }

  [[noreturn]] void outside() const {
    fail(fmt::format("{} ({})", limits_text(parameter_), parameter_.description));
  }

  double number(const toml::node& node) const {
    double value = 0;
    if (const auto* real = node.as_floating_point()) {
      value = real->get();
    } else if (const auto* whole = node.as_integer()) {
      value = double(whole->get());
    } else {
      wrong_type();
    }
    if (!std::isfinite(value)) outside();
    return value;
  }

  double limited(const toml::node& node) const {
    const double value = number(node);
    if (value < parameter_.limits.lowest || value > parameter_.limits.highest) outside();
    return value;
  }

  int64_t whole(const toml::node& node) const {
    const auto* value = node.as_integer();
    if (value == nullptr) wrong_type();
    if (double(value->get()) < parameter_.limits.lowest ||
        double(value->get()) > parameter_.limits.highest) {
      outside();
    }
    return value->get();
  }

  bool boolean(const toml::node& node) const {
    const auto* value = node.as_boolean();
    if (value == nullptr) wrong_type();
    return value->get();
  }

  const toml::array& array_of(const toml::node& node, size_t size) const {
    const auto* array = node.as_array();
    if (array == nullptr || array->size() != size) wrong_type();
    return *array;
  }

  V3d vector(const toml::node& node) const {
    const toml::array& array = array_of(node, 3);
    return {limited(array[0]), limited(array[1]), limited(array[2])};
  }

  std::string text(const toml::node& node) const {
    const auto* value = node.as_string();
    if (value == nullptr) wrong_type();
    return value->get();
  }

  std::string_view choice(const toml::node& node) const {
    const std::string word = text(node);
    for (const std::string_view known : parameter_.choices)
      if (word == known) return known;
    const std::string_view near = nearest_word(word, parameter_.choices);
    fail(fmt::format("it must be one of \"{}\"{}", fmt::join(parameter_.choices, "\", \""),
                     near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)));
  }

  std::string name(const toml::node& node) const {
    const std::string word = text(node);
    const auto plain = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
             c == '_' || c == '-';
    };
    if (word.empty() || word.size() > 64 || !std::all_of(word.begin(), word.end(), plain)) {
      fail("a name has 1 to 64 letters, digits, '_' or '-', because files are named after it");
    }
    return word;
  }

  std::string label(const toml::node& node) const {
    std::string words = text(node);
    if (words.empty() || words.find('\0') != std::string::npos) fail("a name is expected");
    return words;
  }

  std::string file_name(const toml::node& node) const {
    const std::string word = text(node);
    if (const char* const why = file_name_problem(word)) fail(why);
    return word;
  }

  fs::path path(const toml::node& node) const {
    const std::string word = text(node);
    if (word.empty() || word.find('\0') != std::string::npos) fail("a path to a file is expected");
    const fs::path file = named_file(site_.folder, word);
    if (!is_utf8(file.string())) fail(not_utf8);
    std::error_code code;
    if (!fs::exists(file, code)) {
      fail(fmt::format("the file {} does not exist; paths are relative to the shot's folder{}",
                       file.string(), hint_on_name(word)));
    }
    if (!fs::is_regular_file(file, code)) fail(file.string() + " is not a regular file");
    return file;
  }

  /// A path, or the pattern of a sequence, whose files are looked for once the frames are known.
  fs::path mesh_files(const toml::node& node) const {
    const fs::path file = named_file(site_.folder, text(node));
    return is_sequence(file) ? file : path(node);
  }

  V3f colour(const toml::node& node) const {
    if (const auto* word = node.as_string()) {
      const V3f value = acescg_from_srgb(encoded_colour(word->get()));
      if (std::max({value.x, value.y, value.z}) > parameter_.limits.highest) outside();
      return value;
    }
    return V3f(vector(node));
  }

  V2i cells(const toml::node& node) const {
    const toml::array& array = array_of(node, 2);
    return {int(whole(array[0])), int(whole(array[1]))};
  }

  Timeline frames(const toml::node& node, Timeline timeline) const {
    const toml::array& array = array_of(node, 2);
    timeline.first = int(whole(array[0]));
    timeline.last = int(whole(array[1]));
    return timeline;
  }

  template <class T, class ReadOne>
  void track(Animated<T>& field, TrackForm form, ReadOne read_one) const {
    if (form == TrackForm::constant) {
      field.keys = {{0.0, read_one(value_)}};
      return;
    }
    std::vector<std::pair<double, T>> keys;
    for (const toml::node& item : *value_.as_array()) {
      const toml::array& pair = array_of(item, 2);
      const double frame = number(pair[0]);
      if (std::abs(frame) > 1e7) fail("its frames must lie between -10000000 and 10000000");
      if (!keys.empty() && frame <= keys.back().first) {
        fail(fmt::format("its frames must rise, but {} follows {}; sort the keys", frame,
                         keys.back().first));
      }
      keys.emplace_back(frame, read_one(pair[1]));
    }
    field.keys = std::move(keys);
  }

  TrackForm number_track() const {
    return value_.is_array() ? TrackForm::keys : TrackForm::constant;
  }
  TrackForm vector_track() const {  // a constant is an array, too
    const auto* array = value_.as_array();
    const bool keys = array != nullptr && !array->empty() && array->front().is_array();
    return keys ? TrackForm::keys : TrackForm::constant;
  }

  std::vector<uint32_t> vertices(const toml::node& node) const {
    const auto* array = node.as_array();
    if (array == nullptr || array->empty()) wrong_type();
    std::vector<uint32_t> list;
    for (const toml::node& item : *array) list.push_back(uint32_t(whole(item)));
    return list;
  }

  std::pair<V3d, V3d> box(const toml::node& node) const {
    const auto* table = node.as_table();
    if (table == nullptr || table->size() != 2 || !table->contains("min") ||
        !table->contains("max")) {
      wrong_type();
    }
    const std::pair<V3d, V3d> box{vector(*table->get("min")), vector(*table->get("max"))};
    for (int i = 0; i < 3; ++i) {
      if (box.first[i] > box.second[i]) {
        fail("its min must not exceed its max in any component; exchange them");
      }
    }
    return box;
  }

 private:
  V3d encoded_colour(const std::string& word) const {
    unsigned r = 0, g = 0, b = 0;
    double values[3];
    if (word.size() == 7 && word[0] == '#') {
      const auto hex = [&](size_t at, unsigned& value) {
        const char* const end = word.data() + at + 2;
        return std::from_chars(word.data() + at, end, value, 16).ptr == end;
      };
      if (hex(1, r) && hex(3, g) && hex(5, b)) return V3d(r, g, b) / 255.0;
    }
    if (word.starts_with("srgb(") && word.ends_with(')')) {
      const char* at = word.data() + 5;
      const char* const end = word.data() + word.size() - 1;
      bool fine = true;
      for (int i = 0; i < 3 && fine; ++i) {
        while (at < end && *at == ' ') ++at;
        const auto [next, code] = std::from_chars(at, end, values[i]);
        at = next;
        while (at < end && *at == ' ') ++at;
        fine = code == std::errc() && values[i] >= 0 && values[i] <= 255;
        if (i < 2) fine = fine && at < end && *at++ == ',';
      }
      if (fine && at == end) return V3d(values[0], values[1], values[2]) / 255.0;
    }
    fail("a colour is [r, g, b] in linear ACEScg, \"srgb(r, g, b)\" with 0 to 255, or \"#rrggbb\"");
  }

  const Parameter& parameter_;
  const toml::node& value_;
  const Site& site_;
};

template <class T>
T& as(void* field) {
  return *static_cast<T*>(field);
}
template <class T>
void put(void* field, T value) {
  as<T>(field) = std::move(value);
}

}  // namespace

void read_value(const Parameter& parameter, void* field, const toml::node& value,
                const Site& site) {
  const ValueReader reader(parameter, value, site);
  const auto one_number = [&](const toml::node& node) { return reader.limited(node); };
  const auto one_vector = [&](const toml::node& node) { return reader.vector(node); };
  switch (parameter.kind) {
    case Kind::boolean:
      return put<bool>(field, reader.boolean(value));
    case Kind::integer:
      return put<int>(field, int(reader.whole(value)));
    case Kind::natural:
      return put<uint32_t>(field, uint32_t(reader.whole(value)));
    case Kind::number:
      return put<double>(field, reader.limited(value));
    case Kind::text:
      return put<std::string>(field, reader.file_name(value));
    case Kind::label:
      return put<std::string>(field, reader.label(value));
    case Kind::name:
      return put<std::string>(field, reader.name(value));
    case Kind::path:
      return put<fs::path>(field, reader.path(value));
    case Kind::mesh_files:
      return put<fs::path>(field, reader.mesh_files(value));
    case Kind::choice:
    case Kind::track_mode:
      return parameter.choose(field, reader.choice(value));
    case Kind::vector:
      return put<V3d>(field, reader.vector(value));
    case Kind::colour:
      return put<V3f>(field, reader.colour(value));
    case Kind::spectrum:
      return put<V3f>(field, V3f(reader.vector(value)));
    case Kind::cells:
      return put<V2i>(field, reader.cells(value));
    case Kind::frames:
      return put<Timeline>(field, reader.frames(value, as<Timeline>(field)));
    case Kind::number_track:
      reader.track(as<Animated<double>>(field), reader.number_track(), one_number);
      if (as<Animated<double>>(field).keys.empty()) reader.wrong_type();
      break;
    case Kind::vector_track:
      reader.track(as<Animated<V3d>>(field), reader.vector_track(), one_vector);
      break;
    case Kind::vertices:
      return put<std::vector<uint32_t>>(field, reader.vertices(value));
    case Kind::box:
      return put<std::optional<std::pair<V3d, V3d>>>(field, reader.box(value));
    case Kind::place:
      return put<std::optional<V3d>>(field, reader.vector(value));
    case Kind::grid_pins:
      break;
  }
}

std::vector<GridPins> read_grid_pins(const Parameter& parameter, const toml::node& value,
                                     const Site& site) {
  const ValueReader reader(parameter, value, site);
  const auto one = [&](const toml::node& node) { return enum_of<GridPins>(reader.choice(node)); };
  const auto* const array = value.as_array();
  if (array == nullptr) return {one(value)};
  std::vector<GridPins> pins;
  for (const toml::node& item : *array) pins.push_back(one(item));
  return pins;
}

}  // namespace drench::shot_table
