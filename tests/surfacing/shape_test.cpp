// Where the surface lies: against the sphere, the plane, and the volume of the particles.

#include <gtest/gtest.h>

#include <cmath>

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

double volume_per_particle(const TriangleMesh& mesh, const ParticleFrame& frame) {
  return volume_of(mesh) / (static_cast<double>(frame.position.size()) * std::pow(spacing, 3));
}

// The limits are those of the project: bias 0.02, scatter 0.025, max 0.12 spacings, normals 1
// degree in the mean. A volume error of 0.15 % is asked of 65 thousand particles; a shift of the
// surface by the bias allowed is 3 * 0.02 / R of the volume, which is the limit of the smaller
// ball.
TEST(SurfaceSphere, ErrorStaysWithinLimitsAtThreeResolutions) {
  for (const size_t n : {8000, 24000, 65000}) {
    SCOPED_TRACE(n);
    const ParticleFrame frame = relaxed_ball(n, spacing, 100, 1);
    const double radius = ball_radius(n, spacing);
    const TriangleMesh mesh = surface_frame(frame, SurfaceSettings{});
    const SphereError error = sphere_error(mesh, radius, spacing);
    EXPECT_LT(std::abs(error.bias), 0.02);
    EXPECT_LT(error.scatter, 0.025);
    EXPECT_LT(error.max, 0.12);
    EXPECT_LT(std::abs(error.volume), n >= 65000 ? 0.0015 : 3 * 0.02 * spacing / radius);
    EXPECT_LT(error.normal_mean, 1.0);
    EXPECT_EQ(topology_of(mesh).euler, 2);
  }
}

// Smoothing must remove bumps and nothing else: each part gets its volume back. Vertices are floats
// of about 1e-7 of 0.2 m, so that 1e-5 of the volume is rounding.
TEST(SurfaceSmoothing, KeepsTheVolumeAndLowersTheScatter) {
  const ParticleFrame frame = relaxed_ball(8000, spacing, 20, 1);
  const double radius = ball_radius(8000, spacing);
  SurfaceSettings settings;
  settings.smoothing = 0;
  const TriangleMesh raw = surface_frame(frame, settings);
  settings.smoothing = 30;
  const TriangleMesh smooth = surface_frame(frame, settings);
  EXPECT_NEAR(volume_of(smooth) / volume_of(raw), 1, 1e-5);
  const SphereError before = sphere_error(raw, radius, spacing);
  const SphereError after = sphere_error(smooth, radius, spacing);
  EXPECT_LT(after.scatter, before.scatter);
  EXPECT_LT(after.normal_mean, 0.8 * before.normal_mean);
}

TEST(SurfaceSmoothing,
     LeavesNoSlivers) {  // below 10 degrees: 10 % of raw marching cubes, gate 0.1 %
  EXPECT_LT(sliver_share(surface_frame(relaxed_ball(8000, spacing, 20, 1), {}), 10), 0.001);
  EXPECT_LT(sliver_share(surface_frame(splash(30000, spacing, 1), {}), 10), 0.001);
}

// The faces of a lattice box stand half a spacing outside its outermost particles. Measured in the
// middle of each face; 0.1 spacings is the scatter (0.02) and what a layer's weight may shift.
TEST(SurfaceBox, FacesStandHalfASpacingOutsideTheParticles) {
  const V3i cells(20, 12, 16);
  const TriangleMesh mesh = surface_frame(shaken_box(V3f(0), cells, spacing, 0, 1), {});
  const V3f high = V3f(cells) * static_cast<float>(spacing);
  size_t seen = 0;
  for (const V3f& p : mesh.position)
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const float margin = 4 * static_cast<float>(spacing);
      if (p[u] < margin || p[u] > high[u] - margin || p[v] < margin || p[v] > high[v] - margin)
        continue;
      const float off = std::min(std::abs(p[axis]), std::abs(p[axis] - high[axis]));
      EXPECT_LT(off, 0.1 * spacing) << p;
      ++seen;
    }
  EXPECT_GT(seen, 1000u);
}

// A lone particle keeps the volume spacing^3; 15 % is the project's limit for drops.
TEST(SurfaceDrops, LoneParticlesAllStayAndKeepTheirVolume) {
  const ParticleFrame frame = lone_particles(1000, spacing, 1);
  for (const double voxel : {0.25, 0.5}) {
    SurfaceSettings settings;
    settings.voxel = voxel;
    const TriangleMesh mesh = surface_frame(frame, settings);
    EXPECT_EQ(topology_of(mesh).components, 1000u);
    EXPECT_EQ(topology_of(mesh).euler, 2000);
    EXPECT_NEAR(volume_per_particle(mesh, frame), 1, 0.15);
  }
}

