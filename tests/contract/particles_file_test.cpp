#include "pipeline/contract/files/particles_file.h"

#include <tbb/global_control.h>

#include <limits>
#include <random>

#include "tests/contract/damage.h"
#include "tests/contract/sphere_mesh.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

namespace fs = std::filesystem;
using test::error_of;
using test::TemporaryFolder;

constexpr float spacing = 0.01f;  // m

/// n particles in a box on both sides of the origin, ids in no order.
ParticleFrame cloud(size_t n) {
  std::mt19937 random(7);
  const auto even = [&](float low, float high) {
    return low + (high - low) * float(random()) / 4294967296.f;
  };
  ParticleFrame frame;
  frame.spacing = spacing;
  frame.rest_density = 998;
  for (size_t i = 0; i < n; ++i) {
    frame.position.emplace_back(even(-0.3f, 0.3f), even(-0.3f, 0.3f), even(-0.3f, 0.3f));
    frame.velocity.emplace_back(even(-5, 5), even(-5, 5), even(-5, 5));
    frame.density.push_back(even(900, 1100));
    frame.id.push_back(uint32_t((i * 7919 + 13) % n));  // 7919 is prime: a permutation
  }
  return frame;
}

// Positions: 16 bits over a voxel of 4 spacings, so within a step of 4 a / 65535 (6.1e-5 a),
// and float rounding of coordinates up to 0.3 m. Velocity and density: half has 11 bits, so 2^-11
// relative.
TEST(ParticlesFile, ReturnsParticlesWithinTheStatedPrecision) {
  const TemporaryFolder folder;
  const ParticleFrame frame = cloud(5000);
  write_particles(folder / "p.vdb", frame);
  const ParticleFrame read = read_particles(folder / "p.vdb");
  ASSERT_EQ(read.position.size(), frame.position.size());
  EXPECT_EQ(read.spacing, frame.spacing);
  EXPECT_EQ(read.rest_density, frame.rest_density);
  for (size_t i = 0; i < frame.id.size(); ++i) {
    const size_t k = frame.id[i];  // sorted by id, and ids are 0 to n - 1
    ASSERT_EQ(read.id[k], k);
    for (int c = 0; c < 3; ++c) {
      ASSERT_NEAR(read.position[k][c], frame.position[i][c], 6.11e-5 * spacing + 6e-8 * 0.3);
      ASSERT_NEAR(read.velocity[k][c], frame.velocity[i][c], 5 / 2048.);
    }
    ASSERT_NEAR(read.density[k], frame.density[i], 1100 / 2048.);
  }
}

TEST(ParticlesFile, KeepsLargeIdsAndFrameWithoutOptionalColumns) {
  const TemporaryFolder folder;
  ParticleFrame frame = cloud(3);
  frame.density.clear();
  frame.id = {4294967295u, 0u, 2147483648u};
  write_particles(folder / "p.vdb", frame);
  EXPECT_EQ(read_particles(folder / "p.vdb").id,
            (std::vector<uint32_t>{0u, 2147483648u, 4294967295u}));
  EXPECT_TRUE(read_particles(folder / "p.vdb").density.empty());
  frame.id.clear();
  write_particles(folder / "p.vdb", frame);
  EXPECT_EQ(read_particles(folder / "p.vdb").position.size(), 3u);
  EXPECT_TRUE(read_particles(folder / "p.vdb").id.empty());
}

