#include <fmt/format.h>
#include <openvdb/math/Proximity.h>
#include <openvdb/tree/LeafManager.h>

#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/particles_file.h"
#include "pipeline/contract/files/vdb_archive.h"
#include "pipeline/contract/geometry/mesh_to_volume.h"

namespace drench {

namespace {

constexpr float band = 3;              // voxels, a side
constexpr float largest_half = 65504;  // m/s

void check(const std::filesystem::path& path, const TriangleMesh& mesh, double voxel) {
  if (!(voxel > 0) || mesh.velocity.size() != mesh.position.size())
    throw std::logic_error("write_level_set: voxel is not positive, or columns differ in length");
  for (const auto& t : mesh.triangle) {
    if (std::max({t.x, t.y, t.z}) >= mesh.position.size())
      throw std::logic_error("write_level_set: index out of range");
  }
  const auto beyond = [](const Imath::V3f& v, double limit) {
    return !(std::abs(v.x) < limit && std::abs(v.y) < limit && std::abs(v.z) < limit);
  };
  for (size_t i = 0; i < mesh.position.size(); ++i) {
    const Imath::V3f &x = mesh.position[i], &v = mesh.velocity[i];
    // Beyond this a voxel has no 32-bit coordinate.
    if (beyond(x, voxel * (1 << 30))) {
      throw Error(
          fmt::format("{}: vertex {} lies at [{}, {}, {}] m, too far for voxels of {} m; the "
                      "file was not written",
                      path.string(), i, x.x, x.y, x.z, voxel));
    }
    if (beyond(v, largest_half)) {
      throw Error(
          fmt::format("{}: vertex {} moves with [{}, {}, {}] m/s, more than {} m/s; the file was "
                      "not written. The simulation has blown up: use a smaller time step",
                      path.string(), i, v.x, v.y, v.z, largest_half));
    }
  }
}

/// Of the mesh at the point of a triangle that is closest to x, voxels.
openvdb::Vec3s velocity_at(const VoxelMesh& mesh, size_t triangle, const openvdb::Vec3d& x) {
  openvdb::Vec3d weight;
  openvdb::math::closestPointOnTriangleToPoint(mesh.corner(triangle, 0), mesh.corner(triangle, 1),
                                               mesh.corner(triangle, 2), x, weight);
  openvdb::Vec3d velocity(0);
  for (int k = 0; k < 3; ++k) {
    const Imath::V3f& v = mesh.mesh.velocity[mesh.mesh.triangle[triangle][k]];
    velocity += weight[k] * openvdb::Vec3d(v.x, v.y, v.z);
  }
  return openvdb::Vec3s(velocity);
}

openvdb::Vec3SGrid::Ptr velocities(const VoxelMesh& mesh, const openvdb::FloatGrid& surface,
                                   const openvdb::Int32Grid& closest) {
  const auto grid = openvdb::Vec3SGrid::create();
  grid->tree().topologyUnion(surface.tree());
  openvdb::tree::LeafManager<openvdb::Vec3STree> leaves(grid->tree());
  leaves.foreach ([&](openvdb::Vec3STree::LeafNodeType& leaf, size_t) {
    const auto triangle = closest.getConstAccessor();
    for (auto voxel = leaf.beginValueOn(); voxel; ++voxel) {
      const openvdb::Coord at = voxel.getCoord();
      const int t = triangle.getValue(at);
      if (t == no_triangle) throw std::logic_error("write_level_set: a voxel without a triangle");
      voxel.setValue(velocity_at(mesh, size_t(t), at.asVec3d()));
    }
  });
  grid->setTransform(surface.transform().copy());
  grid->setName("v");
  grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  grid->setSaveFloatAsHalf(true);
  return grid;
}

}  // namespace

WrittenFile write_level_set(const std::filesystem::path& path, const TriangleMesh& mesh,
                            double voxel) {
  check(path, mesh, voxel);
  const VoxelMesh in_voxels{mesh, voxel};
  const auto [surface, closest] = closest_triangles(in_voxels, band);
  surface->setName("surface");
  return write_file_whole(path, vdb_bytes({surface, velocities(in_voxels, *surface, *closest)}));
}

}  // namespace drench
