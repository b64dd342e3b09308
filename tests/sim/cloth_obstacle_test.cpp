// Sheets on, over and before obstacles, with and without water.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "tests/sim/crossings.h"
#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/same_state.h"

namespace drench::sim_tests {
namespace {

constexpr double g = 9.81;

double film_frame(const Shot& shot, const Stepper& run) {
  return shot.timeline.first + run.time * shot.timeline.fps;
}
V3d world(const Stepper& run, const sim::HostVec& p, size_t i) {
  V3d x;
  for (int k = 0; k < 3; ++k) x[k] = run.scene.frame.to_world(k, at(p, i)[k]);
  return x;
}

/// The least signed distance of a vertex to any obstacle, m.
double nearest_vertex(const Shot& shot, const Stepper& run) {
  const sim::HostState state = run.solver->save();
  double least = 1e30;
  for (size_t v = 0; v < state.cloth_position.size(); ++v) {
    for (const Obstacle& o : shot.obstacle) {
      const V3d x = world(run, state.cloth_position, v);
      least = std::min(least, exact_distance(o, film_frame(shot, run), x));
    }
  }
  return least;
}

double sheet_mass(const Stepper& run) {
  double sum = 0;
  for (const float m : run.scene.cloth.mass) sum += m;
  return sum;
}

V3d impulses(const Stepper& run) {
  V3d sum(0);
  for (const sim::ObstacleImpulse& i : run.solver->obstacle_impulses())
    sum += V3d(i.impulse[0], i.impulse[1], i.impulse[2]);
  return sum;
}

/// Steps for `seconds`; the mean force on all obstacles, N, and the nearest that a vertex came.
struct Pressed {
  V3d force{0};
  double nearest = 1e30;
  float fastest = 0;  // at the end, m/s
};
Pressed press(const Shot& shot, Stepper& run, double seconds) {
  Pressed result;
  const double begin = run.time;
  while (run.time < begin + seconds) {
    run.step();
    result.force += impulses(run);
    result.nearest = std::min(result.nearest, nearest_vertex(shot, run));
  }
  result.force /= run.time - begin;
  result.fastest = run.limits.max_speed;
  return result;
}

/// A free sheet of 0.3 m in air that damps it, over what a test puts below it.
Shot drape() {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -g, 0);
  Cloth& sheet = add_sheet(shot, 0.3, 0.03, 24);
  sheet.damping = 2;
  return shot;
}

/// On the obstacle once the sheet is at rest, in weights of the sheet. No vertex is ever inside.
V3d settled_force(const Shot& shot) {
  Stepper run(shot);
  EXPECT_GE(press(shot, run, 1.5).nearest, 0);
  const Pressed rest = press(shot, run, 0.5);
  EXPECT_GE(rest.nearest, 0);
  return rest.force / (sheet_mass(run) * g);
}

TEST(ClothOnObstacles, ASheetOverASphereWeighsOnItAndNoVertexIsInside) {
  Shot shot = drape();
  add_sphere(shot, V3d(0, -0.1, 0), 0.1);
  shot.obstacle[0].friction = 0.5;
  const V3d force = settled_force(shot);
  EXPECT_NEAR(force.y, -1, 0.01);
  EXPECT_LT(std::hypot(force.x, force.z), 0.01);
}

TEST(ClothOnObstacles, ASheetOverATableHangsFromItsEdges) {
  Shot shot = drape();
  Obstacle& table = add_obstacle(shot, ObstacleType::box, V3d(0, -0.1, 0));
  table.size = V3d(0.18, 0.2, 0.18), table.rotation_deg = V3d(0, 20, 0);
  EXPECT_NEAR(settled_force(shot).y, -1, 0.01);
}

/// How far and how fast a strip has slid down a plane of `degrees` after 0.3 s.
struct Slid {
  double way, speed;
};
Slid slide(double degrees, double friction, int cells) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -g, 0);
  const double angle = degrees * M_PI / 180, a = shot.fluid.spacing;
  const V3d down(std::cos(angle), -std::sin(angle), 0), up(std::sin(angle), std::cos(angle), 0);
  add_plane(shot, V3d(0), up);
  shot.obstacle[0].friction = friction;
  Cloth strip;
  strip.corner = up * (0.25 * a + 0.5 * strip.thickness);
  strip.u = down * 0.2, strip.v = V3d(0, 0, 0.05), strip.cells = V2i(4 * cells, cells);
  strip.damping = 0;
  shot.cloth.push_back(strip);
  Stepper run(shot);
  const sim::HostState start = run.solver->save();
  while (run.time < 0.3 - 1e-9) run.step(1e-3);
  const sim::HostState end = run.solver->save();
  Slid mean{0, 0};
  const double n = double(end.cloth_position.size());
  for (size_t v = 0; v < end.cloth_position.size(); ++v) {
    mean.way += (at(end.cloth_position, v) - at(start.cloth_position, v)).dot(down) / n;
    mean.speed += at(end.cloth_velocity, v).dot(down) / n;
  }
  return mean;
}

