// Foam against closed forms: where none may be, and how much there must be.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <numeric>

#include "pipeline/contract/error.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "surfacing/foam_source.h"
#include "tests/same_bits.h"
#include "tests/surfacing/foam_scenes.h"

namespace drench {
namespace {

using namespace foam_scenes;
using surfacing::FluidMoment;
using surfacing::FluidMotion;
using surfacing::Potential;
using test::same_bits;

FluidMoment moment_of(const Shot& shot, const ParticleFrame& fluid) {
  const FluidMotion motion(earlier(fluid, frame_time(shot)), fluid, shot.domain, frame_time(shot));
  return fluid_at(motion, 1, shot.domain, a, {});
}

size_t births(const Shot& shot, const ParticleFrame& fluid) {
  FoamStats stats;
  advanced(shot, 1002, no_foam(shot), fluid, &stats);
  return stats.born;
}

// ---- where none may be

TEST(Foam, IsNotMadeByAPoolAtRestOrOneThatJostles) {
  Shot shot = foam_shot();
  shot.foam.trapped_air = shot.foam.wave_crest = 1000;
  ParticleFrame still = pool({16, 8, 16});
  EXPECT_EQ(births(shot, still), 0u);
  // Jostling below the speed that lifts a surface by a spacing breaks nothing.
  const float breaking = surfacing::breaking_speed(shot);
  for (size_t i = 0; i < still.velocity.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      still.velocity[i][axis] =
          breaking * (surfacing::random_number(1, 1, uint32_t(i), uint32_t(axis)) - 0.5f);
  EXPECT_EQ(births(shot, still), 0u);
  for (V3f& v : still.velocity) v *= 10;
  EXPECT_GT(births(shot, still), 0u);
}

TEST(Foam, IsNotMadeByFluidThatFliesOrTurnsAsOneBody) {
  Shot shot = foam_shot();
  shot.foam.trapped_air = shot.foam.wave_crest = 1000;
  ParticleFrame ball = relaxed_ball(4000, spacing, 10, 1);
  number(ball);
  for (const float speed : {1.f, 100.f, 900.f}) {
    ball.velocity.assign(ball.position.size(), V3f(0.6f, 0.48f, 0.64f) * speed);
    EXPECT_EQ(births(shot, ball), 0u) << speed;
  }
  for (const float rate : {10.f, 1000.f, 10000.f}) {  // rad/s
    for (size_t i = 0; i < ball.position.size(); ++i)
      ball.velocity[i] = V3f(0.48f, 0.64f, 0.6f).cross(ball.position[i]) * rate;
    EXPECT_EQ(births(shot, ball), 0u) << rate;
  }
  // The same ball torn along one axis, at the rate that the slowest turn had.
  for (size_t i = 0; i < ball.position.size(); ++i)
    ball.velocity[i] = V3f(ball.position[i].x, -0.5f * ball.position[i].y, 0) * 100.f;
  EXPECT_GT(births(shot, ball), 0u);
}

// ---- how much there must be

/// Every sum by its definition, over all pairs, in double.
struct BruteForce {
  double fullness = 0, closing = 0;
  V3d offset{0, 0, 0}, relative{0, 0, 0};

  BruteForce(const ParticleFrame& fluid, size_t i) {
    double weights = 0;
    for (size_t j = 0; j < fluid.position.size(); ++j) {
      const V3d d = V3d(fluid.position[j]) - V3d(fluid.position[i]);
      const V3d u = V3d(fluid.velocity[j]) - V3d(fluid.velocity[i]);
      const double r = d.length(), weight = 1 - r / (2 * spacing);
      if (weight <= 0) continue;
      weights += weight;
      offset -= d * weight;
      relative -= u * weight;
      if (r > 0) closing += weight * std::max(0., -u.dot(d) / r);
    }
    // A full ball: the integral of 1 - r / h is pi / 3 h^3 = 8 pi / 3 spacings^3.
    fullness = weights / (8 * M_PI / 3);
    closing /= 8 * M_PI / 3;
    offset *= 1 / (weights * spacing);
    relative *= 1 / weights;
  }
};

TEST(FoamPotential, IsWhatItsDefinitionSaysOverAllPairs) {
  const Shot shot = foam_shot();
  ParticleFrame fluid = splash(3000, spacing, 1);
  number(fluid);
  for (size_t i = 0; i < fluid.velocity.size(); ++i) {
    const V3f p = fluid.position[i] / a;
    fluid.velocity[i] = V3f(std::sin(p.y), std::cos(p.z), std::sin(p.x + p.y)) * 3.f;
  }
  const std::vector<Potential> found = surfacing::potentials(moment_of(shot, fluid), 1e-6f);
  ASSERT_EQ(found.size(), fluid.position.size());
  size_t ahead = 0;
  for (size_t i = 0; i < found.size(); i += 3) {
    const BruteForce exact(fluid, i);
    ASSERT_NEAR(found[i].fullness, exact.fullness, 1e-4);
    ASSERT_NEAR(found[i].closing, exact.closing, 3e-4);
    for (int axis = 0; axis < 3; ++axis)
      ASSERT_NEAR(found[i].offset[axis], exact.offset[axis], 1e-4);
    if (!(exact.offset.length() > 0.21)) continue;
    const double out = exact.relative.dot(exact.offset.normalized());
    if (out < 0.61 * exact.relative.length()) continue;
    ASSERT_NEAR(found[i].ahead, out, 1e-3);
    ++ahead;
  }
  EXPECT_GT(ahead, 50u);
}

// In a flow that closes in at rate e from all sides neighbours at r come at e r. On a lattice 6
// stand at 1, 12 at sqrt 2 and 8 at sqrt 3 spacings: the sum of (1 - r / 2) r is 9.827, over 8 pi /
// 3 1.173. The integral is 1.2.
TEST(FoamPotential, OfAFlowThatClosesInIsTheSumOverALattice) {
  const Shot shot = foam_shot();
  const float rate = 100;  // 1/s
  ParticleFrame fluid = shaken_box(V3f(-0.1f), V3i(20), spacing, 0.05, 1);
  number(fluid);
  for (size_t i = 0; i < fluid.position.size(); ++i) fluid.velocity[i] = fluid.position[i] * -rate;
  const std::vector<Potential> found = surfacing::potentials(moment_of(shot, fluid), 1e-6f);
  double sum = 0, count = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    const V3f& p = fluid.position[i];
    if (std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > 0.07f) continue;
    sum += found[i].closing;
    ++count;
  }
  EXPECT_NEAR(sum / count, rate * 1.173 * spacing, 0.01 * rate * 1.173 * spacing);
}

// A tip is a crest, a plane and the inside of a bowl are not.
TEST(FoamPotential, SeesCrestsWhereFluidRunsAheadAlongATip) {
  const Shot shot = foam_shot();
  ParticleFrame column = shaken_box(V3f(-0.02f, 0, -0.02f), {4, 40, 4}, spacing, 0.05, 1);
  number(column);
  for (size_t i = 0; i < column.position.size(); ++i)
    column.velocity[i] = V3f(0, 100 * column.position[i].y, 0);  // it gets longer
  const std::vector<Potential> tip = surfacing::potentials(moment_of(shot, column), 1e-6f);
  double at_tip = 0;
  for (size_t i = 0; i < tip.size(); ++i) {
    if (column.position[i].y > 0.39f) at_tip = std::max(at_tip, double(tip[i].curvature));
    const bool side = column.position[i].y < 0.3f && column.position[i].y > 0.1f;
    EXPECT_TRUE(!side || tip[i].ahead == 0) << i;  // the sides do not move outwards
  }
  EXPECT_GT(at_tip, 0.2);
  ParticleFrame flat = pool({16, 8, 16});
  for (size_t i = 0; i < flat.position.size(); ++i)
    flat.velocity[i] = V3f(0, 100 * flat.position[i].y + 5, 0);
  const std::vector<Potential> plane = surfacing::potentials(moment_of(shot, flat), 1e-6f);
  for (size_t i = 0; i < plane.size(); ++i) {
    const V3f& p = flat.position[i];
    if (std::max(std::abs(p.x), std::abs(p.z)) < 0.04f) {
      EXPECT_LT(plane[i].curvature, 0.1f);
    }
  }
}

/// Sum of the rates, and the variance of a frame's count: each particle rounds its own mean.
struct Expected {
  double mean = 0, variance = 0;

