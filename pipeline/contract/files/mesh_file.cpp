#include "pipeline/contract/files/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/mesh_columns.h"
#include "pipeline/contract/files/mesh_text.h"
#include "pipeline/contract/files/obj_file.h"
#include "pipeline/contract/files/ply_file.h"

namespace drench {

namespace fs = std::filesystem;
static_assert(std::endian::native == std::endian::little);

namespace {

void append(std::string& bytes, const void* data, size_t size) {
  bytes.append(static_cast<const char*>(data), size);
}

/// One column group of a vertex: its property names and where its floats are.
struct VertexColumns {
  std::vector<std::string_view> names;
  const float* data;
};

std::vector<VertexColumns> columns_of(const TriangleMesh& mesh) {
  const auto start = [](const auto& column) { return &column.data()->x; };
  std::vector<VertexColumns> columns;
  if (mesh.position.empty()) return columns;
  columns.push_back({{"x", "y", "z"}, start(mesh.position)});
  columns.push_back({{"vx", "vy", "vz"}, start(mesh.velocity)});
  if (!mesh.normal.empty()) columns.push_back({{"nx", "ny", "nz"}, start(mesh.normal)});
  if (!mesh.uv.empty()) columns.push_back({{"s", "t"}, start(mesh.uv)});
  if (!mesh.rest_position.empty()) {
    columns.push_back({{"rest_x", "rest_y", "rest_z"}, start(mesh.rest_position)});
  }
  for (const auto& [name, values] : mesh_columns)
    if (!(mesh.*values).empty()) columns.push_back({{name}, (mesh.*values).data()});
  return columns;
}

void check_columns(const TriangleMesh& mesh) {
  const size_t n = mesh.position.size();
  const auto fits = [&](const auto& column) { return column.empty() || column.size() == n; };
  if (mesh.velocity.size() != n || !fits(mesh.normal) || !fits(mesh.uv) ||
      !fits(mesh.rest_position) || !fits(mesh.point) || !fits(mesh.id) ||
      !std::all_of(std::begin(mesh_columns), std::end(mesh_columns),
                   [&](const MeshColumn& column) { return fits(mesh.*column.values); })) {
    throw std::logic_error("mesh file: vertex columns differ in length");
  }
  if (!mesh.contact.empty() && mesh.contact.size() != mesh.triangle.size())
    throw std::logic_error("write_mesh: as many contacts as triangles");
  for (const auto& t : mesh.triangle) {
    if (std::max({t.x, t.y, t.z}) >= n) throw std::logic_error("mesh file: index out of range");
  }
}

void check_finite(const fs::path& path, std::string_view name, size_t vertex, const float* row,
                  size_t width) {
  if (std::all_of(row, row + width, [](float value) { return std::isfinite(value); })) return;
  throw Error(
      fmt::format("{}: {} of vertex {} is not finite; the file was not written. If `drench verify` "
                  "finds the particles sound, this is a fault of the mesher: change surface.voxel "
                  "a little and report the shot",
                  path.string(), name, vertex));
}

std::string header_of(const TriangleMesh& mesh, const std::vector<VertexColumns>& columns) {
  std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment Drench: metres, metres per second\n"
      "element vertex {}\n",
      mesh.position.size());
  for (const VertexColumns& column : columns) {
    for (const std::string_view name : column.names)
      header += fmt::format("property float {}\n", name);
  }
  if (!mesh.point.empty()) header += "property uint point\n";
  if (!mesh.id.empty()) header += "property int id\n";
  if (columns.empty()) header += "property float x\nproperty float y\nproperty float z\n";
  return header +
         fmt::format("element face {}\nproperty list uchar int vertex_indices\n{}end_header\n",
                     mesh.triangle.size(), mesh.contact.empty() ? "" : "property uchar contact\n");
}

/// Text of an OBJ, in one buffer that is never too small.
class ObjText {
 public:
  explicit ObjText(const TriangleMesh& mesh)
      : normals_(!mesh.normal.empty()),
        digits_(std::to_string(mesh.position.size()).size()),
        text_(comment.size() + (mesh.position.size() + mesh.normal.size()) * vertex_line +
                  mesh.triangle.size() * (12 + 6 * digits_),
              '\0'),
        end_(text_.data()) {
    put(comment);
  }

