#include "pipeline/contract/files/obj_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/mesh_text.h"
#include "pipeline/contract/geometry/mesh_builder.h"
#include "pipeline/contract/log.h"

namespace drench {

namespace fs = std::filesystem;

namespace {

class ObjReader {
 public:
  ObjReader(const fs::path& path, std::string_view text, CornerData corners,
            std::span<const Imath::V3f> cut_by)
      : path_(path), text_(text), builder_(path, corners, cut_by, [&path](uint64_t line) {
          return fmt::format("{}:{}", path.string(), line);
        }) {}

  TriangleMesh read() {
    std::string joined;
    while (!is_at_end()) read_line(next_line(joined));
    if (faces_ == 0) fail("has no faces; a triangle mesh is expected");
    warn();
    return builder_.finish();
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw Error(fmt::format("{}:{}: {}. Export the mesh again", path_.string(), line_, why));
  }

  bool is_at_end() const { return text_.empty() && block_.empty(); }

  /// Ends with a line feed, a carriage return or both; without its comment and blanks at its end.
  std::string_view take_line() {
    if (block_.empty()) {
      block_ = text_.substr(0, text_.find('\n'));
      text_.remove_prefix(std::min(block_.size() + 1, text_.size()));
    }
    ++line_;
    std::string_view line = block_.substr(0, block_.find('\r'));
    block_.remove_prefix(std::min(line.size() + 1, block_.size()));
    line = line.substr(0, line.find('#'));
    return line.substr(0, line.find_last_not_of(" \t") + 1);
  }

  /// Whether what follows says something of the mesh; names may end with a backslash of their own.
  static bool is_read(std::string_view line) {
    const std::string_view keyword = take_word(line);
    return keyword == "v" || keyword == "vt" || keyword == "vn" || keyword == "f" ||
           keyword == "fo";
  }

  /// One logical line: a backslash at the end joins the next.
  std::string_view next_line(std::string& joined) {
    std::string_view line = take_line();
    if (!line.ends_with('\\') || !is_read(line)) return line;
    joined.clear();
    for (; line.ends_with('\\'); line = is_at_end() ? std::string_view() : take_line()) {
      line.remove_suffix(1);
      joined += line;
      joined += ' ';
    }
    return joined += line;
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
      builder_.mesh.position.emplace_back(x, y, z);
    } else if (keyword == "vt") {
      const float u = next_float(line);
      builder_.uv.emplace_back(
          u, std::string_view(line).find_first_not_of(" \t") == std::string_view::npos
                 ? 0.f
                 : next_float(line));
    } else if (keyword == "vn") {
      const float x = next_float(line), y = next_float(line), z = next_float(line);
      builder_.normal.emplace_back(x, y, z);
    } else if (keyword == "f" || keyword == "fo") {
      read_face(line);
    } else if (keyword == "surf" || keyword == "curv") {
      ++curved_;
    } else if (keyword.find('\0') != std::string_view::npos) {
      fail("holds bytes of 0: it is UTF-16 without a byte order mark, or no OBJ");
    }
  }

  float next_float(std::string_view& line) {
    const std::string_view word = take_word(line);
    if (const std::optional<float> value = number_.single(word)) return *value;
    fail(fmt::format("holds '{}' where a number is expected{}", word.substr(0, 40),
                     number_.commas() == 0 && word.find(',') == std::string_view::npos
                         ? ""
                         : ", beside numbers with another decimal sign: a decimal comma in one "
                           "place and a point in another could mean two things"));
  }

  /// Zero-based index from OBJ's: from 1, or negative counting back from the last one so far; one
  /// that no file has if it counts back too far.
  uint32_t index_of(std::string_view word, size_t count) const {
    int64_t index = 0;
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), index);
    if (code != std::errc() || end != word.data() + word.size() || index == 0) {
      fail(fmt::format("has an index '{}' that is no whole number other than 0: they count from 1",
                       word.substr(0, 40)));
    }
    index += index < 0 ? int64_t(count) : -1;
    const bool is_possible = index >= 0 && index < int64_t(MeshBuilder::nowhere);
    return is_possible ? uint32_t(index) : MeshBuilder::nowhere;
  }

  MeshBuilder::Corner read_corner(std::string_view word) {
    MeshBuilder::Corner corner;
    const auto next_part = [&] {
      const std::string_view part = word.substr(0, word.find('/'));
      word.remove_prefix(std::min(part.size() + 1, word.size()));
      return part;
    };
    const std::string_view vertex = next_part();
    corner.vertex = index_of(vertex, builder_.mesh.position.size());
    if (corner.vertex == MeshBuilder::nowhere)
      fail(fmt::format("has an index '{}' outside the file's vertices", vertex.substr(0, 40)));
    if (const auto part = next_part(); !part.empty())
      corner.uv = index_of(part, builder_.uv.size());
    if (const auto part = next_part(); !part.empty())
      corner.normal = index_of(part, builder_.normal.size());
    if (!word.empty()) fail("has a corner of a face with more than three parts");
    return corner;
  }

  void read_face(std::string_view line) {
    corners_.clear();
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line))
      corners_.push_back(read_corner(word));
    ++faces_;
    builder_.add_face(corners_, uint64_t(line_));
  }

  void warn() const {
    number_.warn(path_);
    if (curved_ > 0) {
      log_file_warning("mesh", path_,
                       fmt::format("{} curves and curved surfaces were left out; export them as "
                                   "polygons",
                                   curved_));
    }
  }

  const fs::path& path_;
  std::string_view text_, block_;  // what is left; of it up to a line feed
  int line_ = 0;
  uint64_t faces_ = 0, curved_ = 0;
  NumberReader number_;
  MeshBuilder builder_;
  std::vector<MeshBuilder::Corner> corners_;
};

}  // namespace

TriangleMesh read_obj(const fs::path& path, std::string_view text, CornerData corners,
                      std::span<const Imath::V3f> cut_by) {
  return ObjReader(path, text, corners, cut_by).read();
}

}  // namespace drench
