#pragma once
// OpenVDB's converter from triangles to distances, whose headers stay in one unit: it takes half a
// minute to compile.

#include "pipeline/contract/files/vdb_trees.h"
#include "pipeline/contract/frames.h"

namespace drench {

/// How OpenVDB finds what is inside: by filling from the outside, cavities and pockets included, or
/// not at all.
enum class Inside { filled, unknown };

/// Distances to a mesh within `band` of it, m, vertices rounded to floats in voxels.
openvdb::FloatGrid::Ptr narrow_band(const TriangleMesh& mesh, double voxel, double band,
                                    Inside inside);

/// A TriangleMesh as the converter wants it: in voxels.
struct VoxelMesh {
  const TriangleMesh& mesh;
  double voxel;  // m

  size_t polygonCount() const { return mesh.triangle.size(); }
  size_t pointCount() const { return mesh.position.size(); }
  size_t vertexCount(size_t) const { return 3; }
  openvdb::Vec3d corner(size_t triangle, int k) const {
    const Imath::V3f& x = mesh.position[mesh.triangle[triangle][k]];
    return openvdb::Vec3d(x.x, x.y, x.z) / voxel;
  }
  void getIndexSpacePoint(size_t triangle, size_t k, openvdb::Vec3d& x) const {
    x = corner(triangle, int(k));
  }
};

/// Signed distances to a closed mesh, and by voxel the triangle that is closest.
struct ClosestTriangles {
  openvdb::FloatGrid::Ptr distance;  // m
  openvdb::Int32Grid::Ptr triangle;  // no_triangle beyond the band
};
inline constexpr int no_triangle = -1;

/// @param band  voxels, a side.
ClosestTriangles closest_triangles(const VoxelMesh& mesh, float band);

}  // namespace drench
