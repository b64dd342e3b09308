#pragma once
// From the vertices, corners and faces of a mesh file to a triangle mesh. Part of mesh_file.h.

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/frames.h"

namespace drench {

/// Takes faces as a file has them and says what it left out or mended.
class MeshBuilder {
 public:
  static constexpr uint32_t none = 0xffffffff, nowhere = none - 1;  // an index beyond all

  /// A corner of a face: its vertex, and its own texture coordinate and normal if it has them.
  struct Corner {
    uint32_t vertex = none, uv = none, normal = none;
  };

  /// @param location_of  a face's location in the file from its number: "file.obj:12"
  /// @param cut_by  see read_mesh
  MeshBuilder(const std::filesystem::path& path, CornerData wanted,
              std::span<const Imath::V3f> cut_by, std::function<std::string(uint64_t)> location_of)
      : path_(path), wanted_(wanted), cut_by_(cut_by), location_of_(std::move(location_of)) {}

  /// Vertex columns, in the file's order; their triangles are left to add_face.
  TriangleMesh mesh;
  /// What corners name.
  std::vector<Imath::V2f> uv;
  std::vector<Imath::V3f> normal;

  /// Vertices may follow later. @param number  of the face, for messages
  void add_face(std::span<const Corner> corner, uint64_t number);

  /// Vertices of which corners differ in texture coordinate or normal are split: the first kind
  /// keeps the file's index, others follow after the last vertex, and `point` says whose they are.
  /// @throws Error if a face names a vertex that is not there, a vertex of a face is not finite, or
  ///         a polygon crosses itself, or is not convex and has more than most_corners.
  TriangleMesh finish();

 private:
  struct Polygon {
    size_t triangle, corner, corners;  // first triangle; first of polygon_corner_ and how many
    uint64_t number;
  };
  void set_triangle(size_t k, const Corner& a, const Corner& b, const Corner& c);
  void cut(const Polygon& polygon);
  [[noreturn]] void fail(const std::string& why) const;
  [[noreturn]] void refuse_vertex(size_t triangle, uint32_t index) const;
  void check_vertices() const;
  void mend_columns();
  void fill_normals();
  void drop_lost_indices();
  void split_vertices();
  void warn() const;

  std::filesystem::path path_;
  CornerData wanted_;
  std::span<const Imath::V3f> cut_by_;
  std::function<std::string(uint64_t)> location_of_;
  std::vector<Polygon> polygon_;
  std::vector<Corner> polygon_corner_;
  std::vector<Corner> corner_;  // three a triangle, unless none are wanted
  bool by_corner_ = false;
  uint64_t short_faces_ = 0, lost_corners_ = 0, without_uv_ = 0, bad_uv_ = 0, bad_normals_ = 0,
           bad_values_ = 0;
  uint64_t first_short_face_ = 0;
};

}  // namespace drench
