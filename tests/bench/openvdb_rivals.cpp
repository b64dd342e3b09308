#include "tests/bench/openvdb_rivals.h"

#include <openvdb/openvdb.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointRasterizeSDF.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/ParticlesToLevelSet.h>
#include <openvdb/tools/VolumeToMesh.h>

namespace drench::bench {
namespace {

using openvdb::FloatGrid;

/// What ParticlesToLevelSet asks of a list.
struct ParticleList {
  using PosType = openvdb::Vec3R;
  const ParticleFrame& particles;

  size_t size() const { return particles.position.size(); }
  void getPos(size_t i, openvdb::Vec3R& at) const {
    const Imath::V3f& p = particles.position[i];
    at = {p.x, p.y, p.z};
  }
};

TriangleMesh mesh_of(const FloatGrid& grid) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(grid, points, quads, 0.0);
  TriangleMesh mesh;
  mesh.position.reserve(points.size()), mesh.triangle.reserve(2 * quads.size());
  for (const openvdb::Vec3s& p : points) mesh.position.emplace_back(p.x(), p.y(), p.z());
  for (const openvdb::Vec4I& q : quads) {  // clockwise seen from outside
    mesh.triangle.emplace_back(q[0], q[2], q[1]);
    mesh.triangle.emplace_back(q[0], q[3], q[2]);
  }
  return mesh;
}

}  // namespace

TriangleMesh openvdb_level_set(const ParticleFrame& particles, double voxel) {
  openvdb::initialize();
  const double spacing = particles.spacing;
  const FloatGrid::Ptr grid = openvdb::createLevelSet<FloatGrid>(voxel, 3.0);
  openvdb::tools::ParticlesToLevelSet<FloatGrid> raster(*grid);
  raster.setRmin(0);
  raster.rasterizeSpheres(ParticleList{particles}, spacing);
  raster.finalize(true);
  openvdb::tools::LevelSetFilter<FloatGrid> filter(*grid);
  filter.gaussian(), filter.gaussian();
  filter.offset(float(0.5 * spacing));
  return mesh_of(*grid);
}

TriangleMesh openvdb_smooth_spheres(const ParticleFrame& particles, double voxel) {
  namespace points = openvdb::points;
  using openvdb::math::Transform;
  openvdb::initialize();
  const double spacing = particles.spacing;
  std::vector<openvdb::Vec3s> positions;
  positions.reserve(particles.position.size());
  for (const Imath::V3f& p : particles.position) positions.emplace_back(p.x, p.y, p.z);
  const auto grid = points::createPointDataGrid<points::NullCodec, points::PointDataGrid>(
      positions, *Transform::createLinearTransform(2 * spacing));
  return mesh_of(*points::rasterizeSmoothSpheres(*grid, 0.5 * spacing, 2 * spacing, 3.0,
                                                 Transform::createLinearTransform(voxel)));
}

}  // namespace drench::bench
