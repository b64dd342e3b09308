// Triangles of shells at obstacles, seen by dense samples outside the solver
// (sim/passes/cloth/triangle_obstacles.h).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/same_state.h"
#include "tests/sim/sheet_crossings.h"

namespace drench::sim_tests {
namespace {

constexpr double g = 9.81, thickness = 0.001, cell = 0.02;  // m

/// Cells of two spacings; vertices keep 0.25 spacings and half the thickness.
Shot coarse_sheet(double height, int cells = 10) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -g, 0);
  shot.fluid.spacing = 0.01;
  Cloth& sheet = add_sheet(shot, cells * cell, height, cells);
  sheet.model = ClothModel::shell;
  sheet.thickness = thickness;
  return shot;
}

double film_frame(const Shot& shot, const Stepper& run) {
  return shot.timeline.first + run.time * shot.timeline.fps;
}

/// The least signed distance of any point of any triangle to any obstacle, m.
double nearest_point(const Shot& shot, const Stepper& run) {
  const sim::HostState state = run.solver->save();
  const sim::ClothTopology& cloth = run.scene.cloth;
  const double frame = film_frame(shot, run);
  double least = 1e30;
  for (int t = 0; t < cloth.triangles(); ++t) {
    V3d x[3];
    for (int c = 0; c < 3; ++c) {
      const V3d local = at(state.cloth_position, size_t(cloth.corner[3 * size_t(t) + size_t(c)]));
      for (int k = 0; k < 3; ++k) x[c][k] = run.scene.frame.to_world(k, local[k]);
    }
    const V3d middle = (x[0] + x[1] + x[2]) / 3;
    double radius = 0;
    for (const V3d& p : x) radius = std::max(radius, (p - middle).length());
    for (const Obstacle& o : shot.obstacle) {
      if (exact_distance(o, frame, middle) > radius + std::min(least, 0.01)) continue;
      constexpr int parts = 24;
      for (int i = 0; i <= parts; ++i) {
        for (int j = 0; i + j <= parts; ++j) {
          const V3d p = (x[0] * (parts - i - j) + x[1] * i + x[2] * j) / parts;
          least = std::min(least, exact_distance(o, frame, p));
        }
      }
    }
  }
  return least;
}

struct Watched {
  explicit Watched(const Shot& shot) : shot(shot), run(shot) {}
  void until(double end) {
    while (run.time < end) {
      run.step_towards(end, run.next_dt());
      nearest = std::min(nearest, nearest_point(shot, run));
      fastest = std::max(fastest, run.limits.max_speed);
    }
  }
  Shot shot;
  Stepper run;
  double nearest = 1e30;  // m
  float fastest = 0;      // m/s
};

/// What is asked of the nearest point, less what a stiff row gives way.
constexpr double kept = 0.5 * thickness - 1e-5;

struct Place {
  const char* name;
  double x, z;  // cells
};
class SmallBall : public testing::TestWithParam<Place> {};
INSTANTIATE_TEST_SUITE_P(Under, SmallBall,
                         testing::Values(Place{"vertex", 0, 0}, Place{"side", 0.5, 0},
                                         Place{"diagonal", 0.5, 0.5}, Place{"inside", 0.65, 0.25},
                                         Place{"near_side", 0.6, 0.06}),
                         [](const auto& p) { return std::string(p.param.name); });

// A ball of 0.3 cells: a sheet held at its corners falls on it and comes to rest.
TEST_P(SmallBall, DoesNotComeThrough) {
  Shot shot = coarse_sheet(0);
  shot.cloth[0].pin.push_back({{0, 10, 110, 120}, {}});
  add_sphere(shot, V3d(GetParam().x * cell, -0.02, GetParam().z * cell), 0.3 * cell);
  Watched watch(shot);
  watch.until(0.5);
  EXPECT_GE(watch.nearest, kept);
  EXPECT_LT(watch.nearest, 0.003);  // they did meet
  EXPECT_LT(watch.run.limits.max_speed, 0.1);
}

// A free sheet on a needle's tip slides off in the end.
TEST_P(SmallBall, DoesNotComeThroughAFreeSheet) {
  Shot shot = coarse_sheet(0);
  add_sphere(shot, V3d(GetParam().x * cell, -0.02, GetParam().z * cell), 0.3 * cell);
  shot.obstacle[0].friction = 0.3;
  Watched watch(shot);
  watch.until(0.4);
  EXPECT_GE(watch.nearest, kept);
  EXPECT_LT(watch.nearest, 0.003);
  EXPECT_LT(watch.fastest, 4);
}