// A block on an incline: a = g (sin - mu cos), or none where tan < mu. The way of symplectic Euler
// is a t (t + dt) / 2.
class Incline : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Cells, Incline, testing::Values(2, 4, 8));
TEST_P(Incline, IsSlidDownAsCoulombSays) {
  for (const double friction : {0., 0.2, 0.5}) {
    const double rate = g * (std::sin(M_PI / 6) - friction * std::cos(M_PI / 6));
    const Slid slid = slide(30, friction, GetParam());
    EXPECT_NEAR(slid.speed, rate * 0.3, 5e-3 * rate * 0.3) << friction;
    EXPECT_NEAR(slid.way, 0.5 * rate * 0.3 * 0.301, 5e-3 * rate * 0.045) << friction;
  }
  // What the solve leaves of a speed scatters by a third of it with the last bits of the angle.
  const double angles[] = {29.9, 29.99, 30, 30.00001, 30.001};
  Slid stuck{0, 0};
  for (const double angle : angles) {
    const Slid one = slide(angle, 0.6, GetParam());
    stuck.speed += std::abs(one.speed) / std::size(angles);
    stuck.way = std::max(stuck.way, std::abs(one.way));
  }
  EXPECT_LT(stuck.speed, 1e-4);
  EXPECT_LT(stuck.way, 1e-4);
}

/// Eight times eight columns of water, six high, on a loose sheet that ends at the walls, on a
/// plane.
Shot pool_on_plane() {
  Shot shot = tank_shot(6);
  const double a = shot.fluid.spacing;
  shot.domain.min.y = -4 * a;
  add_plane(shot, V3d(0), V3d(0, 1, 0));
  Cloth& sheet = add_sheet(shot, 7.4 * a, 0.3 * a, 8);
  sheet.corner += V3d(4 * a, 0, 4 * a);
  shot.fluid.box[0].min.y += a, shot.fluid.box[0].max.y += a;
  return shot;
}

// Water and sheet stand on the plane.
TEST(ClothOnObstacles, APoolOnASheetOnAPlaneWeighsOnIt) {
  const Shot shot = pool_on_plane();
  const double a = shot.fluid.spacing;
  Stepper run(shot);
  run.advance(0.6);
  const Pressed rest = press(shot, run, 0.4);
  const sim::HostState state = run.solver->save();
  const double water = run.scene.parameters.particle_mass * double(state.id.size());
  const double weight = (water + sheet_mass(run)) * g;
  EXPECT_NEAR(rest.force.y, -weight, 0.02 * weight);
  EXPECT_EQ(particles_inside(shot, run), 0);
  double low = 1e30, high = -1e30;
  for (size_t v = 0; v < state.cloth_position.size(); ++v) {
    const double y = world(run, state.cloth_position, v).y;
    low = std::min(low, y), high = std::max(high, y);
  }
  EXPECT_GE(rest.nearest, 0.24 * a);
  EXPECT_LT(high - low, 0.1 * a);  // no sag, no fold
}

/// A pool on a sheet pinned along its edges to the walls, and a sphere that comes up from below.
Shot punched(double speed) {
  Shot shot = tank_shot(6);
  const double a = shot.fluid.spacing;
  shot.fluid.box.clear();
  shot.domain.min = V3d(0, -12 * a, 0), shot.domain.max = V3d(16 * a, 30 * a, 16 * a);
  add_box(shot, V3d(0, a, 0), {16, 6, 16});
  Cloth& sheet = add_sheet(shot, 15.4 * a, 0, 16);
  sheet.corner += V3d(8 * a, 0, 8 * a);
  pin_edges(sheet);
  add_sphere(shot, V3d(0), 4 * a);
  const double seconds = 10 * a / speed;
  shot.obstacle[0].position.keys = {{1001, V3d(8 * a, -7 * a, 8 * a)},
                                    {1001 + seconds * shot.timeline.fps, V3d(8 * a, 3 * a, 8 * a)}};
  return shot;
}

class Punch : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Speed, Punch, testing::Values(0.5, 5.),
                         [](const auto& p) { return std::to_string(int(10 * p.param)); });
TEST_P(Punch, ASphereLiftsTheSheetAndItsPoolWithoutALeak) {
  const Shot shot = punched(GetParam());
  const double a = shot.fluid.spacing, seconds = 10 * a / GetParam();
  Stepper run(shot);
  int crossings = 0, inside = 0;
  double nearest = 1e30;
  sim::HostState before = run.solver->save();
  run.solver->observe_substeps([&](const sim::HostState& state) {
    crossings += count_crossings(run.scene.cloth, before, state);
    before = state;
  });
  while (run.time < 1.3 * seconds + 0.05) {
    run.step();
    inside += particles_inside(shot, run);
    nearest = std::min(nearest, nearest_vertex(shot, run));
  }
  EXPECT_EQ(crossings, 0);
  EXPECT_EQ(inside, 0);
  EXPECT_GE(nearest, 0);
  double top = -1e30;
  for (size_t v = 0; v < before.cloth_position.size(); ++v)
    top = std::max(top, world(run, before.cloth_position, v).y);
  EXPECT_GT(top, 7 * a);
}

