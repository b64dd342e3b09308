#include "pipeline/contract/geometry/mesh_to_volume.h"

#include <openvdb/tools/MeshToVolume.h>

#include "pipeline/contract/files/vdb_archive.h"

namespace drench {

using openvdb::FloatGrid, openvdb::Int32Grid;

FloatGrid::Ptr narrow_band(const TriangleMesh& mesh, double voxel, double band, Inside inside) {
  std::vector<openvdb::Vec3s> positions;
  positions.reserve(mesh.position.size());
  for (const Imath::V3f& x : mesh.position) positions.emplace_back(x.x, x.y, x.z);
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(mesh.triangle.size());
  for (const auto& t : mesh.triangle) triangles.emplace_back(t.x, t.y, t.z);
  initialize_vdb();
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
  const float width = float(band / voxel) + 1;
  if (mesh.triangle.empty()) return FloatGrid::create(float(band) + float(voxel));
  if (inside == Inside::unknown) {
    return openvdb::tools::meshToUnsignedDistanceField<FloatGrid>(*transform, positions, triangles,
                                                                  {}, width);
  }
  return openvdb::tools::meshToSignedDistanceField<FloatGrid>(*transform, positions, triangles, {},
                                                              width, width);
}

ClosestTriangles closest_triangles(const VoxelMesh& mesh, float band) {
  initialize_vdb();
  const auto transform = openvdb::math::Transform::createLinearTransform(mesh.voxel);
  const Int32Grid::Ptr triangle = Int32Grid::create(no_triangle);
  const FloatGrid::Ptr distance = openvdb::tools::meshToVolume<FloatGrid>(
      mesh, *transform, band, band, /*flags=*/0, triangle.get());
  return {distance, triangle};
}

}  // namespace drench