  Expected(const Shot& shot, const ParticleFrame& fluid) {
    for (const float rate : surfacing::birth_rates(moment_of(shot, fluid), shot)) {
      const double n = double(rate) * frame_time(shot), part = n - std::floor(n);
      mean += n;
      variance += part * (1 - part);
    }
  }
};

TEST(Foam, IsMadeInProportionToRateAndTimeWhereStreamsMeet) {
  const ParticleFrame fluid = head_on(2);
  Shot shot = foam_shot();
  shot.foam.wave_crest = 0, shot.foam.trapped_air = 1;
  const double once = Expected(shot, fluid).mean;
  EXPECT_GT(once, 10);
  for (const double share : {0.1, 1.0, 3.0})
    for (const double fps : {24.0, 96.0}) {
      shot.foam.trapped_air = share;
      shot.timeline.fps = fps;
      const Expected expected(shot, fluid);
      EXPECT_NEAR(expected.mean, once * share * 24 / fps, 1e-4 * once);
      double born = 0;
      constexpr int frames = 40;
      for (int frame = 1002; frame < 1002 + frames; ++frame) {
        FoamStats stats;
        advanced(shot, frame, no_foam(shot), fluid, &stats);
        born += double(stats.born);
      }
      EXPECT_NEAR(born / frames, expected.mean, 4 * std::sqrt(expected.variance / frames))
          << share << " " << fps;
    }
}

// The rate in the middle of the contact, by hand: full speed, so that both ramps are 1.
TEST(Foam, IsMadeAsOftenAsTheFluidClosesInByASpacing) {
  Shot shot = foam_shot();
  shot.foam.wave_crest = 0;
  shot.foam.trapped_air = 2;
  const ParticleFrame fluid = head_on(8);
  const FluidMoment moment = moment_of(shot, fluid);
  const std::vector<float> rate = surfacing::birth_rates(moment, shot);
  size_t seen = 0;
  for (size_t i = 0; i < rate.size(); ++i) {
    const BruteForce exact(fluid, i);
    if (exact.fullness > 0.84 || exact.closing < 5 * shot.foam.threshold * 0.45) continue;
    EXPECT_NEAR(rate[i], 2 * exact.closing / spacing, 1e-3 * rate[i]);
    ++seen;
  }
  EXPECT_GT(seen, 10u);
}

// The same streams, all lengths and speeds half as large, break as much for their spacing where
// gravity alone resists: breaking speeds go as the root of the spacing.
TEST(Foam, BreakingSpeedIsGravitysAtCentimetresAndTensionsAtHalfMillimetres) {
  Shot shot = foam_shot();
  shot.fluid.spacing = 0.1;
  EXPECT_NEAR(surfacing::breaking_speed(shot), std::sqrt(9.81 * 0.1), 0.002);
  shot.gravity = V3d(0);
  shot.fluid.spacing = 0.5e-3;
  EXPECT_NEAR(surfacing::breaking_speed(shot), std::sqrt(0.072 / (1000 * 0.5e-3)), 1e-6);
}

// ---- the same bits, errors

TEST(Foam, HasTheSameBitsForAnyThreadCount) {
  Shot shot = foam_shot();
  shot.foam.trapped_air = 20, shot.foam.threshold = 0.1;
  ParticleFrame fluid = splash(60000, spacing, 1);
  number(fluid);
  for (V3f& v : fluid.velocity) v *= 3;
  const auto with_threads = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, size_t(threads));
    tbb::task_arena arena(threads);
    return arena.execute([&] {
      const FoamFrame first = advanced(shot, 1002, no_foam(shot), fluid);
      return advanced(shot, 1003, first, fluid);
    });
  };
  const FoamFrame one = with_threads(1);
  EXPECT_GT(one.position.size(), 1000u);
  for (const int threads : {2, 16}) {
    const FoamFrame more = with_threads(threads);
    EXPECT_TRUE(same_bits(one.position, more.position));
    EXPECT_TRUE(same_bits(one.velocity, more.velocity));
    EXPECT_TRUE(same_bits(one.age, more.age));
    EXPECT_TRUE(same_bits(one.radius, more.radius));
    EXPECT_EQ(one.id, more.id);
    EXPECT_EQ(one.kind, more.kind);
    EXPECT_EQ(one.next_id, more.next_id);
  }
}

std::string error_of(const Shot& shot, const ParticleFrame& fluid) {
  try {
    advanced(shot, 1002, no_foam(shot), fluid);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Foam, SaysWhatIsWrongWithItsInput) {
  Shot shot = foam_shot();
  ParticleFrame fluid = head_on(5);
  fluid.position[7].y = NAN;
  EXPECT_NE(error_of(shot, fluid).find("particle 7"), std::string::npos);
  fluid = head_on(5);
  shot.foam.trapped_air = 1e4;
  shot.surface.memory_gib = 0.001;
  EXPECT_NE(error_of(shot, fluid).find("foam.trapped_air"), std::string::npos);
}

TEST(Foam, OfNoFluidGoesOnFlying) {
  const Shot shot = foam_shot();
  ParticleFrame none;
  none.spacing = a;
  const FoamFrame foam = advanced(shot, 1002, one_particle(shot, V3f(0), V3f(1, 0, 0)), none);
  ASSERT_EQ(foam.position.size(), 1u);
  EXPECT_NEAR(foam.position[0].x, 1 / 24., 1e-6);
}

}  // namespace
}  // namespace drench
