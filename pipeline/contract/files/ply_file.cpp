#include "pipeline/contract/files/ply_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/mesh_columns.h"
#include "pipeline/contract/files/mesh_text.h"
#include "pipeline/contract/geometry/mesh_builder.h"

namespace drench {

namespace fs = std::filesystem;
static_assert(std::endian::native == std::endian::little);

namespace {

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };

constexpr size_t size_of(Type type) {
  constexpr std::array<size_t, 8> sizes{1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[size_t(type)];
}

struct Property {
  std::string name;
  Type type = Type::f32;
  std::optional<Type> count_type;  // a list when present
};

struct Element {
  std::string name;
  uint64_t count = 0;
  std::vector<Property> properties;
};

struct PlyHeader {
  bool ascii = false, big_endian = false;
  std::vector<Element> elements;
  size_t body = 0;  // offset of the first byte after the header
};

/// How programs call texture coordinates of vertices.
constexpr std::array<std::string_view, 2> uv_names[] = {
    {"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}};

class PlyReader {
 public:
  PlyReader(const fs::path& path, std::string_view text, CornerData corners,
            std::span<const Imath::V3f> cut_by)
      : path_(path),
        text_(text),
        corners_(corners),
        builder_(path, corners, cut_by,
                 [&path](uint64_t row) { return fmt::format("{}: face {}", path.string(), row); }) {
  }

  TriangleMesh read() {
    const PlyHeader header = read_header();
    ascii_ = header.ascii;
    swapped_ = header.big_endian;
    rest_ = text_.substr(header.body);
    bool vertices = false;
    bool faces = false;
    for (const Element& element : header.elements) {
      check_size(element);
      if (element.name == "vertex") {
        if (vertices) fail("has two vertex elements; one is expected");
        vertices = true;
        read_vertices(element);
      } else if (element.name == "face") {
        if (faces) fail("has two face elements; one is expected");
        faces = true;
        read_faces(element);
      } else {
        skip(element);
      }
    }
    if (!vertices || !faces) fail("has no vertex or no face element; a triangle mesh is expected");
    check_end();
    number_.warn(path_);
    TriangleMesh mesh = builder_.finish();
    keep_contact(mesh);
    keep_points(mesh);
    return mesh;
  }

 private:
  // Bytes that belong to nothing: a count in the header is wrong, or the file is damaged.
  void check_end() const {
    if (rest_.find_first_not_of(" \t\r\n") != std::string_view::npos)
      fail("has more data than its header says");
  }

  [[noreturn]] void fail(const std::string& why) const {
    throw Error(fmt::format("{}: {}. Export the mesh again", path_.string(), why));
  }

  static std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    size_t at = 0;
    while ((at = line.find_first_not_of(" \t\r", at)) != std::string_view::npos) {
      const size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
      words.push_back(line.substr(at, end - at));
      at = end;
    }
    return words;
  }

  Type type_of(std::string_view word) const {
    constexpr std::array<std::array<std::string_view, 2>, 8> names{{{"char", "int8"},
                                                                    {"uchar", "uint8"},
                                                                    {"short", "int16"},
                                                                    {"ushort", "uint16"},
                                                                    {"int", "int32"},
                                                                    {"uint", "uint32"},
                                                                    {"float", "float32"},
                                                                    {"double", "float64"}}};
    for (size_t i = 0; i < names.size(); ++i) {
      if (word == names[i][0] || word == names[i][1]) return Type(i);
    }
    fail(fmt::format("has a property of unknown type '{}'", word.substr(0, 40)));
  }

  void read_format(const std::vector<std::string_view>& words, PlyHeader& header) const {
    if (words.size() < 2) fail("has a format line without a format");
    header.ascii = words[1] == "ascii";
    header.big_endian = words[1] == "binary_big_endian";
    if (!header.ascii && !header.big_endian && words[1] != "binary_little_endian") {
      fail(
          fmt::format("has format '{}'; ascii, binary_little_endian and binary_big_endian can be "
                      "read",
                      words[1].substr(0, 40)));
    }
  }

  Element element_of(const std::vector<std::string_view>& words) const {
    Element element;
    if (words.size() != 3) fail("has an element line that is not 'element NAME COUNT'");
    element.name = words[1];
    const auto [end, code] =
        std::from_chars(words[2].data(), words[2].data() + words[2].size(), element.count);
    if (code != std::errc() || end != words[2].data() + words[2].size()) {
      fail(fmt::format("has an element count '{}' that is not a number", words[2].substr(0, 40)));
    }
    return element;
  }

  Property property_of(const std::vector<std::string_view>& words) const {
    if (words.size() == 3) return {std::string(words[2]), type_of(words[1]), {}};
    if (words.size() != 5 || words[1] != "list") fail("has a property line that cannot be read");
    const Type count = type_of(words[2]);
    if (count >= Type::f32) fail("has a list whose length is not an integer");
    return {std::string(words[4]), type_of(words[3]), count};
  }

  /// A line of the header; empty if it is a comment.
  std::string_view header_line(size_t& at, char end_of_line) const {
    const size_t end = text_.find(end_of_line, at);
    if (end == std::string_view::npos) fail("has no whole PLY header");
    std::string_view line = text_.substr(at, end - at);
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    at = end + 1;
    if (line.starts_with("comment") || line.starts_with("obj_info")) return {};
    constexpr size_t longest = 1 << 16;
    if (line.size() > longest) fail("has a header line that is too long to be one");
    return line;
  }

  /// As text, or as 80 bytes, a count, and 50 bytes a triangle.
  bool looks_like_stl() const {
    uint32_t count = 0;
    if (text_.starts_with("solid")) return true;
    if (text_.starts_with("ply") || text_.size() < 84) return false;
    std::memcpy(&count, text_.data() + 80, 4);
    return text_.size() == 84 + 50 * uint64_t(count);
  }

  PlyHeader read_header() const {
    PlyHeader header;
    // Binary data may begin with a line feed: the first line says how those of the header end.
    const char end_of_line =
        text_.starts_with("ply\r") && !text_.starts_with("ply\r\n") ? '\r' : '\n';
    if (looks_like_stl())
      fail("is not a PLY file but looks like STL, which has no vertices that faces share");
    if (words_of(header_line(header.body, end_of_line)) != std::vector<std::string_view>{"ply"})
      fail("is not a PLY file");
    bool format = false;
    while (true) {
      const auto words = words_of(header_line(header.body, end_of_line));
      if (words.empty()) continue;
      if (words[0] == "end_header") break;
      if (words[0] == "format") {
        read_format(words, header);
        format = true;
      } else if (words[0] == "element") {
        header.elements.push_back(element_of(words));
      } else if (words[0] == "property" && !header.elements.empty()) {
        header.elements.back().properties.push_back(property_of(words));
      } else {
        fail(fmt::format("has a header line '{}' that cannot be read", words[0].substr(0, 40)));
      }
    }
    if (!format) fail("has no format line");
    return header;
  }

  // A count can be believed only if the smallest rows of that many fit into what is left.
  void check_size(const Element& element) const {
    uint64_t row = 0;
    for (const Property& p : element.properties) {
      row += ascii_ ? 2 : size_of(p.count_type ? *p.count_type : p.type);
    }
    // The last number of an ASCII file may end without a separator.
    const uint64_t room = rest_.size() + (ascii_ ? 1 : 0);
    if (element.count > 0 && row == 0) fail("has an element without properties");
    if (element.count > 0 && element.count > room / row) {
      fail(
          fmt::format("says it has {} of element {}, but the file is too short for them: cut off "
                      "or damaged",
                      element.count, element.name.substr(0, 40)));
    }
  }

  std::string_view next_word() {
    const size_t start = rest_.find_first_not_of(" \t\r\n");
    if (start == std::string_view::npos) fail("ends before its last value: cut off or damaged");
    rest_.remove_prefix(start);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n"));
    rest_.remove_prefix(word.size());
    return word;
  }

  double next_value(Type type) {
    if (ascii_) {
      const std::string_view word = next_word();
      if (const std::optional<double> value = number_.real(word)) return *value;
      fail(fmt::format("holds '{}' where a number is expected", word.substr(0, 40)));
    }
    if (rest_.size() < size_of(type)) fail("ends before its last value: cut off or damaged");
    const char* const data = rest_.data();
    rest_.remove_prefix(size_of(type));
    switch (type) {
      case Type::i8:
        return load<int8_t>(data);
      case Type::u8:
        return load<uint8_t>(data);
      case Type::i16:
        return load<int16_t>(data);
      case Type::u16:
        return load<uint16_t>(data);
      case Type::i32:
        return load<int32_t>(data);
      case Type::u32:
        return load<uint32_t>(data);
      case Type::f32:
        return load<float>(data);
      case Type::f64:
        return load<double>(data);
    }
    return 0;
  }

  template <class T>
  double load(const char* data) const {
    std::array<char, sizeof(T)> bytes;
    std::copy_n(data, sizeof(T), bytes.begin());
    if (swapped_) std::reverse(bytes.begin(), bytes.end());
    return double(std::bit_cast<T>(bytes));
  }

  uint64_t next_count(Type type) {
    const double count = next_value(type);
    if (!(count >= 0) || count != std::floor(count)) fail("has a list with an impossible length");
    if (count > double(rest_.size())) {
      fail(
          fmt::format("has a list of {} numbers, but the file is too short for them: cut off or "
                      "damaged",
                      count));
    }
    return uint64_t(count);
  }

  /// Where a vertex property goes: the column's floats and the component; null if nobody reads it.
  float* slot_of(std::string_view name) {
    const auto slot = [&](auto& column, size_t component) {
      using Vector = typename std::decay_t<decltype(column)>::value_type;
      column.resize(mesh_.position.size(), Vector(0));
      return column.empty() ? nullptr : reinterpret_cast<float*>(column.data()) + component;
    };
    constexpr std::array<std::string_view, 3> x{"x", "y", "z"}, v{"vx", "vy", "vz"},
        n{"nx", "ny", "nz"}, r{"rest_x", "rest_y", "rest_z"};
    for (size_t i = 0; i < 3; ++i) {
      if (name == x[i]) return slot(mesh_.position, i);
      if (name == v[i]) return slot(mesh_.velocity, i);
      if (name == n[i]) return slot(mesh_.normal, i);
      if (name == r[i]) return slot(mesh_.rest_position, i);
    }
    for (const auto& [u, v] : uv_names) {
      if (name == u) return slot(mesh_.uv, 0);
      if (name == v) return slot(mesh_.uv, 1);
    }
    for (const auto& [real, values] : mesh_columns)
      if (name == real) return slot(mesh_.*values, 0);
    return nullptr;
  }

  static size_t stride_of(std::string_view name) {
    for (const auto& [real, values] : mesh_columns)
      if (name == real) return 1;
    for (const auto& [u, v] : uv_names)
      if (name == u || name == v) return 2;
    return 3;
  }

  // A group counts as present only when every component was named.
  void check_groups(const Element& element) {
    const auto has = [&](std::string_view name) {
      return std::any_of(element.properties.begin(), element.properties.end(),
                         [&](const Property& p) { return p.name == name && !p.count_type; });
    };
    const auto has3 = [&](std::string_view a, std::string_view b, std::string_view c) {
      return has(a) && has(b) && has(c);
    };
    if (!has3("x", "y", "z")) fail("has vertices without x, y and z");
    for (size_t i = 0; i < element.properties.size(); ++i) {
      for (size_t j = 0; j < i; ++j) {
        if (element.properties[i].name == element.properties[j].name) {
          fail(fmt::format("names the property '{}' twice", element.properties[i].name));
        }
      }
    }
    if (!has3("vx", "vy", "vz")) mesh_.velocity.assign(element.count, Imath::V3f(0));
    if (!has3("nx", "ny", "nz")) mesh_.normal.clear();
    if (!has3("rest_x", "rest_y", "rest_z")) mesh_.rest_position.clear();
    if (std::none_of(std::begin(uv_names), std::end(uv_names),
                     [&](const auto& names) { return has(names[0]) && has(names[1]); }))
      mesh_.uv.clear();
  }

  void read_vertices(const Element& element) {
    if (element.count > std::numeric_limits<uint32_t>::max()) fail("has more than 2^32 vertices");
    if (element.properties.size() > 256) fail("has more than 256 properties a vertex");
    // Imath's vectors hold anything unless told.
    mesh_.position.resize(element.count, Imath::V3f(0));
    mesh_.velocity.resize(element.count, Imath::V3f(0));
    std::vector<float*> slot;
    for (const Property& p : element.properties) {
      slot.push_back(p.count_type ? nullptr : slot_of(p.name));
    }
    for (uint64_t row = 0; row < element.count; ++row) {
      for (size_t i = 0; i < slot.size(); ++i) {
        const Property& p = element.properties[i];
        if (p.count_type) {
          skip_list(p);
          continue;
        }
        const double value = next_value(p.type);
        if (p.name == "point") point_.push_back(value);
        if (slot[i] != nullptr) slot[i][row * stride_of(p.name)] = float(value);
      }
    }
    check_groups(element);
  }

  void read_faces(const Element& element) {
    const auto is_index_list = [](const Property& p) {
      return p.count_type && (p.name == "vertex_indices" || p.name == "vertex_index");
    };
    if (std::count_if(element.properties.begin(), element.properties.end(), is_index_list) != 1) {
      fail("has faces without a list vertex_indices");
    }
    std::vector<MeshBuilder::Corner> corner;
    for (uint64_t row = 0; row < element.count; ++row) {
      size_t uv = 0;  // numbers that were read of the face's texture coordinates
      for (const Property& p : element.properties) {
        if (is_index_list(p)) {
          corner.assign(next_count(*p.count_type), {});
          for (MeshBuilder::Corner& c : corner) c.vertex = next_index(p.type, row);
        } else if (p.count_type && p.name == "texcoord" && corners_ != CornerData::none) {
          uv = read_texcoord(p);
        } else if (p.count_type) {
          skip_list(p);
        } else {
          const double value = next_value(p.type);
          if (p.name == "contact") contact_.push_back(value != 0);
        }
      }
      if (uv > 0) name_texcoord(corner, uv);
      builder_.add_face(corner, row);
    }
  }

  /// u, v of every corner; none where the list is empty.
  size_t read_texcoord(const Property& p) {
    const uint64_t n = next_count(*p.count_type);
    for (uint64_t k = 0; k < n; ++k) {
      const auto value = float(next_value(p.type));
      if (k % 2 == 0)
        builder_.uv.emplace_back(value, 0.f);
      else
        builder_.uv.back().y = value;
    }
    return n;
  }

  /// @param n  numbers that were read of the face's coordinates; two a corner, or none is taken.
  void name_texcoord(std::vector<MeshBuilder::Corner>& corner, size_t n) const {
    const bool fits = n == 2 * corner.size();
    for (size_t k = 0; k < corner.size(); ++k)
      corner[k].uv = fits ? uint32_t(builder_.uv.size() - corner.size() + k) : MeshBuilder::nowhere;
  }

  // Of polygons that were cut into triangles nobody knows which lies where.
  void keep_contact(TriangleMesh& mesh) {
    if (contact_.size() == mesh.triangle.size()) mesh.contact = std::move(contact_);
  }

  void keep_points(TriangleMesh& mesh) const {
    if (point_.empty() || point_.size() != mesh.position.size()) return;
    for (size_t v = 0; v < point_.size(); ++v) {
      const double point = point_[v];
      const bool is_same_point = point >= 0 && point < double(point_.size()) &&
                                 mesh.position[size_t(point)] == mesh.position[v];
      if (!is_same_point) return mesh.point.clear();  // of a program that means something else
      mesh.point.push_back(uint32_t(point));
    }
  }

  uint32_t next_index(Type type, uint64_t row) {
    const double index = next_value(type);
    if (!(index >= 0) || index != std::floor(index) || index > 4294967295.0) {
      fail(fmt::format("has a face {} with an index that is no whole number >= 0", row));
    }
    return uint32_t(index);
  }

  void skip_list(const Property& p) {
    const uint64_t n = next_count(*p.count_type);
    for (uint64_t i = 0; i < n; ++i) next_value(p.type);
  }

  void skip(const Element& element) {
    for (uint64_t row = 0; row < element.count; ++row) {
      for (const Property& p : element.properties) {
        if (p.count_type) {
          skip_list(p);
        } else {
          next_value(p.type);
        }
      }
    }
  }

  const fs::path& path_;
  std::string_view text_, rest_;
  bool ascii_ = false, swapped_ = false;
  NumberReader number_;
  CornerData corners_;
  MeshBuilder builder_;
  TriangleMesh& mesh_ = builder_.mesh;
  std::vector<uint8_t> contact_;
  std::vector<double> point_;
};

}  // namespace

TriangleMesh read_ply(const fs::path& path, std::string_view text, CornerData corners,
                      std::span<const Imath::V3f> cut_by) {
  return PlyReader(path, text, corners, cut_by).read();
}

}  // namespace drench