// A hole lowers the Euler number of a closed sheet below that of a ball. 15 % of volume at one
// spacing: the rim, a twelfth of a sheet of 48 x 48 particles, may round outwards by a spacing.
TEST(SurfaceSheet, OneLayerHasNoHoleAndItsVolume) {
  const ParticleFrame frame = sheet(V2i(48, 48), 1, spacing, 0.1, 1);
  const TriangleMesh mesh = surface_frame(frame, {});
  EXPECT_EQ(topology_of(mesh).components, 1u);
  EXPECT_EQ(topology_of(mesh).euler, 2);
  EXPECT_NEAR(volume_per_particle(mesh, frame), 1, 0.15);
}

TEST(SurfaceSheet, StretchedLayerDoesNotTear) {
  for (const double stretch : {1.2, 1.3, 1.4, 1.5}) {
    SCOPED_TRACE(stretch);
    const TriangleMesh mesh = surface_frame(sheet(V2i(48, 48), stretch, spacing, 0.1, 2), {});
    EXPECT_EQ(topology_of(mesh).components, 1u);
    EXPECT_EQ(topology_of(mesh).euler, 2);
  }
}

// Pool, crown and drops together hold the volume of their particles: 5 % is the limit for a splash.
TEST(SurfaceSplash, KeepsTheVolumeOfItsParticles) {
  const ParticleFrame frame = splash(100000, spacing, 3);
  EXPECT_NEAR(volume_per_particle(surface_frame(frame, {}), frame), 1, 0.05);
}

TEST(SurfaceTouchingSpheres, AreOneBodyWhenTheyOverlapAndTwoWhenApart) {
  for (const double gap : {-1.0, 4.0}) {  // spacings
    const TriangleMesh mesh = surface_frame(two_balls(4000, spacing, 20, gap), {});
    EXPECT_EQ(topology_of(mesh).components, gap < 0 ? 1u : 2u) << gap;
  }
}

TEST(SurfaceNormals, HaveUnitLength) {
  for (const V3f& n : surface_frame(splash(20000, spacing, 5), {}).normal)
    EXPECT_NEAR(n.length(), 1, 1e-5);  // rounding of a division in float
}

/// Mean square of the distance from the X axis of vertices between the planes, spacings^2.
double mean_square_radius(const TriangleMesh& mesh, float from, float to) {
  double sum = 0, count = 0;
  for (const V3f& p : mesh.position)
    if (p.x > from && p.x < to) sum += (p.y * p.y + p.z * p.z) / (spacing * spacing), ++count;
  return sum / count;
}

// A thread of particles hangs on a ball: an even shift of the whole part cannot give back what
// smoothing takes from it. Threads two wide keep their cross-section; one wide they are a string of
// beads, of which necks and knots are evened out. With passes back over the displacement as a
// vector the two lose 15 % and 87 %.
TEST(SurfaceThreads, AreNotThinnedOut) {
  for (const auto& [wide, least] : {std::pair{1, 0.6}, {2, 0.98}, {3, 0.98}}) {
    ParticleFrame frame = relaxed_ball(5000, spacing, 20, 1);
    float radius = 0;
    for (const V3f& p : frame.position) radius = std::max(radius, p.length());
    const float end = radius + 0.7f * spacing;
    ParticleFrame thread = shaken_box(V3f(end, -0.5f * wide * spacing, -0.5f * wide * spacing),
                                      {30, wide, wide}, spacing, 0.1, 3);
    append(frame, thread);
    SurfaceSettings raw;
    raw.smoothing = 0;
    const float from = end + 8 * spacing, to = end + 24 * spacing;
    const TriangleMesh mesh = surface_frame(frame, {});
    EXPECT_GT(mean_square_radius(mesh, from, to),
              least * mean_square_radius(surface_frame(frame, raw), from, to))
        << wide;
    EXPECT_EQ(topology_of(mesh).components, 1u);
  }
}

// Bar: 0.1 % of the triangles with an angle below 10 degrees.
TEST(SurfaceTriangles, HaveNoSmallAngles) {
  EXPECT_LT(sliver_share(surface_frame(splash(50000, spacing, 3), {}), 10), 1e-3);
  EXPECT_LT(sliver_share(surface_frame(lone_particles(200, spacing, 3), {}), 10), 1e-3);
}

}  // namespace
}  // namespace drench