// Halves have 11 bits; sources are whole numbers.
TEST(ParticlesFile, ReturnsSourceAgeAndWetness) {
  const TemporaryFolder folder;
  ParticleFrame frame = cloud(3000);
  for (size_t i = 0; i < frame.id.size(); ++i) {
    frame.source.push_back(uint8_t(i % 256));
    frame.age.push_back(0.01f * float(i) - 2);
    frame.wetness.push_back(float(i) / 3000);
  }
  write_particles(folder / "p.vdb", frame);
  const ParticleFrame read = read_particles(folder / "p.vdb");
  ASSERT_EQ(read.source.size(), frame.source.size());
  for (size_t i = 0; i < frame.id.size(); ++i) {
    const size_t k = frame.id[i];  // sorted by id, and ids are 0 to n - 1
    ASSERT_EQ(read.source[k], frame.source[i]);
    ASSERT_NEAR(read.age[k], frame.age[i], std::abs(frame.age[i]) / 2048);
    ASSERT_NEAR(read.wetness[k], frame.wetness[i], 1 / 2048.);
  }
  frame.age[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(
      error_of([&] { write_particles(folder / "q.vdb", frame); }).find("whose age is not finite"),
      std::string::npos);
}

TEST(ParticlesFile, HoldsNoParticles) {
  const TemporaryFolder folder;
  ParticleFrame frame;
  frame.spacing = spacing;
  write_particles(folder / "p.vdb", frame);
  EXPECT_TRUE(read_particles(folder / "p.vdb").position.empty());
  EXPECT_EQ(read_particles(folder / "p.vdb").spacing, spacing);
}

// Half ends at 65504: a denser fluid must not come back as infinity.
TEST(ParticlesFile, HoldsDensitiesBeyondHalf) {
  const TemporaryFolder folder;
  ParticleFrame frame = cloud(2);
  frame.density = {70000, 65504};
  frame.id = {0, 1};
  write_particles(folder / "p.vdb", frame);
  EXPECT_EQ(read_particles(folder / "p.vdb").density, frame.density);
}

// Enough points for OpenVDB to split the work (its grains are of some thousand).
TEST(ParticlesFile, GivesEqualBytesForAnyNumberOfThreads) {
  const TemporaryFolder folder;
  const ParticleFrame frame = cloud(200000);
  std::vector<Digest> digests;
  for (const size_t threads : {1, 2, 4, 1}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    digests.push_back(write_particles(folder / "p.vdb", frame).digest);
  }
  for (const Digest& digest : digests) EXPECT_EQ(digest, digests[0]);
}

TEST(ParticlesFile, TakesAboutTwelveBytesAParticleOfALattice) {
  const TemporaryFolder folder;
  ParticleFrame frame;
  frame.spacing = spacing;
  for (int k = 0; k < 64000; ++k) {
    frame.position.push_back(spacing * Imath::V3f(k % 40 + .5f, k / 40 % 40 + .5f, k / 1600 + .5f));
    frame.velocity.emplace_back(0.f);
  }
  // Positions alone are 6 bytes, velocities 6; Blosc shrinks what is regular.
  EXPECT_LT(write_particles(folder / "p.vdb", frame).size, 64000u * 12);
}

TEST(ParticlesFile, IsNotWrittenForAParticleThatIsNotFiniteOrTooFar) {
  const TemporaryFolder folder;
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f}) {
    ParticleFrame frame = cloud(10);
    frame.position[4].y = bad;
    const std::string text = error_of([&] { write_particles(folder / "p.vdb", frame); });
    EXPECT_NE(text.find("particle 4"), std::string::npos) << text;
  }
  EXPECT_TRUE(folder.names().empty());
}

// The file carries a digest of itself, so any change of any bit is found: no silent case is
// allowed.
TEST(ParticlesFile, NoticesEveryFlippedBitAndTruncation) {
  const TemporaryFolder folder;
  write_particles(folder / "p.vdb", cloud(300));
  test::expect_damage_is_noticed(folder / "p.vdb", 300,
                                 [](const auto& file) { read_particles(file); });
}

TEST(ParticlesFile, RefusesAFileThatHoldsNoParticles) {
  const TemporaryFolder folder;
  TriangleMesh tetrahedron;
  tetrahedron.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  tetrahedron.velocity.resize(4, Imath::V3f(0));
  tetrahedron.triangle = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  write_level_set(folder / "surface.vdb", tetrahedron, 0.05);
  const std::string text = error_of([&] { read_particles(folder / "surface.vdb"); });
  EXPECT_NE(text.find("no particles"), std::string::npos) << text;
}

TEST(LevelSetFile, GivesEqualBytesForAnyNumberOfThreads) {
  const TemporaryFolder folder;
  TriangleMesh sphere = test::unit_sphere(64, 128);
  sphere.velocity = sphere.position;
  std::vector<Digest> digests;
  for (const size_t threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    digests.push_back(write_level_set(folder / "s.vdb", sphere, 0.02).digest);
  }
  for (const Digest& digest : digests) EXPECT_EQ(digest, digests[0]);
}

}  // namespace
}  // namespace drench
