// Foam against closed forms: where none may be, how much there must be, and how it moves.
#include "surfacing/foam.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <numeric>

#include "pipeline/contract/error.h"
#include "pipeline/contract/obstacle.h"
#include "surfacing/foam_source.h"
#include "tests/same_bits.h"
#include "tests/surfacing/scenes.h"

namespace drench {
namespace {

using namespace surfacing_scenes;
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;
using Imath::V3i;
using surfacing::FluidMoment;
using surfacing::FluidMotion;
using surfacing::Potential;
using test::same_bits;

constexpr double spacing = 0.01;  // m
constexpr float a = float(spacing);

Shot foam_shot() {
  Shot shot;
  shot.fluid.spacing = spacing;
  shot.domain.min = V3d(-4), shot.domain.max = V3d(4);
  shot.domain.axis = {Axis::open, Axis::open, Axis::open};
  shot.foam.present = true;
  return shot;
}

void number(ParticleFrame& frame) {
  frame.id.resize(frame.position.size());
  std::iota(frame.id.begin(), frame.id.end(), 0u);
}

/// A box of fluid whose top is at y = 0, shaken by a tenth of a spacing, all at one velocity.
ParticleFrame pool(V3i cells, const V3f& velocity = V3f(0)) {
  const V3f corner(-0.5f * a * float(cells.x), -a * float(cells.y), -0.5f * a * float(cells.z));
  ParticleFrame frame = shaken_box(corner, cells, spacing, 0.1, 3);
  frame.velocity.assign(frame.position.size(), velocity);
  number(frame);
  return frame;
}

/// The frame `seconds` earlier, if all went straight on.
ParticleFrame earlier(ParticleFrame frame, float seconds) {
  for (size_t i = 0; i < frame.position.size(); ++i)
    frame.position[i] -= frame.velocity[i] * seconds;
  return frame;
}

float frame_time(const Shot& shot) { return float(1 / shot.timeline.fps); }

FoamFrame advanced(const Shot& shot, int frame, const FoamFrame& before, const ParticleFrame& fluid,
                   FoamStats* stats = nullptr) {
  return foam_frame(shot, frame, before, earlier(fluid, frame_time(shot)), fluid, {}, stats);
}

FoamFrame one_particle(const Shot& shot, const V3f& place, const V3f& velocity) {
  FoamFrame foam = no_foam(shot);
  foam.position.push_back(place), foam.velocity.push_back(velocity);
  foam.id.push_back(0), foam.age.push_back(0), foam.radius.push_back(0.1f * a);
  foam.kind.push_back(FoamKind::spray);
  foam.next_id = 1;
  return foam;
}

/// Fluid that makes no foam and is far from everything: what moves here is alone.
ParticleFrame distant_drop() {
  ParticleFrame frame;
  frame.spacing = a;
  frame.position.assign(1, V3f(-3.9f));
  frame.velocity.assign(1, V3f(0));
  frame.id.assign(1, 0);
  return frame;
}

/// Two blocks that meet at x = 0, each with `speed` towards the other.
ParticleFrame head_on(float speed, V3i cells = {12, 5, 5}) {
  ParticleFrame frame = shaken_box(V3f(-0.5f * a * float(cells.x), 0, 0), cells, spacing, 0.1, 5);
  for (size_t i = 0; i < frame.position.size(); ++i)
    frame.velocity[i] = V3f(frame.position[i].x < 0 ? speed : -speed, 0, 0);
  number(frame);
  return frame;
}

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

// ---- how it moves

TEST(Foam, SprayFliesAParabola) {
  const Shot shot = foam_shot();
  const V3f start(0.1f, 0.2f, -0.3f), velocity(1.5f, 4, -2);
  FoamFrame foam = one_particle(shot, start, velocity);
  for (int k = 1; k <= 12; ++k) {
    foam = advanced(shot, 1001 + k, foam, distant_drop());
    const double t = k / 24.0;
    ASSERT_EQ(foam.kind[0], FoamKind::spray);
    const V3d exact = V3d(start) + V3d(velocity) * t + V3d(0, -9.81, 0) * (0.5 * t * t);
    // Rounding of sums up to 1 m, a few for every substep.
    EXPECT_LT((V3d(foam.position[0]) - exact).length(), 5e-6) << k;
    EXPECT_NEAR(foam.velocity[0].y, 4 - 9.81 * t, 1e-5);
  }
}

// From rest: v (t - T (1 - exp(-t / T))), T = v / (2 g), until it is at the surface.
TEST(Foam, BubblesRiseToTheSurfaceAndBecomeFoam) {
  Shot shot = foam_shot();
  shot.timeline.fps = 60;
  const ParticleFrame fluid = pool({16, 24, 16});
  FoamFrame foam = one_particle(shot, V3f(0.002f, -0.15f, 0.001f), V3f(0));
  const double v = shot.foam.rise_speed, relaxation = v / (2 * 9.81);
  int frame = 1002;
  for (; frame <= 1020; ++frame) {
    foam = advanced(shot, frame, foam, fluid);
    const double t = (frame - 1001) / 60.0;
    ASSERT_EQ(foam.kind[0], FoamKind::bubble);
    EXPECT_NEAR(foam.position[0].y + 0.15, v * (t - relaxation * (1 - std::exp(-t / relaxation))),
                1e-5);
    EXPECT_NEAR(foam.position[0].x, 0.002, 1e-6);
    EXPECT_EQ(foam.age[0], 0);
  }
  for (; frame <= 1060; ++frame) foam = advanced(shot, frame, foam, fluid);
  EXPECT_EQ(foam.kind[0], FoamKind::foam);
  EXPECT_NEAR(foam.position[0].y, 0, spacing);
  EXPECT_GT(foam.age[0], 0);
}

TEST(Foam, IsCarriedWithAStreamAndAcrossASeam) {
  Shot shot = foam_shot();
  shot.domain.min = V3d(-0.1, -1, -0.1), shot.domain.max = V3d(0.1, 1, 0.1);
  shot.domain.axis = {Axis::periodic, Axis::open, Axis::periodic};
  const V3f stream(1.3f, 0, -0.4f);
  const V3f start(0, 0.2f * a, 0);
  ParticleFrame fluid = pool({20, 8, 20}, stream);
  FoamFrame foam = one_particle(shot, start, stream);
  foam.kind[0] = FoamKind::foam;
  const ParticleFrame first = fluid;
  for (int k = 1; k <= 12; ++k) {
    const float t = float(k) / 24;
    for (size_t i = 0; i < fluid.position.size(); ++i)
      fluid.position[i] = surfacing::wrapped(first.position[i] + stream * t, shot.domain);
    foam = advanced(shot, 1001 + k, foam, fluid);
    const V3f exact = surfacing::wrapped(start + stream * t, shot.domain);
    const V3f off = foam.position[0] - exact, relative = foam.velocity[0] - stream;
    EXPECT_LT(V2f(off.x, off.z).length(), 1e-3f * a) << k;
    EXPECT_LT(std::abs(foam.position[0].y), 0.4f * a);  // it floats up and down
    EXPECT_EQ(foam.kind[0], FoamKind::foam);
    EXPECT_LT(V2f(relative.x, relative.z).length(), 1e-4f);
  }
}

// Wherever it starts between spray and bubble: at rest the surface has half a neighbourhood below
// it, to the packing's noise of one or two particles in 17, 12.6 a spacing.
TEST(Foam, FloatsToTheSurface) {
  Shot shot = foam_shot();
  const ParticleFrame fluid = pool({16, 8, 16});
  for (const float height : {-0.1f, 0.3f, 0.6f}) {
    FoamFrame foam = one_particle(shot, V3f(0.003f, height * a, 0.002f), V3f(0));
    for (int frame = 1002; frame < 1026; ++frame) foam = advanced(shot, frame, foam, fluid);
    EXPECT_EQ(foam.kind[0], FoamKind::foam);
    EXPECT_NEAR(foam.position[0].y, 0, 0.2 * spacing) << height;
  }
}

// Lives are even between half and one and a half of the mean: at the mean half are gone.
TEST(Foam, LivesAsLongAsItsLifetimeSays) {
  Shot shot = foam_shot();
  shot.timeline.fps = 100;
  shot.foam.lifetime = 0.1;
  const ParticleFrame fluid = pool({16, 6, 16});
  constexpr uint32_t n = 1000;
  FoamFrame foam = no_foam(shot);
  for (uint32_t k = 0; k < n; ++k) {
    const FoamFrame one = one_particle(
        shot, V3f(0.1f * float(k) / n - 0.05f, 0.2f * a, 0.1f * float(k % 31) / 31 - 0.05f),
        V3f(0));
    foam.position.push_back(one.position[0]), foam.velocity.push_back(V3f(0));
    foam.id.push_back(k), foam.age.push_back(0), foam.radius.push_back(one.radius[0]);
    foam.kind.push_back(FoamKind::foam);
  }
  foam.next_id = n;
  size_t died = 0;
  for (int k = 1; k <= 15; ++k) {
    FoamStats stats;
    foam = advanced(shot, 1001 + k, foam, fluid, &stats);
    died += stats.died;
    if (k < 5) {
      ASSERT_EQ(died, 0u);
    }
    // A binomial count of 1000 with 1/2; a step is 0.1 of the mean, of which rounding may take one.
    if (k == 10) {
      EXPECT_NEAR(double(died), n / 2., 4 * std::sqrt(n / 4.) + n * 1e-4);
    }
    for (const float radius : foam.radius) ASSERT_LT(radius, 1.41f * float(shot.foam.radius) * a);
  }
  EXPECT_EQ(died, n);
  EXPECT_TRUE(foam.position.empty());
}

// ---- what it cannot go through

TEST(Foam, StaysBetweenWallsAndSpraySticks) {
  Shot shot = foam_shot();
  shot.domain.min = V3d(-0.5, 0, -0.5), shot.domain.max = V3d(0.5, 1, 0.5);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  ParticleFrame far = distant_drop();
  far.position[0] = V3f(-0.45f, 0.95f, -0.45f);
  FoamFrame foam = one_particle(shot, V3f(0, 0.5f, 0), V3f(9, 3, 7));
  float r = 0;
  for (int frame = 1002; frame < 1040; ++frame) {
    r = foam.radius[0];
    foam = advanced(shot, frame, foam, far);
    const V3f& p = foam.position[0];
    ASSERT_GE(std::min({p.x + 0.5f, p.y, p.z + 0.5f}), r - 1e-6f);
    ASSERT_GE(std::min({0.5f - p.x, 1 - p.y, 0.5f - p.z}), r - 1e-6f);
  }
  EXPECT_NEAR(foam.position[0].y, r, 1e-6);
  EXPECT_EQ(foam.velocity[0], V3f(0));
  EXPECT_GT(foam.age[0], 0.5f);
}

// Two spacings thick, turned, and hit by what flies a metre a frame.
TEST(Foam, DoesNotPassAThinPlate) {
  Shot shot = foam_shot();
  shot.gravity = V3d(0);
  Obstacle plate;
  plate.type = ObstacleType::box;
  plate.size = V3d(2 * spacing, 2, 2);
  plate.position = V3d(1, 0, 0);
  plate.rotation_deg = V3d(0, 20, 30);
  shot.obstacle = {plate};
  const Pose pose = obstacle_pose(plate, 1001);
  for (int k = 0; k < 50; ++k) {
    const V3f velocity(30, 0.4f * float(k % 7), -0.5f * float(k % 5));
    FoamFrame foam = one_particle(shot, V3f(0.003f * float(k), 0, 0), velocity);
    for (int frame = 1002; frame < 1005; ++frame)
      foam = advanced(shot, frame, foam, distant_drop());
    ASSERT_NEAR(pose.to_own(V3d(foam.position[0])).x, -spacing, 0.0015) << k;
    ASSERT_EQ(foam.velocity[0], V3f(0));
  }
}

TEST(Foam, IsLostThroughOpenSides) {
  Shot shot = foam_shot();
  FoamStats stats;
  FoamFrame foam = one_particle(shot, V3f(3.9f, 0, 0), V3f(10, 0, 0));
  foam = advanced(shot, 1002, foam, distant_drop(), &stats);
  EXPECT_TRUE(foam.position.empty());
  EXPECT_EQ(stats.lost, 1u);
  EXPECT_EQ(foam.next_id, 1u);
}

TEST(Foam, StopsAtObstaclesAndIsCarriedByThem) {
  Shot shot = foam_shot();
  shot.gravity = V3d(0);
  Obstacle ball;
  ball.type = ObstacleType::sphere;
  ball.radius = 0.1;
  ball.position = V3d(0.3, 0, 0);
  Obstacle box;
  box.type = ObstacleType::box;
  box.size = V3d(0.2);
  box.position = V3d(-0.3, 0, 0);
  box.rotation_deg = V3d(0, 0, 45);
  Obstacle plane;
  plane.type = ObstacleType::plane;
  plane.position = V3d(0, -0.5, 0);
  shot.obstacle = {ball, box, plane};
  const auto after = [&](const V3f& velocity) {
    FoamFrame foam = one_particle(shot, V3f(0), velocity);
    for (int frame = 1002; frame < 1010; ++frame)
      foam = advanced(shot, frame, foam, distant_drop());
    EXPECT_EQ(foam.velocity[0], V3f(0));
    return foam.position[0];
  };
  // On the surface, but for a radius of half a millimetre to 1.4.
  EXPECT_NEAR((after(V3f(2, 0, 0)) - V3f(0.3f, 0, 0)).length(), 0.1, 0.0015);
  // Of a box turned by 45 degrees, hit at its edge: in its own axes.
  const V3f at_box = after(V3f(-2, 0, 0)) - V3f(-0.3f, 0, 0);
  const double u = (at_box.x + at_box.y) / std::sqrt(2.0),
               v = (at_box.x - at_box.y) / std::sqrt(2.0);
  EXPECT_NEAR(std::max(u, v), 0.1, 0.0015);
  EXPECT_NEAR(after(V3f(0, -2, 0)).y, -0.5, 0.0015);
  shot.obstacle[0].position.keys = {{1001, V3d(0.3, 0, 0)}, {1025, V3d(0.3, 1, 0)}};
  FoamFrame foam = one_particle(shot, V3f(0.2f - 0.5f * a, 0, 0), V3f(0.5f, 0, 0));
  foam = advanced(shot, 1002, foam, distant_drop());
  EXPECT_NEAR(foam.velocity[0].y, 1, 1e-3);  // 1 m in 24 frames of 1/24 s
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
