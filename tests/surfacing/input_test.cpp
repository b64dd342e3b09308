// Input that cannot be surfaced ends in one message that names what and where.

#include <gtest/gtest.h>

#include <limits>

#include "surfacing/surface.h"
#include "tests/surfacing/mesh_checks.h"
#include "tests/surfacing/scenes.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using namespace surfacing_scenes;
using Imath::V3f;

constexpr double spacing = 0.01;  // m

void expect_message(const ParticleFrame& frame, const SurfaceSettings& settings, const char* part) {
  const std::string message = test::error_of([&] { surface_frame(frame, settings); });
  EXPECT_NE(message.find(part), std::string::npos) << "message: " << message;
}

TEST(SurfaceInput, WithoutParticlesGivesAnEmptyMesh) {
  ParticleFrame frame;
  frame.spacing = static_cast<float>(spacing);
  const TriangleMesh mesh = surface_frame(frame, {});
  EXPECT_TRUE(mesh.position.empty());
  EXPECT_TRUE(mesh.triangle.empty());
}

TEST(SurfaceInput, NamesTheFirstParticleThatIsNotFinite) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity()}) {
    ParticleFrame frame = random_cloud(50000, 1, spacing, 1);
    frame.position[40321].y = frame.position[49999].x = bad;
    expect_message(frame, {}, "position of particle 40321");
    frame = random_cloud(50000, 1, spacing, 1);
    frame.velocity[17].z = frame.velocity[30000].z = bad;
    expect_message(frame, {}, "velocity of particle 17 ");
  }
}

TEST(SurfaceInput, RefusesSettingsOutOfRangeByName) {
  const ParticleFrame frame = lone_particles(8, spacing, 1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double voxel : {0.0, -1.0, 1e-9, 50.0, nan}) {
    SurfaceSettings settings;
    settings.voxel = voxel;
    expect_message(frame, settings, "surface.voxel");
  }
  for (const double support : {0.0, 0.5, 8.5, nan}) {
    SurfaceSettings settings;
    settings.support = support;
    expect_message(frame, settings, "surface.support");
  }
  for (const double iso : {0.0, 1.0, -3.0, nan}) {
    SurfaceSettings settings;
    settings.iso_value = iso;
    expect_message(frame, settings, "surface.iso_value");
  }
  SurfaceSettings settings;
  settings.smoothing = -1;
  expect_message(frame, settings, "surface.smoothing");
}

TEST(SurfaceInput, RefusesColumnsOfDifferentLengthAndASpacingOfZero) {
  ParticleFrame frame = lone_particles(8, spacing, 1);
  frame.velocity.pop_back();
  expect_message(frame, {}, "8 positions but 7 velocities");
  frame = lone_particles(8, spacing, 1);
  for (const float bad : {0.f, -1.f, std::numeric_limits<float>::quiet_NaN()}) {
    frame.spacing = bad;
    expect_message(frame, {}, "spacing");
  }
}

TEST(SurfaceInput, RefusesMoreMemoryThanAllowedWithTheNumber) {
  SurfaceSettings settings;
  settings.memory_gib = 0.002;
  expect_message(random_cloud(20000, 0.05, spacing, 1), settings, "GiB");
}

TEST(SurfaceInput, RefusesParticlesTooFarApartForTheLattice) {
  ParticleFrame frame = lone_particles(2, spacing, 1);
  frame.position[1].x = 1e30f;
  expect_message(frame, {}, "spread over");
}

// What the shot file accepts must not fail after the simulation is done.
TEST(SurfaceInput, MeshesAtTheEndsOfTheRangesAreClosed) {
  for (const auto& [voxel, support] :
       {std::pair{0.05, 1.0}, {0.2, 8.0}, {1.0, 1.0}, {4.0, 4.0}, {4.0, 8.0}})
    for (const double iso : {0.01, 0.99}) {
      SCOPED_TRACE(testing::Message() << voxel << " " << support << " " << iso);
      SurfaceSettings settings;
      settings.voxel = voxel;
      settings.support = support;
      settings.iso_value = iso;
      const TriangleMesh mesh = surface_frame(random_cloud(300, 1, spacing, 1), settings);
      EXPECT_TRUE(surfacing_checks::defects_of(mesh) == surfacing_checks::Defects{});
    }
}

}  // namespace
}  // namespace drench