struct Sharp {
  const char* name;
  V3d size, rotation_deg;
  double drop;  // m, from the centre to what is uppermost
};
class SharpBox : public testing::TestWithParam<Sharp> {};
INSTANTIATE_TEST_SUITE_P(
    Of, SharpBox,
    testing::Values(Sharp{"corner", V3d(0.06), V3d(45, 0, 35.2644), 0.052},
                    Sharp{"edge", V3d(0.06, 0.06, 0.3), V3d(0, 7, 45), 0.0425},
                    Sharp{"rod", V3d(0.004, 0.004, 0.3), V3d(0, 20, 0), 0.0021},
                    Sharp{"blade", V3d(0.001, 0.1, 0.3), V3d(0, 13, 0), 0.0501},
                    Sharp{"table", V3d(0.13, 0.04, 0.13), V3d(0, 20, 0), 0.0201}),
    [](const auto& p) { return std::string(p.param.name); });

TEST_P(SharpBox, DoesNotComeThrough) {
  Shot shot = coarse_sheet(0);
  Obstacle& box = add_obstacle(shot, ObstacleType::box, V3d(0.003, -0.01 - GetParam().drop, 0.004));
  box.size = GetParam().size, box.rotation_deg = GetParam().rotation_deg, box.friction = 0.4;
  Watched watch(shot);
  watch.until(0.4);
  EXPECT_GE(watch.nearest, kept);
  EXPECT_LT(watch.nearest, 0.003);
  EXPECT_LT(watch.fastest, 4);
}

class MovingBall : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Speed, MovingBall, testing::Values(0.5, 5.),
                         [](const auto& p) { return std::to_string(int(10 * p.param)); });

// A ball of 0.3 cells that comes up under the inside of a triangle takes the sheet along.
TEST_P(MovingBall, PushesASheet) {
  Shot shot = coarse_sheet(0);
  shot.gravity = V3d(0);
  const V3d from(0.65 * cell, -0.02, 0.25 * cell), to = from + V3d(0, 0.1, 0);
  add_sphere(shot, from, 0.3 * cell);
  const double seconds = 0.1 / GetParam();
  shot.obstacle[0].position.keys = {{1001, from}, {1001 + seconds * shot.timeline.fps, to}};
  Watched watch(shot);
  watch.until(seconds);
  EXPECT_GE(watch.nearest, kept);
  EXPECT_LT(watch.fastest, 5 * GetParam());
  double top = -1e30;
  const sim::HostState state = watch.run.solver->save();
  for (size_t v = 0; v < state.cloth_position.size(); ++v)
    top = std::max(top, double(at(state.cloth_position, v).y));
  EXPECT_GT(watch.run.scene.frame.to_world(1, top), 0.08);
}

/// A sheet between two plates that close from `from` to `to`, m, in 0.2 s, and stay.
Shot press(double from, double to) {
  Shot shot = coarse_sheet(0, 6);
  for (int side : {-1, 1}) {
    const double half = 0.02;
    const V3d start(0.01, side * (half + 0.5 * from), 0.005),
        end(0.01, side * (half + 0.5 * to), 0.005);
    Obstacle& plate = add_obstacle(shot, ObstacleType::box, start);
    plate.size = V3d(0.07, 2 * half, 0.07), plate.friction = 0.3;
    plate.rotation_deg = V3d(0, 25, 0);
    plate.position.keys = {{1001, start}, {1001 + 0.2 * shot.timeline.fps, end}};
  }
  return shot;
}

// Vertices keep 3 mm, triangles 1.5 mm: at 4 mm there is room for these alone.
TEST(TrianglesAtObstacles, ASheetBetweenTwoPlatesKeepsItsThickness) {
  Watched watch(press(0.02, 0.004));
  watch.until(0.4);
  EXPECT_GE(watch.nearest, kept);
  EXPECT_LT(watch.fastest, 3);
  EXPECT_LT(watch.run.limits.max_speed, 0.5);
}

// Half a thickness is no room: what is left of it is shared, and the sheet stays in between.
TEST(TrianglesAtObstacles, ASheetWithoutRoomStaysBetweenThePlates) {
  Watched watch(press(0.02, 0.0005));
  watch.until(0.4);
  EXPECT_GE(watch.nearest, -0.001);
  EXPECT_LT(watch.fastest, 10);
}

// What the sheet loses the ball gets.
TEST(TrianglesAtObstacles, MomentumIsKept) {
  Shot shot = coarse_sheet(0);
  shot.gravity = V3d(0);
  shot.cloth[0].damping = 0, shot.cloth[0].velocity = V3d(0.1, -1, 0);
  add_sphere(shot, V3d(0.65 * cell, -0.02, 0.25 * cell), 0.3 * cell);
  shot.obstacle[0].friction = 0.4;
  Stepper run(shot);
  const V3d start = total_momentum(run.scene, run.solver->save());
  V3d given(0);
  while (run.time < 0.1) {
    run.step();
    for (const sim::ObstacleImpulse& i : run.solver->obstacle_impulses())
      given += V3d(i.impulse[0], i.impulse[1], i.impulse[2]);
  }
  const V3d end = total_momentum(run.scene, run.solver->save());
  EXPECT_GT(given.length(), 0.05 * start.length());
  EXPECT_LT((end + given - start).length(), 1e-3 * start.length());
}