  void add_vertex(std::string_view keyword, const Imath::V3f& value) {
    put(keyword);
    for (const float number : {value.x, value.y, value.z}) {
      put(" ");
      end_ = std::to_chars(end_, end_ + longest_float, number).ptr;
    }
    put("\n");
  }
  void add_triangle(const Imath::Vec3<uint32_t>& t) {
    put("f");
    for (const uint32_t index : {t.x, t.y, t.z}) {
      put(" ");
      const char* const number = end_;
      end_ = std::to_chars(end_, end_ + digits_, index + 1).ptr;
      if (!normals_) continue;
      const std::string_view again(number, size_t(end_ - number));
      put("//");
      put(again);
    }
    put("\n");
  }
  std::string_view text() const { return {text_.data(), size_t(end_ - text_.data())}; }

 private:
  void put(std::string_view part) { end_ = std::copy(part.begin(), part.end(), end_); }

  static constexpr std::string_view comment = "# Drench: metres\n";
  static constexpr size_t longest_float = 15;                             // -1.17549435e-38
  static constexpr size_t vertex_line = 2 + 3 * (1 + longest_float) + 1;  // "vn", numbers, end
  bool normals_;
  size_t digits_;  // of the largest index
  std::string text_;
  char* end_;
};

}  // namespace

WrittenFile write_mesh(const fs::path& path, const TriangleMesh& mesh) {
  check_columns(mesh);
  const std::vector<VertexColumns> columns = columns_of(mesh);
  std::string bytes = header_of(mesh, columns);
  bytes.reserve(bytes.size() + mesh.position.size() * 64 + mesh.triangle.size() * 14);
  for (size_t i = 0; i < mesh.position.size(); ++i) {
    for (const VertexColumns& column : columns) {
      const size_t width = column.names.size();
      const float* const row = column.data + i * width;
      check_finite(path, column.names[0], i, row, width);
      append(bytes, row, width * sizeof(float));
    }
    if (!mesh.point.empty()) append(bytes, &mesh.point[i], sizeof(uint32_t));
    if (!mesh.id.empty()) append(bytes, &mesh.id[i], sizeof(uint32_t));
  }
  for (size_t k = 0; k < mesh.triangle.size(); ++k) {
    bytes.push_back(3);
    append(bytes, &mesh.triangle[k].x, 3 * sizeof(uint32_t));
    if (!mesh.contact.empty()) bytes.push_back(static_cast<char>(mesh.contact[k]));
  }
  return write_file_whole(path, bytes);
}

WrittenFile write_obj(const fs::path& path, const TriangleMesh& mesh) {
  check_columns(mesh);
  ObjText text(mesh);
  for (size_t i = 0; i < mesh.position.size(); ++i) {
    check_finite(path, "x", i, &mesh.position[i].x, 3);
    text.add_vertex("v", mesh.position[i]);
  }
  for (size_t i = 0; i < mesh.normal.size(); ++i) {
    check_finite(path, "nx", i, &mesh.normal[i].x, 3);
    text.add_vertex("vn", mesh.normal[i]);
  }
  for (const auto& t : mesh.triangle) text.add_triangle(t);
  return write_file_whole(path, text.text());
}

TriangleMesh read_mesh(const fs::path& path, CornerData corners,
                       std::span<const Imath::V3f> cut_by) {
  std::string kind = path.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](unsigned char c) {
    return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : char(c);
  });
  if (kind != ".ply" && kind != ".obj") {
    throw Error(
        fmt::format("{}: meshes are read from .ply and .obj files, not '{}'", path.string(), kind));
  }
  const std::string text = plain_text(path, read_text(path, uint64_t(1) << 34));
  return kind == ".obj" ? read_obj(path, text, corners, cut_by)
                        : read_ply(path, text, corners, cut_by);
}

}  // namespace drench
