// Obstacles in the density and in statics, each against a closed form or against the domain's own
// walls.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/passes/obstacle/obstacle_guard.h"
#include "tests/sim/obstacle_scenes.h"

namespace drench::sim_tests {
namespace {

using sim::cpu::Vec3;
using sim::cpu::WallDensity;
using sim::cpu::WendlandC2;

sim::cpu::ObstacleDensity law() {  // in supports: h = 1
  return {1.f, 1.f, 1.f / 2.15f};
}

/// Share of a ball in the kernel's integral, by Simpson's rule over shells: the ball's surface is
/// `gap` from the centre of the kernel.
double ball_share(double gap, double radius) {
  constexpr int n = 2000;
  const double centre = gap + radius;
  double sum = 0;
  for (int k = 0; k <= n; ++k) {
    const double r = double(k) / n, u = 1 - r;
    const double w = 21 / (2 * M_PI) * std::pow(u, 4) * (1 + 4 * r);
    // Share of the sphere of radius r about the kernel's centre that lies in the ball.
    double inside = r <= std::abs(gap) && gap < 0 ? 1 : 0;
    if (r > std::abs(gap) && r > 0) {
      inside = (radius * radius - std::pow(centre - r, 2)) / (4 * centre * r);
      inside = std::clamp(inside, 0.0, 1.0);
    }
    sum += (k == 0 || k == n ? 1 : k % 2 ? 4 : 2) * 4 * M_PI * r * r * w * inside;
  }
  return sum / (3 * n);
}

// S of a sphere is the kernel's integral over its image, a concentric ball. Without the curvature
// it would be the half-space: 29 % more at 3 spacings, 17 % at 5, 8 % at 10, half a spacing off.
TEST(ObstacleDensity, OfASphereIsTheIntegralOverItsImage) {
  const double a = 1 / 2.15;
  for (const double spacings : {3., 5., 10.}) {
    const double radius = spacings * a;
    for (const double d : {0.1, 0.25, 0.5, 0.75, 1.0}) {
      const double distance = d * a, gap = 2 * distance - 0.5 * a;
      const double expected = ball_share(gap, radius + 0.5 * a - distance);
      const float along = float(1 / (radius + distance));
      EXPECT_NEAR(law().curved(float(distance), {0, 0, 1}, along).value, expected, 2e-4)
          << spacings << " " << d;
    }
    const double flat = WendlandC2::halfspace(float(0.5 * a));
    RecordProperty("half_space_over_ball_" + std::to_string(int(spacings)),
                   std::to_string(flat / ball_share(0.5 * a, radius)));
  }
}

// A cavity is the complement of a ball.
TEST(ObstacleDensity, OfACavityIsTheRestOfTheKernel) {
  const double a = 1 / 2.15, radius = 6 * a;
  for (const double d : {0.25, 0.5, 1.0}) {
    const double distance = d * a, gap = 2 * distance - 0.5 * a;
    const double ball = radius - distance + gap;  // the image's radius
    const float along = float(-1 / (radius - distance));
    EXPECT_NEAR(law().curved(float(distance), {0, 0, 1}, along).value, 1 - ball_share(-gap, ball),
                2e-4)
        << d;
  }
}

// Of a box: the half-space on a face, a quarter or eighth of space on an edge or corner.
TEST(ObstacleDensity, OfABoxIsExactOnFacesEdgesAndCorners) {
  const float half[3] = {3, 4, 5}, a = 1 / 2.15f;
  for (const float d : {0.25f, 0.5f, 1.f}) {
    EXPECT_NEAR(law().box({3 + d * a, 0, 0}, half).value, WendlandC2::halfspace((2 * d - 0.5f) * a),
                1e-6);
  }
  // Where the image's own edge lies: the surface moved out by a quarter of a spacing meets the
  // particle itself.
  const float q = 0.25f * a;
  const auto at = [&](Vec3<float> n) {
    const float size = length(n);
    return Vec3<float>{(n.x > 0 ? 3 : 0) + n.x / size * q, (n.y > 0 ? 4 : 0) + n.y / size * q,
                       (n.z > 0 ? 5 : 0) + n.z / size * q};
  };
  EXPECT_GT(law().box(at({1, 1, 0}), half).value, 0.25f);  // a little inside the image's edge
  EXPECT_LT(law().box(at({1, 1, 0}), half).value, 0.36f);
  EXPECT_GT(law().box(at({1, 1, 1}), half).value, 0.125f);
  EXPECT_LT(law().box(at({1, 1, 1}), half).value, 0.2f);
}

/// Central difference of what `of` gives.
template <class Share>
void expect_gradient(const Share& of, Vec3<float> x, double tolerance) {
  const float e = 2e-3f;
  const WallDensity at = of(x);
  const double numeric[3] = {
      (of({x.x + e, x.y, x.z}).value - of({x.x - e, x.y, x.z}).value) / (2. * e),
      (of({x.x, x.y + e, x.z}).value - of({x.x, x.y - e, x.z}).value) / (2. * e),
      (of({x.x, x.y, x.z + e}).value - of({x.x, x.y, x.z - e}).value) / (2. * e)};
  EXPECT_NEAR(at.gradient.x, numeric[0], tolerance);
  EXPECT_NEAR(at.gradient.y, numeric[1], tolerance);
  EXPECT_NEAR(at.gradient.z, numeric[2], tolerance);
}

TEST(ObstacleDensity, GradientIsThatOfTheShare) {
  sim::cpu::ObstacleView sphere{}, box{}, plane{};
  sphere.shape = sim::ObstacleShape::sphere, sphere.half[0] = 2;
  box.shape = sim::ObstacleShape::box, box.half[0] = 2, box.half[1] = 1, box.half[2] = 3;
  plane.shape = sim::ObstacleShape::plane;
  Random random(5);
  for (auto* o : {&sphere, &box, &plane}) {
    const double angle = 0.7;
    const float turned[9] = {float(std::cos(angle)),
                             float(std::sin(angle)),
                             0,
                             float(-std::sin(angle)),
                             float(std::cos(angle)),
                             0,
                             0,
                             0,
                             1};
    std::copy_n(turned, 9, o->axis[1]);
    for (int k = 0; k < 3; ++k) o->low[k] = -1e9f, o->high[k] = 1e9f;
    int counted = 0;
    for (int k = 0; k < 4000; ++k) {
      const Vec3<float> x{float(8 * random() - 4), float(8 * random() - 4),
                          float(8 * random() - 4)};
      const float d = o->distance(o->to_own(1, x), 0);
      if (d < 0.02f || d > 0.6f) continue;
      expect_gradient([&](Vec3<float> y) { return law().of(*o, y); }, x, 6e-3);
      ++counted;
    }
    EXPECT_GT(counted, 50);
  }
}

// A plane is a domain wall: density and gradient to rounding, wall by wall and in edges.
TEST(ObstacleDensity, OfAPlaneIsThatOfADomainWall) {
  Shot walled = tank_shot(8), open = tank_shot(8);
  open.domain.axis[1] = open.domain.axis[0] = Axis::open;
  const V3d low = open.domain.min, high = open.domain.max;
  add_plane(open, low, V3d(0, 1, 0)), add_plane(open, high, V3d(0, -1, 0));
  add_plane(open, low, V3d(1, 0, 0)), add_plane(open, high, V3d(-1, 0, 0));
  Stepper a(walled), b(open);
  a.solver->refresh(), b.solver->refresh();
  const std::vector<float> rho = a.solver->density(), other = b.solver->density();
  ASSERT_EQ(rho.size(), other.size());
  for (size_t i = 0; i < rho.size(); ++i) EXPECT_NEAR(rho[i], other[i], 2e-3) << i;
  // And they flow alike: a column that settles for 40 steps.
  for (int k = 0; k < 40; ++k) a.step(2e-3), b.step(2e-3);
  EXPECT_LT((centre_of_mass(a.solver->save()) - centre_of_mass(b.solver->save())).length(),
            1e-3 * walled.fluid.spacing);
}

// A tank turned by 30 degrees, its walls planes, is the same tank under gravity that is turned the
// other way: free surface, pressure on the floor.
TEST(Obstacles, ATiltedTankIsATankInTiltedGravity) {
  const Settled plain = settle_in_tilted_gravity(30, 1.2), turned = settle_in_tilted_tank(30, 1.2);
  // Both in the tank's own frame, in spacings. The particles settle differently at random.
  EXPECT_LT((plain.centre - turned.centre).length(), 0.1);
  EXPECT_NEAR(plain.kinetic, turned.kinetic, 0.02);  // over the potential of half a tank
  EXPECT_LT(turned.density_error, 2e-3);
  EXPECT_EQ(turned.outside, 0);
}

// The reaction of a fluid at rest on what is in it: the weight of what it displaces.
class Buoyancy : public testing::TestWithParam<double> {};

TEST_P(Buoyancy, OfASubmergedSphereIsTheDisplacedWeight) {
  const Lift lift = lift_of(ObstacleType::sphere, GetParam());
  RecordProperty("error", std::to_string(lift.error));
  EXPECT_LT(std::abs(lift.error), 0.06) << lift.error;
  EXPECT_LT(std::abs(lift.sideways), 0.05);
}
TEST_P(Buoyancy, OfASubmergedBoxIsTheDisplacedWeight) {
  const Lift lift = lift_of(ObstacleType::box, GetParam());
  RecordProperty("error", std::to_string(lift.error));
  EXPECT_LT(std::abs(lift.error), 0.06) << lift.error;
  EXPECT_LT(std::abs(lift.sideways), 0.05);
}

INSTANTIATE_TEST_SUITE_P(RadiusInSpacings, Buoyancy, testing::Values(3., 4.5, 6.),
                         [](const auto& p) { return std::to_string(int(10 * p.param)); });

// Nothing but the obstacle pushes: what the fluid gains it loses.
TEST(Obstacles, MomentumOfFluidAndObstaclesIsKept) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  const double a = shot.fluid.spacing;
  add_box(shot, V3d(-4 * a, -14 * a, -4 * a), {8, 8, 8}, V3d(0.3, 2, 0.1));
  add_sphere(shot, V3d(0), 4 * a);
  Obstacle& box = add_obstacle(shot, ObstacleType::box, V3d(6 * a, 0, 0));
  box.size = V3d(4 * a), box.rotation_deg = V3d(20, 30, 40);
  Stepper run(shot);
  const V3d start = total_momentum(run.scene, run.solver->save());
  V3d given(0);
  double size = 0;
  std::vector<sim::ProbeQuery> on_each(2);
  for (int k = 0; k < 2; ++k)
    on_each[size_t(k)].kind = sim::ProbeKind::obstacle_force, on_each[size_t(k)].begin = k;
  for (int k = 0; k < 120; ++k) {
    run.step(1e-3);
    for (const std::vector<double>& force : run.solver->probe(on_each)) {
      const V3d impulse = V3d(force.at(0), force.at(1), force.at(2)) * 1e-3;
      given += impulse, size += impulse.length();
    }
  }
  const V3d end = total_momentum(run.scene, run.solver->save());
  EXPECT_GT(size, 0.2 * start.length());  // they did meet
  EXPECT_LT((end + given - start).length(), 1e-4 * start.length());
}

}  // namespace
}  // namespace drench::sim_tests
