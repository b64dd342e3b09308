#include <fmt/format.h>
#include <openvdb/tools/MeshToVolume.h>

#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/particles_file.h"
#include "pipeline/contract/vdb_archive.h"

namespace drench {

WrittenFile write_level_set(const std::filesystem::path& path, const TriangleMesh& mesh,
                            double voxel) {
  if (!(voxel > 0)) throw std::logic_error("write_level_set: voxel is not positive");
  // Beyond this a voxel has no 32-bit coordinate.
  const double farthest = voxel * (1 << 30);
  std::vector<openvdb::Vec3s> positions;
  positions.reserve(mesh.position.size());
  for (const Imath::V3f& x : mesh.position) {
    if (!(std::abs(x.x) < farthest && std::abs(x.y) < farthest && std::abs(x.z) < farthest)) {
      throw Error(
          fmt::format("{}: vertex {} lies at [{}, {}, {}] m, too far for voxels of {} m; the "
                      "file was not written",
                      path.string(), positions.size(), x.x, x.y, x.z, voxel));
    }
    positions.emplace_back(x.x, x.y, x.z);
  }
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(mesh.triangle.size());
  for (const auto& t : mesh.triangle) {
    if (std::max({t.x, t.y, t.z}) >= positions.size()) {
      throw std::logic_error("write_level_set: index out of range");
    }
    triangles.emplace_back(t.x, t.y, t.z);
  }
  initialize_vdb();
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
  const auto grid =
      openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, positions, triangles, 3.0f);
  grid->setName("surface");
  return write_file_whole(path, vdb_bytes(grid));
}

}  // namespace drench
