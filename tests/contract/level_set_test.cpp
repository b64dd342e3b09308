// The level set of a sphere against |x| - 1; read by OpenVDB itself, as other programs would.
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <cmath>
#include <limits>

#include "pipeline/contract/files/particles_file.h"
#include "pipeline/contract/geometry/triangle.h"
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

/// Turning with omega, rad/s, and moving with 1 m/s along x.
const Imath::V3f omega(1, 2, -2);
Imath::V3f velocity_of(const Imath::V3f& x) { return omega.cross(x) + Imath::V3f(1, 0, 0); }

template <class Grid>
typename Grid::Ptr read_grid(const std::filesystem::path& path, const char* name) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(/*delayLoad=*/false);
  return openvdb::gridPtrCast<Grid>(file.readGrid(name));
}

// Against every triangle, on every voxel of the band. The velocity is that of a point of the mesh,
// so off omega x r by omega times the point's distance at most, and by the rounding to half: 2^-10
// a component below 4 m/s. OpenVDB hands triangles on from voxel to voxel: the nearest one within a
// voxel of the mesh, up to 0.7 voxels too far at the band's rim of this coarse sphere.
TEST(LevelSetFile, HoldsDistanceAndVelocityOfTheMeshOnEveryVoxelOfTheBand) {
  const test::TemporaryFolder folder;
  TriangleMesh sphere = test::unit_sphere(16, 32);
  for (size_t i = 0; i < sphere.position.size(); ++i)
    sphere.velocity[i] = velocity_of(sphere.position[i]);
  const float voxel = 0.05f;
  write_level_set(folder / "sphere.vdb", sphere, voxel);
  const auto phi = read_grid<openvdb::FloatGrid>(folder / "sphere.vdb", "surface");
  const auto v = read_grid<openvdb::Vec3SGrid>(folder / "sphere.vdb", "v");
  ASSERT_TRUE(phi && v);
  EXPECT_EQ(v->transform(), phi->transform());
  EXPECT_TRUE(v->tree().hasSameTopology(phi->tree()));
  EXPECT_GT(v->activeVoxelCount(), 6 * 4 * M_PI / (voxel * voxel) * 0.9);  // six layers of a sphere

  // In voxels, by whether the mesh is within a voxel: of phi, and of how much farther than the mesh
  // the point is that has the velocity.
  double phi_off[2] = {}, v_off[2] = {};
  for (auto at = v->cbeginValueOn(); at; ++at) {
    const openvdb::Coord c = at.getCoord();
    const Imath::V3f x = voxel * Imath::V3f(float(c.x()), float(c.y()), float(c.z()));
    float distance = 1e9f;
    for (const auto& t : sphere.triangle) {
      const auto& p = sphere.position;
      distance = std::min(distance, (x - closest_on_triangle(x, p[t.x], p[t.y], p[t.z])).length());
    }
    const bool far = distance > voxel;
    const double off = std::abs(std::abs(phi->tree().getValue(c)) - distance);
    phi_off[far] = std::max(phi_off[far], off / voxel);
    const openvdb::Vec3s got = *at;
    const float slip = (Imath::V3f(got.x(), got.y(), got.z()) - velocity_of(x)).length();
    v_off[far] = std::max(v_off[far], double(slip / omega.length() - distance) / voxel);
  }
  EXPECT_LT(phi_off[0], 1e-4);
  EXPECT_LT(phi_off[1], 0.2);
  const double rounding = std::sqrt(3.0) / 1024 / omega.length() / voxel;
  EXPECT_LT(v_off[0], rounding);
  EXPECT_LT(v_off[1], 1.0);
}

TEST(LevelSetFile, HoldsTwoEmptyGridsWithoutAMesh) {
  const test::TemporaryFolder folder;
  write_level_set(folder / "empty.vdb", {}, 0.05);
  const auto phi = read_grid<openvdb::FloatGrid>(folder / "empty.vdb", "surface");
  const auto v = read_grid<openvdb::Vec3SGrid>(folder / "empty.vdb", "v");
  ASSERT_TRUE(phi && v);
  EXPECT_EQ(phi->activeVoxelCount() + v->activeVoxelCount(), 0u);
  EXPECT_FLOAT_EQ(phi->background(), 0.15f);  // all is outside
}

TEST(LevelSetFile, IsNotWrittenForAVertexThatItCannotHold) {
  const test::TemporaryFolder folder;
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), 1e30f}) {
    for (const bool moving : {false, true}) {
      TriangleMesh sphere = test::unit_sphere(8, 16);
      (moving ? sphere.velocity : sphere.position)[4].y = bad;
      const std::string text =
          test::error_of([&] { write_level_set(folder / "s.vdb", sphere, 0.1); });
      EXPECT_NE(text.find("vertex 4"), std::string::npos) << text;
    }
  }
  EXPECT_TRUE(folder.names().empty());
  test::write_quickly(folder / "taken", "a file");
  test::error_of([&] { write_level_set(folder / "taken/s.vdb", test::unit_sphere(8, 16), 0.1); });
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
  EXPECT_NEAR(grid->voxelSize().x(), 0.04, 1e-9);
}

}  // namespace
}  // namespace drench
