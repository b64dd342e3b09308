#include "pipeline/contract/files/foam_file.h"

#include <tbb/global_control.h>

#include <limits>
#include <random>

#include "pipeline/contract/files/particles_file.h"
#include "tests/contract/damage.h"
#include "tests/same_bits.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using test::error_of;
using test::same_bits;
using test::TemporaryFolder;

constexpr float spacing = 0.01f;  // m

/// n particles on both sides of the origin, ids rising with gaps.
FoamFrame foam_of(size_t n) {
  std::mt19937 random(7);
  const auto even = [&](float low, float high) {
    return low + (high - low) * float(random()) / 4294967296.f;
  };
  FoamFrame frame;
  frame.spacing = spacing;
  for (size_t i = 0; i < n; ++i) {
    frame.position.emplace_back(even(-0.3f, 0.3f), even(-0.3f, 0.3f), even(-0.3f, 0.3f));
    frame.velocity.emplace_back(even(-5, 5), even(-5, 5), even(-5, 5));
    frame.id.push_back(uint32_t(3 * i + 1));
    frame.age.push_back(even(0, 4));
    frame.radius.push_back(even(1e-5f, 1e-3f));
    frame.kind.push_back(FoamKind(i % 3));
  }
  frame.next_id = uint32_t(3 * n + 5);
  return frame;
}

// Positions have 16 bits over 4 spacings (a step is 6.1e-5 a), all else comes back as it was.
TEST(FoamFile, ReturnsWhatTheNextFrameStartsFrom) {
  const TemporaryFolder folder;
  const FoamFrame frame = foam_of(5000);
  write_foam(folder / "f.vdb", frame);
  const FoamFrame read = read_foam(folder / "f.vdb");
  ASSERT_EQ(read.position.size(), frame.position.size());
  for (size_t i = 0; i < frame.id.size(); ++i)
    for (int c = 0; c < 3; ++c)
      ASSERT_NEAR(read.position[i][c], frame.position[i][c], 6.11e-5 * spacing + 6e-8 * 0.3);
  EXPECT_TRUE(same_bits(read.velocity, frame.velocity));
  EXPECT_TRUE(same_bits(read.age, frame.age));
  EXPECT_TRUE(same_bits(read.radius, frame.radius));
  EXPECT_EQ(read.id, frame.id);
  EXPECT_EQ(read.kind, frame.kind);
  EXPECT_EQ(read.next_id, frame.next_id);
  EXPECT_EQ(read.spacing, spacing);
}

TEST(FoamFile, HoldsNoFoam) {
  const TemporaryFolder folder;
  write_foam(folder / "f.vdb", foam_of(0));
  const FoamFrame read = read_foam(folder / "f.vdb");
  EXPECT_TRUE(read.position.empty());
  EXPECT_EQ(read.next_id, 5u);
}

TEST(FoamFile, GivesEqualBytesForAnyNumberOfThreads) {
  const TemporaryFolder folder;
  const FoamFrame frame = foam_of(100000);
  std::vector<Digest> digests;
  for (const size_t threads : {1, 2, 4, 1}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    digests.push_back(write_foam(folder / "f.vdb", frame).digest);
  }
  for (const Digest& digest : digests) EXPECT_EQ(digest, digests[0]);
}

TEST(FoamFile, NoticesEveryFlippedBitAndTruncation) {
  const TemporaryFolder folder;
  write_foam(folder / "f.vdb", foam_of(300));
  test::expect_damage_is_noticed(folder / "f.vdb", 200, [](const auto& file) { read_foam(file); });
}

TEST(FoamFile, IsNotTakenForFluidNorFluidForFoam) {
  const TemporaryFolder folder;
  write_foam(folder / "f.vdb", foam_of(3));
  EXPECT_NE(error_of([&] { read_particles(folder / "f.vdb"); }).find("rest_density"),
            std::string::npos);
  ParticleFrame fluid;
  fluid.spacing = spacing;
  write_particles(folder / "p.vdb", fluid);
  EXPECT_NE(error_of([&] { read_foam(folder / "p.vdb"); }).find("no foam"), std::string::npos);
}

TEST(FoamFile, IsNotWrittenForAParticleThatIsNotFiniteOrTooFar) {
  const TemporaryFolder folder;
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), 1e30f}) {
    FoamFrame frame = foam_of(10);
    frame.position[4].y = bad;
    EXPECT_NE(error_of([&] { write_foam(folder / "f.vdb", frame); }).find("particle 13"),
              std::string::npos);
  }
  EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace drench
