#include "pipeline/contract/obj_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "pipeline/contract/error.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

class ObjReader {
 public:
  ObjReader(const fs::path& path, std::string_view text) : path_(path), text_(text) {}

  TriangleMesh read() {
    std::string joined;
    while (!text_.empty()) {
      const std::string_view line = next_line(joined);
      read_line(line.substr(0, line.find('#')));
    }
    if (mesh_.triangle.empty()) fail("has no faces; a triangle mesh is expected");
    for (const auto& t : mesh_.triangle) {
      if (std::max({t.x, t.y, t.z}) >= mesh_.position.size()) fail("has a face without its vertex");
    }
    mesh_.velocity.resize(mesh_.position.size(), Imath::V3f(0));
    take_uv();
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw Error(fmt::format("{}:{}: {}. Export the mesh again", path_.string(), line_, why));
  }

  /// One logical line: a backslash at the end joins the next.
  std::string_view next_line(std::string& joined) {
    joined.clear();
    while (true) {
      ++line_;
      std::string_view line = text_.substr(0, text_.find('\n'));
      text_.remove_prefix(std::min(line.size() + 1, text_.size()));
      while (line.ends_with('\r')) line.remove_suffix(1);
      if (!line.ends_with('\\') || text_.empty()) {
        if (joined.empty()) return line;
        return joined += line;
      }
      line.remove_suffix(1);
      joined += line;
      joined += ' ';
    }
  }

  static std::string_view take_word(std::string_view& line) {
    const size_t start = line.find_first_not_of(" \t");
    if (start == std::string_view::npos) return line = {};
    line.remove_prefix(start);
    const std::string_view word = line.substr(0, line.find_first_of(" \t"));
    line.remove_prefix(word.size());
    return word;
  }

  void read_line(std::string_view line) {
    const std::string_view keyword = take_word(line);
    if (keyword == "v") {
      const float x = next_float(line), y = next_float(line), z = next_float(line);
      mesh_.position.emplace_back(x, y, z);
    } else if (keyword == "vt") {
      const float u = next_float(line);
      uv_.emplace_back(u, take_word(std::string_view(line)).empty() ? 0.f : next_float(line));
    } else if (keyword == "f") {
      read_face(line);
    }
  }

  static std::string_view take_word(std::string_view&& line) { return take_word(line); }

  float next_float(std::string_view& line) const {
    std::string_view word = take_word(line);
    if (word.starts_with('+')) word.remove_prefix(1);
    // Rounded once, so that what write_obj wrote comes back equal; by way of double what float
    // calls out of range because it is next to nothing.
    float value = 0;
    if (parsed(word, value) && std::isfinite(value)) return value;
    double wide = 0;
    if (parsed(word, wide) && std::isfinite(float(wide))) return float(wide);
    fail(fmt::format("holds '{}' where a finite number is expected", word.substr(0, 40)));
  }

  template <class T>
  static bool parsed(std::string_view word, T& value) {
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
    return code == std::errc() && end == word.data() + word.size();
  }

  /// Zero-based index from OBJ's: from 1, or negative counting back from the last one so far.
  uint32_t index_of(std::string_view word, size_t count) const {
    int64_t index = 0;
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), index);
    if (code != std::errc() || end != word.data() + word.size() || index == 0) {
      fail(fmt::format("has an index '{}' that is no whole number other than 0",
                       word.substr(0, 40)));
    }
    index += index < 0 ? int64_t(count) : -1;
    if (index < 0 || index >= int64_t(1) << 32) {
      fail(fmt::format("has an index '{}' outside the file's vertices", word.substr(0, 40)));
    }
    return uint32_t(index);
  }

  uint32_t read_corner(std::string_view word) {
    const std::string_view vertex_word = word.substr(0, word.find('/'));
    const uint32_t vertex = index_of(vertex_word, mesh_.position.size());
    std::optional<uint32_t> texture;
    if (vertex_word.size() < word.size()) {
      word.remove_prefix(vertex_word.size() + 1);
      const std::string_view texture_word = word.substr(0, word.find('/'));
      if (!texture_word.empty()) texture = index_of(texture_word, uv_.size());
    }
    corners_.push_back({vertex, texture});
    return vertex;
  }

  void read_face(std::string_view line) {
    std::array<uint32_t, 2> kept{};
    size_t n = 0;
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line), ++n) {
      const uint32_t vertex = read_corner(word);
      if (n >= 2) mesh_.triangle.emplace_back(kept[0], kept[1], vertex);
      kept[n == 0 ? 0 : 1] = vertex;
    }
    if (n < 3) fail(fmt::format("has a face of {} vertices", n));
  }

  /// Vertices stay one (a sheet must not come apart at a texture seam), so uv is taken only when no
  /// vertex has two.
  void take_uv() {
    constexpr uint32_t none = 0xffffffff;
    std::vector<uint32_t> chosen(mesh_.position.size(), none);
    for (const Corner& corner : corners_) {
      if (!corner.texture || *corner.texture >= uv_.size()) return;
      uint32_t& mine = chosen[corner.vertex];
      if (mine != none && uv_[mine] != uv_[*corner.texture]) return;
      mine = *corner.texture;
    }
    mesh_.uv.resize(mesh_.position.size(), Imath::V2f(0));
    for (size_t i = 0; i < chosen.size(); ++i) {
      if (chosen[i] != none) mesh_.uv[i] = uv_[chosen[i]];
    }
  }

  struct Corner {
    uint32_t vertex;
    std::optional<uint32_t> texture;
  };

  const fs::path& path_;
  std::string_view text_;
  int line_ = 0;
  TriangleMesh mesh_;
  std::vector<Imath::V2f> uv_;
  std::vector<Corner> corners_;
};

}  // namespace

TriangleMesh read_obj(const fs::path& path, std::string_view text) {
  return ObjReader(path, text).read();
}

}  // namespace drench
