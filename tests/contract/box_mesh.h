#pragma once
// A box, as a mesh and as a file.

#include <filesystem>
#include <string>

#include "pipeline/contract/files/files.h"
#include "pipeline/contract/frames.h"

namespace drench::test {

/// A box as 12 outward triangles on 8 vertices.
inline TriangleMesh box_mesh(const Imath::V3f& min, const Imath::V3f& max) {
  TriangleMesh mesh;
  for (int k = 0; k < 8; ++k)
    mesh.position.emplace_back((k & 1 ? max : min).x, (k & 2 ? max : min).y, (k & 4 ? max : min).z);
  const uint32_t quad[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                               {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& q : quad) {
    mesh.triangle.emplace_back(q[0], q[1], q[2]);
    mesh.triangle.emplace_back(q[0], q[2], q[3]);
  }
  mesh.velocity.resize(8, Imath::V3f(0));
  return mesh;
}

/// A box from the origin to `size` m as an OBJ file.
inline void write_box(const std::filesystem::path& file, const Imath::V3f& size) {
  const TriangleMesh box = box_mesh(Imath::V3f(0), size);
  std::string text;
  for (const Imath::V3f& p : box.position)
    text +=
        "v " + std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + "\n";
  for (const auto& t : box.triangle) {
    text += "f " + std::to_string(t.x + 1) + " " + std::to_string(t.y + 1) + " " +
            std::to_string(t.z + 1) + "\n";
  }
  write_file_whole(file, text);
}

}  // namespace drench::test