Shot sharp_and_moving() {
  Shot shot = coarse_sheet(0);
  Obstacle& box = add_obstacle(shot, ObstacleType::box, V3d(0.003, -0.062, 0.004));
  box.size = V3d(0.06), box.rotation_deg = V3d(45, 0, 35.2644), box.friction = 0.4;
  box.position.keys = {{1001, V3d(0.003, -0.062, 0.004)}, {1013, V3d(0.003, 0.1, 0.02)}};
  return shot;
}

TEST(TrianglesAtObstacles, HaveTheSameBitsForAnyNumberOfThreadsAndGoOn) {
  expect_same_bits_on_threads(sharp_and_moving(), 60, 2e-3);
  expect_same_bits_when_resumed(sharp_and_moving(), 60, 2e-3);
}

TEST(TrianglesAtObstacles, FarAwayChangesNoBit) {
  Shot with = coarse_sheet(0);
  with.cloth[0].pin.push_back({{0, 10}, {}});
  Shot plain = with;
  add_sphere(with, V3d(3, 0, 0), 0.2);
  Stepper a(plain), b(with);
  for (int k = 0; k < 40; ++k) a.step(2e-3), b.step(2e-3);
  expect_same_state(a.solver->save(), b.solver->save());
}

// A sheet of 900 cells, most of whose weight a single triangle bears at first.
TEST(TrianglesAtObstacles, ALargeSheetOnASmallBallStaysOnIt) {
  Shot shot = coarse_sheet(0, 30);
  add_sphere(shot, V3d(0.65 * cell, -0.02, 0.25 * cell), 0.3 * cell);
  shot.obstacle[0].friction = 0.5;
  Watched watch(shot);
  watch.until(0.4);
  EXPECT_GE(watch.nearest, kept);
  EXPECT_LT(watch.nearest, 0.003);
}

// Layers over a corner: what the obstacle holds is not moved through the other layer.
TEST(TrianglesAtObstacles, LayersOverACornerDoNotCross) {
  Shot shot = sharp_and_moving();
  shot.cloth.push_back(shot.cloth[0]);
  shot.cloth[1].name = "upper", shot.cloth[1].corner.y += 1.3 * thickness;
  Stepper run(shot);
  int crossings = 0;
  double nearest = 1e30;
  while (run.time < 0.4) {
    run.step();
    crossings += count_sheet_crossings(run.scene.cloth, run.solver->save().cloth_position);
    nearest = std::min(nearest, nearest_point(shot, run));
  }
  EXPECT_EQ(crossings, 0);
  EXPECT_GE(nearest, kept);
}

// Water that falls on a sheet presses it on a rod.
TEST(TrianglesAtObstacles, ARodDoesNotComeThroughUnderWater) {
  Shot shot = coarse_sheet(0, 12);
  shot.fluid.solver = FluidSolver::incompressible;
  pin_edges(shot.cloth[0]);
  const double a = shot.fluid.spacing;
  add_box(shot, V3d(-4 * a, 3 * a, -4 * a), {8, 8, 8}, V3d(0, -2, 0));
  Obstacle& rod = add_obstacle(shot, ObstacleType::box, V3d(0.004, -0.007, 0));
  rod.size = V3d(0.004, 0.004, 0.2), rod.rotation_deg = V3d(0, 20, 0);
  Watched watch(shot);
  watch.until(0.15);
  EXPECT_GE(watch.nearest, kept);
  EXPECT_LT(watch.nearest, 0.003);
}

// Walls leave particles a quarter of a spacing; where there are none, sheets lie a quarter of their
// thickness above them.
TEST(ShellsWithoutFluid, LieOnTheFloorByTheirThickness) {
  Shot shot = coarse_sheet(0.004);
  shot.domain.min.y = 0;
  shot.domain.axis[1] = Axis::walls;
  const auto lies_at = [](const Shot& one) {
    Stepper run(one);
    run.advance(0.3);
    const sim::HostState state = run.solver->save();
    const std::vector<float>& y = state.cloth_position.y;
    EXPECT_LT(*std::max_element(y.begin(), y.end()) - *std::min_element(y.begin(), y.end()), 1e-6);
    return run.scene.frame.to_world(1, y[0]);
  };
  EXPECT_NEAR(lies_at(shot), 0.75 * thickness, 1e-6);
  shot.cloth[0].model = ClothModel::springs;
  EXPECT_NEAR(lies_at(shot), 0.25 * shot.fluid.spacing, 1e-6);
}

}  // namespace
}  // namespace drench::sim_tests
