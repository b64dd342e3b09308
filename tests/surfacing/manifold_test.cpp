// Every surface is closed, oriented and 2-manifold, whatever the particles do.

#include <gtest/gtest.h>

#include "surfacing/surface.h"
#include "tests/surfacing/mesh_checks.h"
#include "tests/surfacing/scenes.h"

namespace drench {
namespace {

using namespace surfacing_scenes;
using namespace surfacing_checks;
using Imath::V2i;
using Imath::V3f;
using Imath::V3i;

constexpr double spacing = 0.01;  // m

void expect_manifold(const ParticleFrame& frame, const SurfaceSettings& settings = {}) {
  const TriangleMesh mesh = surface_frame(frame, settings);
  EXPECT_FALSE(mesh.triangle.empty());
  const Defects defects = defects_of(mesh);
  EXPECT_EQ(defects.bad_triangles, 0u);
  EXPECT_EQ(defects.unmatched_edges, 0u);
  EXPECT_EQ(defects.repeated_edges, 0u);
  EXPECT_EQ(defects.split_fans, 0u);
  EXPECT_GT(volume_of(mesh), 0) << "the surface must face outwards";
}

SurfaceSettings settings_with(double voxel, int smoothing) {
  SurfaceSettings settings;
  settings.voxel = voxel;
  settings.smoothing = smoothing;
  return settings;
}

TEST(SurfaceManifold, HoldsForRandomCloudsOfAnyDensity) {
  for (uint32_t seed = 0; seed < 24; ++seed)
    for (const double per_cell : {0.05, 0.3, 0.6, 1.0, 3.0}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << per_cell << " per cell");
      expect_manifold(random_cloud(2000, per_cell, spacing, seed));
    }
}

TEST(SurfaceManifold, HoldsForRandomCloudsOnCoarseAndFineLattices) {
  for (uint32_t seed = 0; seed < 6; ++seed)
    for (const double voxel : {0.2, 0.37, 1.0, 1.9}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", voxel " << voxel);
      expect_manifold(random_cloud(1000, 0.5, spacing, seed), settings_with(voxel, 0));
    }
}

TEST(SurfaceManifold, HoldsForASphere) { expect_manifold(relaxed_ball(20000, spacing, 10, 1)); }

TEST(SurfaceManifold,
     HoldsForABoxAlongTheLattice) {  // field values tie with the iso value by symmetry
  expect_manifold(shaken_box(V3f(0), V3i(16, 8, 24), spacing, 0, 1), settings_with(0.5, 0));
}

TEST(SurfaceManifold, HoldsForSheets) {
  for (const double stretch : {1.0, 1.3, 1.6})
    expect_manifold(sheet(V2i(40, 40), stretch, spacing, 0.1, 1));
}

TEST(SurfaceManifold, HoldsForTouchingSpheres) {
  for (const double gap : {-0.5, 0.0, 0.3, 0.6, 1.0})  // spacings between the balls
    expect_manifold(two_balls(4000, spacing, 10, gap));
}

TEST(SurfaceManifold, HoldsForASplash) {
  for (const int smoothing : {0, 10})
    expect_manifold(splash(100000, spacing, 7), settings_with(0.5, smoothing));
}

TEST(SurfaceManifold, HoldsForOneParticleAndForManyAtOnePoint) {
  for (const size_t count : {1, 2, 1000}) {
    ParticleFrame frame = lone_particles(1, spacing, 3);
    frame.position.resize(count, frame.position[0]);
    frame.velocity.resize(count, V3f(0));
    expect_manifold(frame);
  }
}

// Particles 10 km apart: blocks are found by hashing, so that only those near particles are stored.
TEST(SurfaceManifold, HoldsForParticlesFarApartWithinTheMemoryOfTwo) {
  ParticleFrame frame = lone_particles(1, spacing, 3);
  frame.position.push_back(frame.position[0] + V3f(1e4f, 1e4f, -1e4f));
  frame.velocity.resize(2, V3f(0));
  SurfaceSettings settings;
  settings.memory_gib = 1e-3;
  const TriangleMesh mesh = surface_frame(frame, settings);
  EXPECT_TRUE(defects_of(mesh) == Defects{});
  EXPECT_EQ(topology_of(mesh).components, 2u);
}

}  // namespace
}  // namespace drench