class FastBall : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Speed, FastBall, testing::Values(10., 100.),
                         [](const auto& p) { return std::to_string(int(p.param)); });
// A ball of 5 spacings shot at a free sheet takes it along.
TEST_P(FastBall, DoesNotPassAFreeSheet) {
  Shot shot = empty_shot();
  const double a = shot.fluid.spacing, seconds = 0.5 / GetParam();
  add_sheet(shot, 0.3, 0, 24);
  add_sphere(shot, V3d(0), 5 * a);
  shot.obstacle[0].position.keys = {{1001, V3d(0.003, -6 * a, 0.002)},
                                    {1001 + seconds * shot.timeline.fps, V3d(0.003, 0.5, 0.002)}};
  Stepper run(shot);
  double nearest = 1e30;
  float fastest = 0;
  while (run.time < seconds) {
    run.step();
    ASSERT_EQ(run.limits.bad_vertex, -1);
    nearest = std::min(nearest, nearest_vertex(shot, run));
    fastest = std::max(fastest, run.limits.max_speed);
  }
  EXPECT_GE(nearest, 0);
  EXPECT_LT(fastest, 4 * GetParam());
  const sim::HostState state = run.solver->save();
  EXPECT_GT(world(run, state.cloth_position, 12 * 25 + 12).y, 0.5);  // before the ball
}

// What sheet and water lose obstacles get. Later, between the ball and the sheet that it has
// wrapped itself into, squeezed particles give velocity up, as ContinuousCollision::bounce says.
TEST(ClothOnObstacles, MomentumIsKept) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  const double a = shot.fluid.spacing;
  Cloth& sheet = add_sheet(shot, 0.2, 0, 16);
  sheet.damping = 0, sheet.velocity = V3d(0.1, -1, 0);
  add_sphere(shot, V3d(0, -0.06, 0), 0.05);
  Obstacle& box = add_obstacle(shot, ObstacleType::box, V3d(0.08, -0.05, 0));
  box.size = V3d(0.04), box.rotation_deg = V3d(20, 30, 40);
  add_box(shot, V3d(-4 * a, a, -4 * a), {8, 6, 8}, V3d(0.1, -1, 0.05));
  Stepper run(shot);
  const V3d start = total_momentum(run.scene, run.solver->save());
  const double scale = momentum_scale(run.scene, run.solver->save(), 0);
  V3d given(0);
  double size = 0;
  for (int k = 0; k < 140; ++k) {
    run.step(5e-4);
    const V3d impulse = impulses(run);
    given += impulse, size += impulse.length();
  }
  const V3d end = total_momentum(run.scene, run.solver->save());
  EXPECT_GT(size, 0.2 * start.length());  // they did meet
  EXPECT_LT((end + given - start).length(), 1e-5 * scale);
}

TEST(ClothOnObstacles, HasTheSameBitsForAnyNumberOfThreadsAndGoesOn) {
  expect_same_bits_on_threads(punched(5), 30, 7e-4);
  expect_same_bits_when_resumed(punched(5), 30, 7e-4);
}

TEST(ClothOnObstacles, FarAwayChangesNoBit) {
  Shot plain = punched(5);
  plain.obstacle.clear();
  Shot with = plain;
  add_sphere(with, V3d(3, 0, 0), 0.2);
  Stepper a(plain), b(with);
  for (int k = 0; k < 40; ++k) a.step(2e-3), b.step(2e-3);
  expect_same_state(a.solver->save(), b.solver->save());
}

TEST(ClothOnObstacles, AddNoPassToOtherShots) {
  const auto passes = [](const Shot& shot) {
    std::vector<std::string> names;
    for (const sim::PassInfo& pass : Stepper(shot).solver->plan()) names.push_back(pass.name);
    return names;
  };
  Shot alone = drape();
  EXPECT_EQ(passes(alone), std::vector<std::string>{"move_cloth"});
  add_sphere(alone, V3d(0, -0.1, 0), 0.1);
  EXPECT_EQ(passes(alone), std::vector<std::string>{"settle_cloth"});
  Shot both = punched(5), without = both;
  without.obstacle.clear();
  EXPECT_EQ(passes(both).size(), passes(without).size());
}

TEST(ClothOnObstacles, AreRefusedWhereASheetStartsInsideOne) {
  Shot shot = drape();
  add_sphere(shot, V3d(0, 0, 0), 0.1);
  try {
    sim::build_scene(shot);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("starts inside an obstacle"), std::string::npos);
  }
  shot.cloth[0].pin.push_back({{}, {{V3d(-1), V3d(1)}}});  // what is pinned may
  EXPECT_NO_THROW(sim::build_scene(shot));
}

}  // namespace
}  // namespace drench::sim_tests
