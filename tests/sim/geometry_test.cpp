// Point, segment and path against triangles, by brute force and by hand.

#include "sim/passes/coupling/geometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/backend/parallel.h"
#include "sim/passes/coupling/collision_rounds.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

using sim::cpu::MovingTriangle;
using D3 = sim::cpu::Vec3<double>;
using F3 = sim::cpu::Vec3<float>;

F3 draw(Random& random) {
  return {float(2 * random() - 1), float(2 * random() - 1), float(2 * random() - 1)};
}

// A grid of 200 x 200 points on the triangle: none is nearer than the answer, and the nearest is no
// farther than the answer by more than a cell of the grid.
TEST(ClosestPoint, IsTheNearestOfAllPointsOfTheTriangle) {
  Random random(11);
  for (int trial = 0; trial < 300; ++trial) {
    const F3 p = draw(random), a = draw(random), b = draw(random);
    F3 c = draw(random);
    if (trial % 5 == 0) c = a + (b - a) * float(random()) + draw(random) * 1e-3f;  // a sliver
    const auto found = sim::cpu::closest_point(p, a, b, c);
    EXPECT_GE(found.wa, -1e-6f);
    EXPECT_GE(found.wb, -1e-6f);
    EXPECT_GE(found.wc, -1e-6f);
    constexpr int n = 200;
    double nearest = 1e30;
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; i + j <= n; ++j) {
        const double u = double(i) / n, v = double(j) / n;
        const D3 x = sim::cpu::to_double(a) * (1 - u - v) + sim::cpu::to_double(b) * u +
                     sim::cpu::to_double(c) * v;
        nearest = std::min(nearest, length(sim::cpu::to_double(p) - x));
      }
    }
    const F3 foot = a * found.wa + b * found.wb + c * found.wc;
    const double distance = std::sqrt(found.distance2);
    EXPECT_NEAR(length(p - foot), distance, 2e-4) << trial;  // slivers lose digits in their weights
    EXPECT_LE(distance, nearest + 2e-4) << trial;
    EXPECT_GE(distance, nearest - 3.5 / n) << trial;  // edges are at most 2 sqrt(3) long
  }
}

/// Distance to a triangle in double: to its edges, and to its plane where the foot lies inside.
double distance_in_double(D3 p, const D3 (&corner)[3]) {
  const D3 n = cross(corner[1] - corner[0], corner[2] - corner[0]);
  double nearest = 1e30;
  bool inside = true;
  for (int k = 0; k < 3; ++k) {
    const D3 a = corner[k], e = corner[(k + 1) % 3] - a;
    const double t = std::clamp(dot(p - a, e) / dot(e, e), 0.0, 1.0);
    nearest = std::min(nearest, length(p - a - e * t));
    inside &= dot(cross(e, p - a), n) >= 0;
  }
  return inside ? std::abs(dot(p - corner[0], n)) / length(n) : nearest;
}

// The bound that spares the exact distance may not pass it, for triangles down to a corner of half
// a degree at any of the three, of edges of length 1.
TEST(ClosestPoint, IsNotNearerThanTheBound) {
  Random random(12);
  for (const double degrees : {60., 10., 3., 1., 0.5}) {
    constexpr int trials = 30000;
    int close = 0;
    for (int trial = 0; trial < trials; ++trial) {
      const F3 u = draw(random), e = u * (1 / length(u)), side = cross(e, draw(random)),
               f = side * (1 / length(side)), apex = draw(random);
      const double angle = degrees * 3.14159265358979 / 180;
      const F3 edge = e * float(std::cos(angle)) + f * float(std::sin(angle));
      F3 corner[3];
      corner[trial % 3] = apex, corner[(trial + 1) % 3] = apex + e,
                     corner[(trial + 2) % 3] = apex + edge;
      const F3 p = corner[trial / 3 % 3] + draw(random) * float(random());
      const auto t = sim::cpu::prepare_triangle(corner[0], corner[1], corner[2]);
      const double bound = std::sqrt(sim::cpu::distance2_bound(sim::cpu::plane_foot(p, t), t));
      const double exact = distance_in_double(
          to_double(p), {to_double(corner[0]), to_double(corner[1]), to_double(corner[2])});
      EXPECT_LE(bound, exact + 5e-4) << degrees;
      close += bound > 0.9 * exact;
    }
    if (degrees >= 10) {
      EXPECT_GT(close, trials / 2) << degrees;  // and it is of use
    }
  }
}

