// How much fluid the sources make, and where.

#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/contract/error.h"
#include "sim/simulator.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

Shot rain(int count, int particles, uint32_t seed) {
  Shot shot = empty_shot();
  shot.seed = seed;
  FluidDrops drops;
  drops.min = V3d(-0.6), drops.max = V3d(0.6);
  drops.radius = 0.1, drops.count = count, drops.particles = particles;
  shot.fluid.drops.push_back(drops);
  return shot;
}

TEST(Drops, MakeExactlyAsManyParticlesAsAsked) {
  for (int count : {1, 7, 24}) {
    EXPECT_EQ(sim::initial_fluid(rain(count, 16384 / (count == 1 ? 8 : 1), 1)).position.size(),
              size_t(16384 / (count == 1 ? 8 : 1)))
        << count;
  }
}

// Within a drop neighbours are a spacing apart, so links of at most 1.01 spacings find the drops.
TEST(Drops, AreAsManyAsAskedAndApart) {
  for (uint32_t seed : {1u, 2u, 3u}) {
    const sim::InitialFluid fluid = sim::initial_fluid(rain(12, 3000, seed));
    const size_t n = fluid.position.size();
    std::vector<size_t> root(n);
    for (size_t i = 0; i < n; ++i) root[i] = i;
    const auto find = [&](size_t i) {
      while (root[i] != i) i = root[i] = root[root[i]];
      return i;
    };
    size_t groups = n;
    for (size_t i = 0; i < n; ++i) {
      for (size_t j = 0; j < i; ++j) {
        if ((fluid.position[i] - fluid.position[j]).length() > 0.0101 || find(i) == find(j))
          continue;
        root[find(i)] = find(j);
        --groups;
      }
    }
    EXPECT_EQ(groups, 12u) << seed;
  }
}

TEST(Drops, ThatCannotFitAreRefused) { EXPECT_THROW(sim::build_scene(rain(5000, 0, 1)), Error); }

// 30, 30.6 and 30.4 cells of 10 mm: whole cells alone, none of which reaches out of the box.
TEST(Box, HoldsTheWholeCellsThatFit) {
  Shot shot = empty_shot();
  const FluidBox box{V3d(-0.15), V3d(0.15, 0.156, 0.154), V3d(0)};
  shot.fluid.box.push_back(box);
  const sim::InitialFluid fluid = sim::initial_fluid(shot);
  EXPECT_EQ(fluid.position.size(), size_t(30 * 30 * 30));
  for (const V3d& p : fluid.position) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(p[k] - box.min[k], 0.005 - 1e-9);
      EXPECT_GE(box.max[k] - p[k], 0.005 - 1e-9);
    }
  }
}

// A ball of radius 0.1 m has 4/3 pi 10^3 = 4189 lattice cells; the surface is uncertain by a few of
// its 1257 cells in random sign: 1 %.
TEST(Sphere, HasTheVolumeOfItsRadius) {
  Shot shot = empty_shot();
  shot.fluid.sphere.push_back({V3d(0), 0.1, V3d(0)});
  EXPECT_NEAR(double(sim::initial_fluid(shot).position.size()), 4. / 3 * M_PI * 1000, 42);
}

// Where two sources overlap there is one lattice, not two.
TEST(Sources, ThatOverlapDoNotFillSpaceTwice) {
  Shot shot = empty_shot();
  add_box(shot, V3d(0), {10, 10, 10});
  add_box(shot, V3d(0.05, 0, 0), {10, 10, 10});
  EXPECT_EQ(sim::initial_fluid(shot).position.size(), 1500u);
}

// Between two frames 0.2 s apart pass area x speed x time. A disc of radius 10 a holds 317 lattice
// points for an area of 314 a^2 (0.9 %).
TEST(Emitter, DeliversAreaTimesSpeedTimesTime) {
  Shot shot = empty_shot();
  shot.timeline = {1001, 1003, 5};
  FluidEmitter emitter;
  emitter.center = V3d(0), emitter.radius = 0.1, emitter.speed = 1;
  shot.fluid.emitter.push_back(emitter);
  Simulator simulator(shot, {});
  const size_t first = simulator.advance_frame().particles,
               second = simulator.advance_frame().particles;
  const double volume = double(second - first) * 1e-6, expected = M_PI * 0.01 * 1 * 0.2;
  EXPECT_NEAR(volume, expected, 0.02 * expected);
}

// Its start counts from the simulation's start: the pre-roll fills the shot's first frame.
TEST(Emitter, DeliversDuringThePreroll) {
  Shot shot = empty_shot();
  shot.preroll = 0.4;
  FluidEmitter emitter;
  emitter.center = V3d(0), emitter.radius = 0.1, emitter.speed = 1, emitter.start = 0.2;
  shot.fluid.emitter.push_back(emitter);
  Simulator simulator(shot, {});
  EXPECT_EQ(simulator.particles().position.size(), 0u);
  const double volume = double(simulator.preroll().particles) * 1e-6,
               expected = M_PI * 0.01 * 1 * 0.2;
  EXPECT_EQ(simulator.frame(), 1001);
  // 0.9 % as above and one layer of 20, since the first leaves at once.
  EXPECT_NEAR(volume, expected, 0.06 * expected);
}

TEST(Emitter, IsSilentBeforeItsStartAndAfterItsStop) {
  Shot shot = empty_shot();
  shot.timeline = {1001, 1005, 20};
  FluidEmitter emitter;
  emitter.center = V3d(0), emitter.radius = 0.03, emitter.speed = 1, emitter.start = 0.07,
  emitter.stop = 0.12;
  shot.fluid.emitter.push_back(emitter);
  Simulator simulator(shot, {});
  EXPECT_EQ(simulator.advance_frame().particles, 0u);  // to 0.05 s
  EXPECT_GT(simulator.advance_frame().particles, 0u);
  const size_t third = simulator.advance_frame().particles;  // to 0.15 s
  EXPECT_EQ(simulator.advance_frame().particles, third);
}

}  // namespace
}  // namespace drench::sim_tests
