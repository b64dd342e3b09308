// Equal input gives equal bits: for any thread count, with or without skipping, moved or not.

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "surfacing/surface.h"
#include "tests/same_bits.h"
#include "tests/surfacing/scenes.h"

namespace drench {
namespace {

using namespace surfacing_scenes;
using Imath::V3d;
using Imath::V3f;
using Imath::V3i;
using test::same_bits;

constexpr double spacing = 0.01;  // m

void expect_same(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_FALSE(a.triangle.empty());
  test::expect_same_bits(a, b);
}

TEST(SurfaceBits, AreTheSameForAnyThreadCount) {
  ParticleFrame frame = splash(60000, spacing, 1);
  shuffle(frame, 2);
  const auto with_threads = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(threads));
    tbb::task_arena arena(threads);
    return arena.execute([&] { return surface_frame(frame, {}); });
  };
  const TriangleMesh one = with_threads(1);
  expect_same(one, with_threads(2));
  expect_same(one, with_threads(16));
}

TEST(SurfaceBits, AreTheSameWithAndWithoutSkippingTheInterior) {
  ParticleFrame hollow = relaxed_ball(60000, spacing, 10, 1);  // with a void of 4 spacings inside
  std::erase_if(hollow.position, [](const V3f& p) { return (p - V3f(0.02f)).length() < 0.04f; });
  hollow.velocity.resize(hollow.position.size());
  for (const ParticleFrame& frame :
       {relaxed_ball(60000, spacing, 10, 1), hollow, splash(100000, spacing, 1),
        shaken_box(V3f(0), V3i(40), spacing, 0.3, 1), random_cloud(30000, 2.0, spacing, 1)}) {
    SurfaceStats skipped, evaluated;
    const TriangleMesh a = surface_frame(frame, {}, {}, InteriorBlocks::skip, &skipped);
    const TriangleMesh b = surface_frame(frame, {}, {}, InteriorBlocks::evaluate, &evaluated);
    expect_same(a, b);
    EXPECT_LT(skipped.evaluated_blocks, evaluated.evaluated_blocks);
  }
}

TEST(SurfaceBits, AreTheSameWhetherDensitiesAreGivenOrNot) {
  ParticleFrame frame = splash(20000, spacing, 1);
  const TriangleMesh without = surface_frame(frame, {});
  frame.density.assign(frame.position.size(), 700.f);
  expect_same(without, surface_frame(frame, {}));
}

// Spacing and shifts are powers of two and positions are cut to 2^-20 m, so that moving a particle
// is exact. Then everything but the last rounding of a vertex's place must be the same.
TEST(SurfaceBits, AreTheSameAfterAMoveByWholeVoxels) {
  ParticleFrame frame = splash(20000, 1.0 / 64, 1);
  for (V3f& p : frame.position)
    for (int axis = 0; axis < 3; ++axis) p[axis] = std::round(p[axis] * 1048576) / 1048576;
  const TriangleMesh mesh = surface_frame(frame, {});
  const V3f shift = V3f(3, -5, 1) * (1.f / 128);  // voxels of half a spacing, no whole blocks
  ParticleFrame moved = frame;
  for (size_t i = 0; i < frame.position.size(); ++i) {
    moved.position[i] += shift;
    ASSERT_EQ(moved.position[i] - shift, frame.position[i]);
  }
  const TriangleMesh other = surface_frame(moved, {});
  EXPECT_TRUE(same_bits(mesh.triangle, other.triangle));
  EXPECT_TRUE(same_bits(mesh.normal, other.normal));
  EXPECT_TRUE(same_bits(mesh.velocity, other.velocity));
  ASSERT_EQ(mesh.position.size(), other.position.size());
  for (size_t k = 0; k < mesh.position.size(); ++k)  // half an ulp of coordinates below 2 m, twice
    EXPECT_LT((other.position[k] - shift - mesh.position[k]).length(), 4e-7f);
}

}  // namespace
}  // namespace drench