const D3 corner_a{0, 0, 0}, corner_b{1, 0, 0}, corner_c{0, 1, 0};

TEST(Segment, CrossesATriangleOnlyWithinItsOutline) {
  using sim::cpu::segment_crosses;
  EXPECT_TRUE(segment_crosses({0.2, 0.2, 1}, {0.2, 0.2, -1}, corner_a, corner_b, corner_c));
  EXPECT_TRUE(segment_crosses({0.2, 0.2, -1}, {0.3, 0.3, 1}, corner_a, corner_b, corner_c));
  EXPECT_TRUE(
      segment_crosses({0.5, 0.5, 1}, {0.5, 0.5, -1}, corner_a, corner_b, corner_c));  // on an edge
  EXPECT_FALSE(segment_crosses({0.6, 0.6, 1}, {0.6, 0.6, -1}, corner_a, corner_b, corner_c));
  EXPECT_FALSE(segment_crosses({0.2, 0.2, 2}, {0.2, 0.2, 1}, corner_a, corner_b, corner_c));
  EXPECT_FALSE(segment_crosses({-1, 0.2, 0.1}, {2, 0.2, 0.1}, corner_a, corner_b, corner_c));
}

MovingTriangle moved_by(D3 step) {
  return {corner_a, corner_b, corner_c, corner_a + step, corner_b + step, corner_c + step};
}

// Linear motions, whose meeting times are plain fractions.
TEST(CrossingTime, IsThatOfLinearMotion) {
  using sim::cpu::crossing_time;
  EXPECT_NEAR(crossing_time(moved_by({0, 0, 0}), {0.2, 0.2, 1}, {0.2, 0.2, -3}), 0.25, 1e-12);
  EXPECT_NEAR(crossing_time(moved_by({0, 0, 1}), {0.2, 0.2, 1}, {0.2, 0.2, -3}), 0.2, 1e-12);
  EXPECT_NEAR(crossing_time(moved_by({0, 0, 2}), {0.2, 0.2, 1}, {0.2, 0.2, 1}), 0.5, 1e-12);
  EXPECT_NEAR(crossing_time(moved_by({1, 0, 0}), {1.2, 0.2, 1}, {1.2, 0.2, -1}), 0.5, 1e-12);
}

TEST(CrossingTime, IsNoneForPathsThatMiss) {
  using sim::cpu::crossing_time;
  EXPECT_LT(crossing_time(moved_by({0, 0, 0}), {0.2, 0.2, 1}, {0.2, 0.2, 0.5}), 0);
  EXPECT_LT(crossing_time(moved_by({0, 0, 0}), {0.9, 0.9, 1}, {0.9, 0.9, -1}), 0);
  EXPECT_LT(crossing_time(moved_by({0, 0, -3}), {0.2, 0.2, 1}, {0.2, 0.2, -1}), 0);  // it runs away
  EXPECT_LT(crossing_time(moved_by({5, 0, 0}), {0.2, 0.2, 1}, {0.2, 0.2, -1}), 0);  // gone sideways
}

// Two corners swap sides while the third, at x = 1, stands: the plane sweeps through a point that
// rests near it. a and c go from z = -1 to 1, so at b + s (..) the height is linear: the point at
// height 0.2 over the middle between a and b is met when (2 t - 1)/2 = 0.2, t = 0.7.
TEST(CrossingTime, OfATriangleThatTurns) {
  const MovingTriangle m{{0, 0, -1}, {1, 0, 0}, {0, 1, -1}, {0, 0, 1}, {1, 0, 0}, {0, 1, 1}};
  EXPECT_NEAR(sim::cpu::crossing_time(m, {0.5, 0.25, 0.2}, {0.5, 0.25, 0.2}), 0.7, 1e-12);
}

