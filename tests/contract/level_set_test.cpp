// The level set of a sphere against |x| - 1; read by OpenVDB itself, as other programs would.
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <cmath>

#include "pipeline/contract/particles_file.h"
#include "tests/contract/sphere_mesh.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

// The distance to a sphere of radius 1 is |x| - 1. The mesh with 128 x 256 cells lies inside it by
// up to 1 - cos(pi / 128) = 3.0e-4, and trilinear interpolation of a distance of curvature 1 is off
// by up to voxel^2 / 8 an axis, 1.5e-4.
TEST(LevelSetFile, HoldsTheDistanceToASphere) {
  const test::TemporaryFolder folder;
  const double voxel = 0.02;
  write_level_set(folder / "sphere.vdb", test::unit_sphere(128, 256), voxel);

  openvdb::initialize();
  openvdb::io::File file((folder / "sphere.vdb").string());
  file.open(/*delayLoad=*/false);
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("surface"));
  ASSERT_TRUE(grid);
  EXPECT_EQ(grid->getGridClass(), openvdb::GRID_LEVEL_SET);
  const openvdb::tools::GridSampler<openvdb::FloatGrid, openvdb::tools::BoxSampler> sample(*grid);
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    const double z = -1 + 2 * (i + 0.5) / 1000, phi = 2.399963 * i;  // a spiral over the sphere
    const double radius = 1 + voxel * (i % 3 - 1);  // -1 to 1 voxel off it, corners in the band
    const double ring = radius * std::sqrt(1 - z * z);
    const openvdb::Vec3d x(ring * std::cos(phi), ring * std::sin(phi), radius * z);
    worst = std::max(worst, std::abs(sample.wsSample(x) - (radius - 1)));
  }
  EXPECT_LT(worst, 3.0e-4 + 1.5e-4);
  // Outside and inside beyond the band of 3 voxels the sign remains.
  EXPECT_FLOAT_EQ(sample.wsSample(openvdb::Vec3d(0)), float(-3 * voxel));
  EXPECT_FLOAT_EQ(sample.wsSample(openvdb::Vec3d(3)), float(3 * voxel));
}

// Any program that reads OpenVDB must open a particle cache, not only our own reader.
TEST(ParticlesFile, OpensInOpenVdbByName) {
  const test::TemporaryFolder folder;
  ParticleFrame frame;
  frame.spacing = 0.01f;
  frame.position = {{0.1f, 0.2f, 0.3f}, {0.5f, 0.2f, 0.3f}};
  frame.velocity.resize(2, Imath::V3f(1, 2, 3));
  write_particles(folder / "p.vdb", frame);
  openvdb::initialize();
  openvdb::io::File file((folder / "p.vdb").string());
  file.open(/*delayLoad=*/true);
  const auto grid = file.readGrid("particles");
  EXPECT_EQ(grid->valueType(), "ptdataidx32");
  EXPECT_EQ(grid->metaValue<int64_t>("count"), 2);
  EXPECT_NEAR(grid->voxelSize().x(), 0.02, 1e-9);
}

}  // namespace
}  // namespace drench
