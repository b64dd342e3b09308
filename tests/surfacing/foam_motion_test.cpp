// How foam moves, against closed forms, and what it cannot go through.

#include <gtest/gtest.h>

#include "pipeline/contract/geometry/obstacle.h"
#include "surfacing/fluid_motion.h"
#include "tests/surfacing/foam_scenes.h"

namespace drench {
namespace {

using namespace foam_scenes;
using Imath::V2f;

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

// Gravity that fades out over two frames and stays away: the integral of a ramp.
TEST(Foam, SprayFeelsGravityOfTheMomentThatItFliesIn) {
  Shot shot = foam_shot();
  shot.gravity.keys = {{1001, V3d(0, -9.6, 0)}, {1003, V3d(0)}};
  FoamFrame foam = one_particle(shot, V3f(0), V3f(0, 1, 0));
  const double whole = 9.6 / 24;  // m/s, of both frames
  const double lost[] = {0.75 * whole, whole, whole};
  for (int k = 0; k < 3; ++k) {
    foam = advanced(shot, 1002 + k, foam, distant_drop());
    EXPECT_NEAR(foam.velocity[0].y, 1 - lost[k], 1e-5) << k;
  }
}

// What flies is at home in the world: over a quarter turn of the domain about z it has gone along
// its parabola, and the domain has it where -x was down.
TEST(Foam, SprayFliesAParabolaOfTheWorldInADomainThatTurns) {
  Shot shot = foam_shot();
  shot.frame_rotation_deg.keys = {{1001, 0}, {1013, 90}};
  shot.frame_axis = V3d(0, 0, 2), shot.frame_center = V3d(0.3, -0.1, 0);
  const double rate = M_PI, t = 0.5;  // rad/s, s
  const V3d start(0.1, 0.2, -0.3), velocity(1.5, 4, -2);
  const V3d from_axis = start - shot.frame_center;
  const V3d relative = velocity - V3d(-from_axis.y, from_axis.x, 0) * rate;
  FoamFrame foam = one_particle(shot, V3f(start), V3f(relative));
  for (int frame = 1002; frame <= 1013; ++frame) foam = advanced(shot, frame, foam, distant_drop());
  ASSERT_EQ(foam.kind[0], FoamKind::spray);
  const V3d r = from_axis + velocity * t + V3d(0, -9.81, 0) * (0.5 * t * t);
  const V3d turned_back = shot.frame_center + V3d(r.y, -r.x, r.z);
  EXPECT_LT((V3d(foam.position[0]) - turned_back).length(), 2e-5);
  const V3d after = velocity + V3d(0, -9.81, 0) * t;  // the domain stands still again
  EXPECT_LT((V3d(foam.velocity[0]) - V3d(after.y, -after.x, after.z)).length(), 2e-5);
}

// In a turning domain without gravity bubbles rise towards the axis.
TEST(Foam, BubblesRiseAgainstTheCentrifuge) {
  Shot shot = foam_shot();
  shot.timeline.fps = 60;
  shot.gravity = V3d(0);
  shot.frame_rotation_deg.keys = {{1001, 0}, {1101, 9000}};
  shot.frame_axis = V3d(0, 0, 1), shot.frame_center = V3d(0, -0.12, 0);
  const ParticleFrame fluid = pool({16, 24, 16});
  FoamFrame foam = one_particle(shot, V3f(0.05f, -0.12f, 0.001f), V3f(0));
  for (int frame = 1002; frame <= 1007; ++frame) foam = advanced(shot, frame, foam, fluid);
  EXPECT_EQ(foam.kind[0], FoamKind::bubble);
  EXPECT_NEAR(0.05 - foam.position[0].x, shot.foam.rise_speed * 0.1,
              0.03 * shot.foam.rise_speed * 0.1);
  EXPECT_NEAR(foam.position[0].y, -0.12, 1e-5);
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

}  // namespace
}  // namespace drench