/// Velocity after one step of one particle at `place` near a sheet of 0.2 m at height 0.
V3d pushed(V3d place, V3d velocity) {
  Shot shot = empty_shot();
  add_box(shot, V3d(0.5, 0.5, 0.5), {1, 1, 1});
  add_sheet(shot, 0.2, 0, 10);
  sim::Scene scene = sim::build_scene(shot);
  sim::HostState& s = scene.start;
  const V3d p = place - V3d(-1);  // local
  s.position.x[0] = float(p.x), s.position.y[0] = float(p.y), s.position.z[0] = float(p.z);
  s.velocity.x[0] = float(velocity.x), s.velocity.y[0] = float(velocity.y),
  s.velocity.z[0] = float(velocity.z);
  Stepper run(std::move(scene));
  run.step(2e-4);
  return at(run.solver->save().velocity, 0);
}

TEST(FreeEdge, PushesNothingBesideIt) {
  for (double d = 0.1; d <= 2; d += 0.1) {
    for (double up : {0.0, 0.05, 0.3}) {
      const V3d beside(0.1 + 0.01 * d, 0.01 * up, 0.013), v(0, -0.5, 0.25);
      EXPECT_EQ(pushed(beside, v), v) << d << ' ' << up;
      const V3d corner(0.1 + 0.01 * d, 0.01 * up, 0.1 + 0.01 * d);
      EXPECT_EQ(pushed(corner, v), v) << d << ' ' << up;
    }
  }
}

// The same particle over the sheet itself is slowed: it has 1 g, the vertices of its triangle 0.24
// g in all.
TEST(FreeEdge, TheSheetItselfDoesPush) {
  EXPECT_GT(pushed(V3d(0.013, 0.004, 0.017), V3d(0, -0.5, 0)).y, -0.45);
}

// A triangle rises 1 mm in the first substep and springs back to 0.5 mm in the second, while a
// particle that followed it at 0.8 mm goes on: the boxes are those of the step's start, 0.8 mm
// below.
TEST(ContinuousCollision, FindsATriangleThatSpringsBackWithinTheStep) {
  sim::cpu::State state;
  state.parameters.spacing = 0.01f, state.parameters.support_radius = 0.02f;
  state.parameters.particle_mass = 1e-3f;
  sim::cpu::ClothState& c = state.cloth;
  c.vertices = 3, c.triangles = c.polygons = 1, c.padded = 8;
  for (sim::cpu::VecColumn* column : {&c.position, &c.start, &c.next}) column->resize(8);
  c.centroid.resize(1), c.cell.resize(1);
  c.sorted_low.resize(9), c.sorted_high.resize(9), c.sorted_triangle.resize(9);
  sim::cpu::from_host(c.corner, std::vector<int>{0, 1, 2});
  const auto put = [](sim::cpu::VecColumn& column, float z) {
    column.view().set(0, {0.f, 0.f, z});
    column.view().set(1, {0.02f, 0.f, z});
    column.view().set(2, {0.f, 0.02f, z});
  };
  put(c.position, 0), put(c.start, 0), put(c.next, 1e-3f);
  sim::cpu::build_polygon_grid(state, state.parameters.support_radius);
  const float moved = continuous_collision_of(state, 0).cloth_moved;
  EXPECT_NEAR(moved, 1e-3f, 1e-9f);
  put(c.position, 1e-3f), put(c.next, 5e-4f);
  const F3 from{0.005f, 0.005f, 0.8e-3f}, to{0.005f, 0.005f, 1.65e-3f};
  const auto hit = continuous_collision_of(state, moved).first_hit(from, to);
  EXPECT_EQ(hit.triangle, 0);
  EXPECT_NEAR(hit.time, 0.2 / 1.35, 1e-5);  // 0.8 + 0.85 t = 1 - 0.5 t
}

}  // namespace
}  // namespace drench::sim_tests
