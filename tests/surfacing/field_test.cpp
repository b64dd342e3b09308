// The colour field itself, against a sum in double over all pairs.

#include "surfacing/field.h"
#include "surfacing/cloth_solid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/surfacing/scenes.h"

namespace drench::surfacing {
namespace {

constexpr double spacing = 0.01;  // m

Lattice test_lattice(double voxel_spacings, double support_spacings) {
  Lattice lattice;
  lattice.voxel = voxel_spacings * spacing;
  lattice.reach = static_cast<float>(support_spacings / voxel_spacings);
  lattice.voxels_per_spacing = static_cast<float>(1 / voxel_spacings);
  lattice.origin = {-64, -64, -64};
  return lattice;
}

/// Cubic spline with support 1, from its two pieces.
double spline(double q) {
  if (q >= 1) return 0;
  return q < 0.5 ? 1 - 6 * q * q + 6 * q * q * q : 2 * std::pow(1 - q, 3);
}

TEST(ColourKernel, IntegratesToOneSpacingCubed) {  // 4 pi s int_0^1 W q^2 dq support^3 = 1
  const ColourKernel kernel(2.5f, 0.5f, 0.45f);
  double sum = 0;
  constexpr int n = 1000;
  for (int k = 0; k < n; ++k) {
    const double q = (k + 0.5) / n;
    sum += 4 * std::numbers::pi * q * q / n * ColourKernel::shape(static_cast<float>(q)) *
           std::pow(2.5, 3);
  }
  EXPECT_NEAR(sum * kernel.scale(), 1, 1e-5);  // midpoint rule: about 1 / n^2
}

// Every lattice point of every evaluated block against the sum over all particles in double. Floats
// of 1e-7 and 100 terms of either sign of rounding: 1e-5.
TEST(ColourField, IsTheSumOverAllParticles) {
  const auto frame = surfacing_scenes::random_cloud(500, 1.0, spacing, 1);
  for (const double support : {1.5, 2.5, 5.0}) {  // 5 spacings: beyond the next block
    BinnedParticles binned = bin_particles(frame.position, test_lattice(0.5, support));
    const ColourKernel kernel(static_cast<float>(support), 0.5f, 0.45f);
    const auto interior = count_interior(binned);
    weigh_particles(binned, kernel, interior, SurfaceKernel::isotropic);
    const ColourField field =
        evaluate_field(binned, kernel, interior, ClothSolids{}, InteriorBlocks::evaluate, 1e9);
    ASSERT_GT(field.block.size(), 8u);
    for (size_t b = 0; b < field.block.size(); ++b)
      for (int k = 0; k < block_size; k += 7) {
        const V3d point =
            (V3d(field.block[b].block * block_edge + V3i(k % 8, k / 8 % 8, k / 64)) - V3d(64)) *
            (0.5 * spacing);
        double sum = 0;
        for (size_t j = 0; j < binned.source.size(); ++j)
          sum += binned.weight[j] * 8 / (std::numbers::pi * std::pow(support, 3)) *
                 spline((V3d(frame.position[binned.source[j]]) - point).length() /
                        (support * spacing));
        EXPECT_NEAR(field.value[b][k], sum, 1e-5 * (1 + sum));
      }
  }
}

TEST(BinnedParticles, HoldEveryParticleOnceInItsBlockAndBin) {
  auto frame = surfacing_scenes::splash(20000, spacing, 1);
  surfacing_scenes::shuffle(frame, 1);
  const Lattice lattice = test_lattice(0.5, 2.5);
  const BinnedParticles binned = bin_particles(frame.position, lattice);
  std::vector<int> seen(frame.position.size());
  for (size_t b = 0; b < binned.block.size(); ++b) {
    const uint32_t* bin_first = binned.bins_of(static_cast<uint32_t>(b));
    EXPECT_EQ(bin_first[binned.bin_stride() - 1], binned.first[b + 1] - binned.first[b]);
    for (uint32_t i = binned.first[b]; i < binned.first[b + 1]; ++i) {
      ++seen[binned.source[i]];
      const V3d place = V3d(block_of(binned.block[b]) * block_edge - V3i(64)) +
                        V3d(binned.x[i], binned.y[i], binned.z[i]);
      // 8 voxels in float: 5e-7 voxels.
      const V3d off = place * lattice.voxel - V3d(frame.position[binned.source[i]]);
      EXPECT_LT(off.length(), 1e-6 * lattice.voxel);
    }
  }
  EXPECT_EQ(seen, std::vector<int>(seen.size(), 1));
}

}  // namespace
}  // namespace drench::surfacing
