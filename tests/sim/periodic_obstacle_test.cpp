// Obstacles and periodic axes: what lies across a seam is whole, what reaches around has no ends,
// and nothing tells where the seam is. Meshes: tests/driver/periodic_mesh_test.cpp.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/periodic_scenes.h"
#include "tests/sim/same_state.h"

namespace drench::sim_tests {
namespace {

constexpr double a = 0.01, g = 9.81;  // m, m/s^2

V3d impulse_of(const Stepper& run, size_t obstacle) {
  const sim::ObstacleImpulse i = run.solver->obstacle_impulses().at(obstacle);
  return {i.impulse[0], i.impulse[1], i.impulse[2]};
}

/// Keys of a straight way at `velocity` m/s for four seconds.
void move(Obstacle& o, const Shot& shot, const V3d& from, const V3d& velocity) {
  const double last = shot.timeline.first + 4 * shot.timeline.fps;
  o.position.keys = {{double(shot.timeline.first), from}, {last, from + velocity * 4}};
}

// --- Nothing tells where the seam is -------------------------------------------------------------

enum class Body { plane, ball, block, bar, moving };

void add_body(Shot& shot, Body body, const V3d& shift, const V3d& drift) {
  const V3d foot = V3d(0.075, 0.1, 0.06) + shift;
  const bool box = body != Body::plane && body != Body::ball;
  Obstacle& o = add_obstacle(shot,
                             box                  ? ObstacleType::box
                             : body == Body::ball ? ObstacleType::sphere
                                                  : ObstacleType::plane,
                             V3d(0));
  o.radius = 0.03, o.size = V3d(0.06, 0.04, 0.05), o.normal = V3d(0, 1, 0);
  if (body == Body::bar) o.size.z = 0.2;
  o.rotation_deg = body == Body::bar ? V3d(0, 0, 30) : box ? V3d(10, 20, 30) : V3d(0);
  move(o, shot, foot - V3d(0, body == Body::plane ? 0 : 0.03, 0),
       drift + (body == Body::moving ? V3d(0.4, 0, 0.3) : V3d(0)));
}

/// Water that hits a body from above, all moved by `shift` m and flying by `drift` m/s.
Shot splash(Body body, const V3d& shift, const V3d& drift = V3d(0)) {
  Shot shot = slab({15, 40, 12});
  shot.fluid.tolerance = 1e-6;  // an iteration more or less is not to count
  add_body(shot, body, shift, drift);
  add_box(shot, V3d(0.05, 0.11, 0.03) + shift, {6, 5, 6}, V3d(0.3, -1, 0.2) + drift);
  return shot;
}

class SeamOfObstacles : public testing::TestWithParam<Body> {};
std::string name_of(const testing::TestParamInfo<Body>& p) {
  const std::array<const char*, 5> names{"Plane", "Ball", "Block", "Bar", "Moving"};
  return names[size_t(p.param)];
}
INSTANTIATE_TEST_SUITE_P(Body, SeamOfObstacles,
                         testing::Values(Body::plane, Body::ball, Body::block, Body::bar,
                                         Body::moving),
                         name_of);

// Moved so that both seams run through the body, and once more by a period and more.
TEST_P(SeamOfObstacles, IsNowhere) {
  const V3d period = period_of(slab({15, 40, 12}));
  for (const V3d& shift : {V3d(0.08, 0, 0.06), V3d(-0.22, 0, 0.18)}) {
    Stepper here(splash(GetParam(), V3d(0))), there(splash(GetParam(), shift));
    V3d given(0), other(0);
    for (int k = 0; k < 60; ++k) {
      here.step(5e-4), there.step(5e-4);
      given += impulse_of(here, 0), other += impulse_of(there, 0);
    }
    ASSERT_GT(-given.y, 0.05 * 0.18);  // of the momentum it fell with: they did meet
    const double apart = difference(here.solver->save(), there.solver->save(), shift, period);
    RecordProperty("apart", fmt::format("{:.2g}", apart));
    EXPECT_LT(apart, 2e-5);
    EXPECT_LT((given - other).length(), 1e-3 * given.length());
  }
}

// The same as all of it flies through the seams, several times.
TEST_P(SeamOfObstacles, IsNowhereInFlight) {
  const V3d drift(11, 0, -9), period = period_of(slab({15, 40, 12}));
  const auto scene_of = [](const V3d& drift) {
    sim::Scene scene = sim::build_scene(splash(GetParam(), V3d(0), drift));
    scene.parameters.sound_speed = 15;  // the automatic one counts the drift
    return scene;
  };
  Stepper still(scene_of(V3d(0))), flying(scene_of(drift));
  constexpr int steps = 60;
  constexpr double dt = 5e-4;
  for (int k = 0; k < steps; ++k) still.step(dt), flying.step(dt);
  ASSERT_GT(drift.x * steps * dt, 2 * period.x);
  const double apart =
      difference(still.solver->save(), flying.solver->save(), drift * (steps * dt), period);
  RecordProperty("apart", fmt::format("{:.2g}", apart));
  EXPECT_LT(apart, 1e-4);
}

// Nothing but the body pushes: what the fluid gains it loses, one impulse for all of its images.
TEST_P(SeamOfObstacles, MomentumOfFluidAndObstaclesIsKept) {
  Shot shot = splash(GetParam(), V3d(0.08, 0, 0.06));
  // Drag on all images is the obstacle's, too.
  shot.fluid.kinematic_viscosity = 1e-3, shot.obstacle[0].slip = Slip::none;
  Stepper run(shot);
  const V3d start = total_momentum(run.scene, run.solver->save());
  V3d given(0);
  for (int k = 0; k < 150; ++k) {
    run.step(5e-4);
    ASSERT_EQ(run.solver->obstacle_impulses().size(), 1u);
    given += impulse_of(run, 0);
  }
  const sim::HostState state = run.solver->save();
  EXPECT_GT(given.length(), 0.1 * start.length());  // they did meet
  EXPECT_LT((total_momentum(run.scene, state) + given - start).length(),
            1e-5 * momentum_scale(run.scene, state, 1));
}

// --- What reaches around has no ends and is there once
// --------------------------------------------

sim::HostState after_splash_on_bar(double length) {
  Shot shot = splash(Body::bar, V3d(0.08, 0, 0.06));
  shot.obstacle[0].size.z = length;
  Stepper run(shot);
  for (int k = 0; k < 60; ++k) run.step(5e-4);
  return run.solver->save();
}
TEST(EndlessBox, IsTheSameToTheBitWhateverItsLength) {
  const sim::HostState just = after_splash_on_bar(0.12), more = after_splash_on_bar(0.2),
                       many = after_splash_on_bar(1.3);
  for (const sim::HostState* other : {&more, &many}) {
    EXPECT_EQ(just.position.x, other->position.x);
    EXPECT_EQ(just.position.y, other->position.y);
    EXPECT_EQ(just.velocity.z, other->velocity.z);
  }
}

// One that goes around both axes is a plane, whose density has a closed form.
TEST(EndlessBox, AroundTwoAxesIsAPlane) {
  const auto pool = [](ObstacleType type) {
    Shot shot = slab({8, 24, 9});
    shot.gravity = V3d(0, -g, 0);
    Obstacle& floor =
        add_obstacle(shot, type, V3d(0.013, type == ObstacleType::box ? 0 : 0.03, 0.03));
    floor.size = V3d(0.09, 0.06, 0.08), floor.normal = V3d(0, 1, 0);
    floor.rotation_deg = type == ObstacleType::box ? V3d(0, 90, 0) : V3d(0);
    add_box(shot, V3d(0, 0.03, 0), {8, 8, 9});
    return shot;
  };
  Stepper box(pool(ObstacleType::box)), plane(pool(ObstacleType::plane));
  ASSERT_EQ(box.solver->particles(), 8 * 8 * 9);
  box.solver->refresh(), plane.solver->refresh();
  const std::vector<float> rho = box.solver->density(), other = plane.solver->density();
  for (size_t i = 0; i < rho.size(); ++i) EXPECT_NEAR(rho[i], other[i], 2e-3) << i;
  for (int k = 0; k < 40; ++k) box.step(2e-3), plane.step(2e-3);
  EXPECT_LT((centre_of_mass(box.solver->save()) - centre_of_mass(plane.solver->save())).length(),
            1e-3 * a);
}

// Two images of a ball that come within a spacing of each other, with water between them, against
// two balls in a domain twice as long.
TEST(Images, AreToEachOtherAsTwoObstaclesAre) {
  const auto row = [](int balls) {
    Shot shot = slab({10 * balls, 30, 10});
    shot.gravity = V3d(0, -g, 0);
    add_plane(shot, V3d(0), V3d(0, 1, 0));
    for (int k = 0; k < balls; ++k) add_sphere(shot, V3d(0.1 * k + 0.02, 0.06, 0.05), 0.045);
    add_box(shot, V3d(0), {10 * balls, 12, 10});
    shot.fluid.tolerance = 1e-6;
    return shot;
  };
  Stepper one(row(1)), two(row(2));
  ASSERT_EQ(2 * one.solver->particles(), two.solver->particles());
  one.solver->refresh(), two.solver->refresh();
  const sim::HostState p = one.solver->save(), q = two.solver->save();
  const std::vector<float> rho = one.solver->density(), other = two.solver->density();
  const V3d period(0.1, 0, 0.1);
  for (size_t i = 0; i < rho.size(); ++i) {
    size_t found = 0;
    for (size_t j = 0; j < other.size(); ++j) {
      if (nearest_image(at(p.position, i) - at(q.position, j), period).length() > 1e-5) continue;
      ++found;
      EXPECT_NEAR(rho[i], other[j], 2e-2);
    }
    EXPECT_EQ(found, 2u);
  }
  one.advance(0.4), two.advance(0.4);
  V3d single(0), pair(0);
  for (int k = 0; k < 100; ++k) {
    one.step(1e-3), two.step(1e-3);
    single += impulse_of(one, 1), pair += impulse_of(two, 1) + impulse_of(two, 2);
  }
  const double weight = 1000 * g * 4 * M_PI / 3 * std::pow(0.045, 3) * 0.1;
  EXPECT_NEAR(single.y, weight, 0.08 * weight);
  EXPECT_NEAR(pair.y, 2 * single.y, 0.04 * weight);
}

// Lift of a square bar that goes around z, per length: rho g times its section.
class BarLift : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(EdgeInSpacings, BarLift, testing::Values(6, 9, 12),
                         [](const auto& p) { return std::to_string(p.param); });
TEST_P(BarLift, IsTheDisplacedWeight) {
  Obstacle bar;
  bar.type = ObstacleType::box, bar.size = V3d(0.06);  // as long as the period or longer
  bar.rotation_deg = V3d(0, 0, 20);
  const BarForce lift = lift_of_bar(bar, 0.06 * 0.06, GetParam());
  RecordProperty("error", std::to_string(lift.error));
  EXPECT_LT(std::abs(lift.error), 0.05) << lift.error;
  EXPECT_LT(std::abs(lift.sideways), 0.05);
  EXPECT_LT(std::abs(lift.along), 0.005);
}

// --- Leaks --------------------------------------------------------------------------------------

/// A wall of `thickness` spacings across x and y that moves along the periodic z axis, 40 spacings
/// long, through water that fills `layers` of it. How far the particle that got the farthest past
/// it did, m: every one is between the wall and its next image, counted along its own unwrapped
/// way.
struct Pushed {
  double past = -1e30;
  V3d mean{0};  // m, how far they came
};
Pushed push_around(double thickness, double speed, double rounds, int layers, double dt) {
  Shot shot = slab({6, 6, 40});
  shot.domain.axis[1] = Axis::periodic;
  Obstacle& wall = add_obstacle(shot, ObstacleType::box, V3d(0));
  wall.size = V3d(0.06, 0.08, thickness * a);
  move(wall, shot, V3d(0.03, 0.03, 0), V3d(0, 0, speed));
  add_box(shot, V3d(0, 0, 2 * a), {6, 6, layers});
  Stepper run(shot);
  std::vector<V3d> way;
  sim::HostState before = run.solver->save();
  for (const int i : place_of_id(before)) way.push_back(at(before.position, size_t(i)));
  const std::vector<V3d> start = way;
  const V3d period = period_of(shot);
  Pushed result;
  while (run.time < rounds * period.z / speed) {
    dt > 0 ? run.step(dt) : run.step();
    sim::HostState now = run.solver->save();
    const std::vector<int> from = place_of_id(before), to = place_of_id(now);
    for (size_t i = 0; i < way.size(); ++i) {
      way[i] += nearest_image(
          at(now.position, size_t(to[i])) - at(before.position, size_t(from[i])), period);
      const double behind = speed * run.time - way[i].z;
      result.past = std::max({result.past, behind, -behind - period.z});
    }
    before = std::move(now);
  }
  for (size_t i = 0; i < way.size(); ++i) result.mean += (way[i] - start[i]) / double(way.size());
  return result;
}

TEST(PeriodicLeaks, AWallPushesWaterAroundAndAround) {
  const Pushed pushed = push_around(2, 1, 3, 20, 0);
  EXPECT_LT(pushed.past, -0.5 * a);            // none comes nearer to its middle
  EXPECT_GT(pushed.mean.z, 3 * 0.4 - 10 * a);  // and all are taken along
}
TEST(PeriodicLeaks, NoneThroughAThinWallAtAHundredMetresASecond) {
  EXPECT_LT(push_around(0.5, 100, 3, 10, 0).past, 0);
  EXPECT_LT(push_around(0.05, 100, 3, 10, 0).past, 0);
  EXPECT_LT(push_around(0.5, 100, 2, 4, 5e-5).past, 0);  // half a spacing a step
}

/// Particles in a body or an image of it, in double and outside the solver.
int inside_images(const Shot& shot, Stepper& run) {
  const sim::HostState state = run.solver->save();
  const V3d period = period_of(shot);
  const double frame = shot.timeline.first + run.time * shot.timeline.fps;
  int inside = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    V3d x;
    for (int k = 0; k < 3; ++k) x[k] = run.scene.frame.to_world(k, at(state.position, i)[k]);
    for (const Obstacle& o : shot.obstacle) {
      const V3d centre = o.position.at(frame);
      double least = 1e30;
      for (int n = 0; n < 9; ++n) {
        const V3d image =
            centre + nearest_image(x - centre, period) + V3d(n % 3 - 1, 0, n / 3 - 1) * period;
        least = std::min(least, exact_distance(o, frame, image));
      }
      inside += least < 0;
    }
  }
  return inside;
}

// A block that turns as it goes around along the diagonal, in a pool.
Shot stirred() {
  Shot shot = slab({20, 60, 16});
  shot.gravity = V3d(0, -g, 0);
  add_plane(shot, V3d(0), V3d(0, 1, 0));
  Obstacle& block = add_obstacle(shot, ObstacleType::box, V3d(0));
  block.size = V3d(0.07, 0.05, 0.03);
  move(block, shot, V3d(0.02, 0.05, 0.01), V3d(1.1, 0, 0.7));
  block.rotation_deg.keys = {{1001, V3d(0)}, {1121, V3d(400, 3600, 0)}};
  add_box(shot, V3d(0), {20, 8, 16});
  return shot;
}
TEST(PeriodicLeaks, NoneIntoABlockThatTurnsAndGoesAround) {
  const Shot shot = stirred();
  Stepper run(shot);
  int inside = 0;
  for (int k = 0; run.time < 0.6; ++k) {  // 3.3 times around
    run.step();
    if (k % 5 == 0) inside += inside_images(shot, run);
  }
  EXPECT_EQ(inside, 0);
  EXPECT_EQ(run.solver->particles(), int(run.scene.start.id.size()));
}

// --- Sheets -------------------------------------------------------------------------------------

/// A sheet that spans x falls with water on it over a ball and a bar, all moved by `shift`.
Shot drape(const V3d& shift, const V3d& drift = V3d(0)) {
  Shot shot = slab({16, 40, 20});
  shot.fluid.tolerance = 1e-6;
  shot.gravity = V3d(0, -g, 0);
  Obstacle& ball = add_obstacle(shot, ObstacleType::sphere, V3d(0));
  ball.radius = 0.04, ball.friction = 0.4;
  move(ball, shot, V3d(0.05, 0.05, 0.1) + shift, drift);
  Obstacle& bar = add_obstacle(shot, ObstacleType::box, V3d(0));
  bar.size = V3d(0.16, 0.05, 0.03), bar.friction = 0.2;
  move(bar, shot, V3d(0, 0.058, 0.045) + shift, drift);
  Cloth& sheet = shot.cloth.emplace_back();
  sheet.corner = V3d(0.005, 0.095, 0.035) + shift;
  sheet.u = V3d(0.16, 0, 0), sheet.v = V3d(0, 0, 0.12), sheet.cells = V2i(16, 12);
  sheet.velocity = drift, sheet.damping = 0;
  add_box(shot, V3d(0.02, 0.105, 0.06) + shift, {6, 2, 6}, drift);
  return shot;
}

TEST(SheetsOnPeriodicObstacles, LieAlikeWhereverTheSeamIs) {
  const V3d shift(0.11, 0, 0.09), period = period_of(drape(shift));
  Stepper here(drape(V3d(0))), there(drape(shift));
  V3d given(0), other(0);
  for (int k = 0; k < 100; ++k) {
    here.step(5e-4), there.step(5e-4);
    given += impulse_of(here, 0), other += impulse_of(there, 0);
  }
  ASSERT_GT(-given.y, 1e-3);
  EXPECT_LT(difference(here.solver->save(), there.solver->save(), shift, period), 2e-5);
  EXPECT_LT((given - other).length(), 1e-3 * given.length());
}

// In flight sheets leave the domain, which no vertex is ever wrapped into; particles do not.
TEST(SheetsOnPeriodicObstacles, LieAlikeInFlight) {
  const V3d drift(7, 0, 5), period = period_of(drape(V3d(0)));
  const auto scene_of = [](const V3d& drift) {
    sim::Scene scene = sim::build_scene(drape(V3d(0), drift));
    scene.parameters.sound_speed = 15;
    return scene;
  };
  Stepper still(scene_of(V3d(0))), flying(scene_of(drift));
  for (int k = 0; k < 100; ++k) still.step(5e-4), flying.step(5e-4);
  ASSERT_GT(drift.z * 0.05, period.z);
  EXPECT_LT(difference(still.solver->save(), flying.solver->save(), drift * 0.05, period), 2e-5);
}

// A sheet alone at rest over a bar across the seam: its weight, and no vertex inside an image.
TEST(SheetsOnPeriodicObstacles, WeighOnTheBarAcrossTheSeam) {
  Shot shot = slab({16, 40, 20});
  shot.gravity = V3d(0, -g, 0);
  Obstacle& bar = add_obstacle(shot, ObstacleType::box, V3d(0.3, 0.05, 0.2));
  bar.size = V3d(0.16, 0.05, 0.06), bar.friction = 0.5;
  Cloth& sheet = shot.cloth.emplace_back();
  sheet.corner = V3d(0.005, 0.08, -0.06), sheet.damping = 3;
  sheet.u = V3d(0.16, 0, 0), sheet.v = V3d(0, 0, 0.12), sheet.cells = V2i(16, 12);
  Stepper run(shot);
  run.advance(0.8);
  V3d force(0);
  for (int k = 0; k < 200; ++k) run.step(1e-3), force += impulse_of(run, 0) / 0.2;
  double weight = 0;
  for (const float m : run.scene.cloth.mass) weight += m * g;
  EXPECT_NEAR(force.y, -weight, 0.01 * weight);
  EXPECT_LT(std::hypot(force.x, force.z), 0.01 * weight);
  const sim::HostState state = run.solver->save();
  for (size_t v = 0; v < state.cloth_position.size(); ++v) {
    V3d x;
    for (int k = 0; k < 3; ++k) x[k] = run.scene.frame.to_world(k, at(state.cloth_position, v)[k]);
    const V3d centre(x.x, 0.05, 0.2);
    EXPECT_GT(exact_distance(bar, 1001,
                             V3d(0.3, x.y, 0.2 + nearest_image(x - centre, period_of(shot)).z)),
              0)
        << v;
  }
}

// --- Determinism and skips ----------------------------------------------------------------------

TEST(PeriodicObstacles, HaveTheSameBitsForAnyNumberOfThreadsAndGoOn) {
  for (const Shot& shot : {stirred(), drape(V3d(0.11, 0, 0.09))}) {
    expect_same_bits_on_threads(shot, 60, 1e-3);
    expect_same_bits_when_resumed(shot, 60, 1e-3);
  }
}

TEST(ObstacleImages, AreTheObstacleItselfWithoutPeriodicAxesAndOneWhereNoSeamIsNear) {
  Shot shot = slab({60, 40, 60});
  add_sphere(shot, V3d(0.3, 0.1, 0.3), 0.05);
  const auto count = [](const Shot& shot, V3d at) {
    const sim::Scene scene = sim::build_scene(shot);
    sim::ObstaclePlacement p;
    p.shape = sim::ObstacleShape::sphere;
    for (int k = 0; k < 3; ++k) {
      p.centre[0][k] = p.centre[1][k] = float(at[k]);
      p.low[k] = p.centre[0][k] - 0.05f, p.high[k] = p.centre[0][k] + 0.05f;
    }
    return sim::ObstacleImages(scene.parameters).of(p, V3d(0.1)).size();
  };
  add_box(shot, V3d(0.3, 0.2, 0.3), {4, 4, 4});
  const sim::Scene scene = sim::build_scene(shot);
  const V3d origin(scene.frame.origin[0], scene.frame.origin[1], scene.frame.origin[2]);
  EXPECT_EQ(count(shot, V3d(0.3, 0.1, 0.3) - origin), 1u);
  EXPECT_EQ(count(shot, V3d(0, 0.1, 0.3) - origin), 2u);
  EXPECT_EQ(count(shot, V3d(0.6, 0.1, 1.2) - origin), 4u);
  shot.domain.axis = {Axis::open, Axis::open, Axis::open};
  EXPECT_EQ(count(shot, V3d(0.6, 0.1, 1.2) - origin), 1u);
}

// Periodic axes bring obstacles no pass and no column, and out of reach change nothing but
// rounding; obstacles out of reach change no bit.
TEST(PeriodicObstacles, CostNothingWhereTheyAreNot) {
  const auto shot_of = [](Axis sides, bool far) {
    Shot shot = empty_shot();
    shot.fluid.solver = FluidSolver::incompressible;
    shot.gravity = V3d(0, -g, 0);
    shot.fluid.tolerance = 1e-6;  // coarse levels stand at other places: solves agree when done
    shot.domain.axis = {sides, Axis::walls, sides};
    add_sphere(shot, V3d(0, -0.06, 0), 0.05);
    if (far) add_sphere(shot, V3d(0.9, 0, 0.95), 0.2);
    add_box(shot, V3d(-0.03, 0, -0.03), {6, 4, 6});
    return shot;
  };
  Stepper open(shot_of(Axis::open, false)), periodic(shot_of(Axis::periodic, false)),
      with(shot_of(Axis::periodic, true));
  for (Stepper* run : {&periodic, &with}) {
    ASSERT_EQ(open.solver->plan().size(), run->solver->plan().size());
    for (size_t k = 0; k < open.solver->plan().size(); ++k)
      EXPECT_EQ(open.solver->plan()[k].name, run->solver->plan()[k].name);
    EXPECT_EQ(open.solver->allocated(), run->solver->allocated());
  }
  for (int k = 0; k < 60; ++k) open.step(1e-3), periodic.step(1e-3), with.step(1e-3);
  EXPECT_LT(difference(open.solver->save(), periodic.solver->save(), V3d(0), V3d(2, 0, 2)), 2e-5);
  expect_same_state(periodic.solver->save(), with.solver->save());
}

}  // namespace
}  // namespace drench::sim_tests
