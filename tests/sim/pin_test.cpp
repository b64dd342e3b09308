// Pins that move, let go, are soft or ride on obstacles, against closed forms of what they do.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/files/files.h"
#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/said.h"
#include "tests/sim/same_state.h"
#include "tests/sim/sheet_crossings.h"
#include "tests/temporary_folder.h"

namespace drench::sim_tests {
namespace {

constexpr double gravity = 9.81;

Shot bare_shot() {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -gravity, 0);
  return shot;
}

/// A sheet without losses, stiff in its plane.
Cloth& add_cloth(Shot& shot, V3d corner, V3d u, V3d v, V2i cells,
                 ClothModel model = ClothModel::shell) {
  Cloth& c = shot.cloth.emplace_back();
  c.name = "sheet" + std::to_string(shot.cloth.size());
  c.model = model, c.corner = corner, c.u = u, c.v = v, c.cells = cells;
  c.young_warp = c.young_weft = 1e5, c.shear_modulus = 5e4, c.poisson = 0;
  c.bend_warp = c.bend_weft = c.bend_bias = 1e-6;
  c.adjacent_stiffness = 1e5, c.diagonal_stiffness = 5e4;
  c.damping = 0, c.damping_time = 0, c.spring_damping = 0, c.stretch_limit = 100;
  return c;
}

/// All vertices in a box of `half` m about `middle`.
ClothPin& add_pin(Cloth& cloth, V3d middle, V3d half) {
  ClothPin& pin = cloth.pin.emplace_back();
  pin.box = {middle - half, middle + half};
  return pin;
}
ClothPin& pin_all(Cloth& cloth) { return add_pin(cloth, V3d(0), V3d(100)); }

/// Frame of a time since the first, s.
double frame_at(const Shot& shot, double time) {
  return shot.timeline.first + time * shot.timeline.fps;
}

/// Linear keys at constant velocity from the start on.
Animated<V3d> at_velocity(const Shot& shot, V3d velocity, double seconds = 100) {
  Animated<V3d> track;
  track.keys = {{frame_at(shot, 0), V3d(0)}, {frame_at(shot, seconds), velocity * seconds}};
  return track;
}

/// Places with what single precision rounded off, m local.
std::vector<V3d> places(Stepper& run) {
  const sim::HostState state = run.solver->save();
  std::vector<V3d> x;
  for (size_t v = 0; v < state.cloth_position.size(); ++v) {
    x.push_back(at(state.cloth_position, v));
    if (state.shell_rounding.size() > 0) x.back() += at(state.shell_rounding, v);
  }
  return x;
}

double worst(const std::vector<V3d>& a, const std::vector<V3d>& b) {
  double most = 0;
  for (size_t k = 0; k < a.size(); ++k) most = std::max(most, (a[k] - b[k]).length());
  return most;
}

// --- Keys ---------------------------------------------------------------------------------------

/// A strip that hangs from its upper edge and swings out of its plane.
Shot hanging(ClothModel model, V3d velocity) {
  Shot shot = bare_shot();
  Cloth& c = add_cloth(shot, V3d(0, 0.8, 0), V3d(0.1, 0, 0), V3d(0.15, -0.3, 0.1), {4, 12}, model);
  c.velocity = velocity;
  c.damping_time = 0.005, c.spring_damping = 0.1;
  c.bend_warp = c.bend_weft = c.bend_bias = 1e-3;
  ClothPin& pin = add_pin(c, V3d(0.05, 0.8, 0), V3d(0.06, 1e-3, 1e-3));
  if (velocity != V3d(0)) pin.position = at_velocity(shot, velocity);
  return shot;
}

// Galilei: what is carried along at constant velocity does what it does at rest, to rounding, 5e-8
// m in the first step and more as a limp strip swings: springs do not carry what they round off. At
// rest a shell's pins are in no list of those that move.
TEST(Pin, CarriesAtConstantVelocityWhatItHoldsAtRest) {
  const V3d velocity(0.7, 0.3, -0.2);
  for (const ClothModel model : {ClothModel::shell, ClothModel::springs}) {
    Shot rest = hanging(model, V3d(0));
    if (model == ClothModel::springs) rest.cloth[0].pin[0].release = 1e6;  // an implicit step, too
    Stepper still(rest), moving(hanging(model, velocity));
    for (int k = 0; k < 50; ++k) still.step(2e-3), moving.step(2e-3);
    std::vector<V3d> x = places(moving);
    for (V3d& p : x) p -= velocity * moving.time;
    EXPECT_LT(worst(x, places(still)), model == ClothModel::shell ? 3e-6 : 1e-4) << int(model);
  }
}

// A chain whose upper end is shaken by A sin(omega t) hangs as A sin(omega t) J0(2 omega sqrt(s /
// g)) / J0(2 omega sqrt(L / g)), s from the lower end (Bernoulli's chain). At half of its first
// resonance it starts in that motion.
TEST(Pin, ShakesAHangingStripAsBernoullisChain) {
  const double length = 0.4, amplitude = 2e-3, omega = 0.6 * std::sqrt(gravity / length);
  Shot shot = bare_shot();
  const int cells = 40;
  Cloth& c = add_cloth(shot, V3d(0, 0.8, 0), V3d(0.02, 0, 0), V3d(0, -length, 0), {2, cells});
  ClothPin& pin = add_pin(c, V3d(0, 0.8, 0), V3d(1, 1e-6, 1));
  pin.position.keys.clear();
  for (int k = 0; k <= 400; ++k) {
    const double t = k * 0.01;
    pin.position.keys.push_back({frame_at(shot, t), V3d(0, 0, amplitude * std::sin(omega * t))});
  }
  const auto shape = [&](double s) {
    return std::cyl_bessel_j(0, 2 * omega * std::sqrt(s / gravity)) /
           std::cyl_bessel_j(0, 2 * omega * std::sqrt(length / gravity));
  };
  Stepper run(shot);
  sim::HostState state = run.scene.start;
  for (size_t v = 0; v < state.cloth_position.size(); ++v) {
    const double s = length - double(v / 3) * length / cells;
    if (v >= 3) state.cloth_velocity.z[v] = float(amplitude * omega * shape(s));
  }
  run.load(state, {}, 0);
  const double z0 = places(run).back().z;
  double error = 0;
  while (run.time < 2 * M_PI / omega) {
    run.step(2e-3);
    for (const int row : {10, 20, 30, 40}) {
      const double s = length - row * length / cells;
      const double z = places(run)[size_t(3 * row + 1)].z - z0;
      error = std::max(error, std::abs(z / amplitude - shape(s) * std::sin(omega * run.time)));
    }
  }
  EXPECT_GT(shape(0), 1.4);
  EXPECT_LT(error, 5e-4);  // keys 10 ms apart are 1e-4 off a sine
}

// By the rotation about the pivot, to rounding, with the velocity omega x r.
TEST(Pin, TurnsAGroupAsARigidBody) {
  Shot shot = bare_shot();
  Cloth& c = add_cloth(shot, V3d(0.1, 0.5, 0.2), V3d(0.3, 0, 0), V3d(0, 0, 0.4), {6, 8});
  ClothPin& pin = add_pin(c, V3d(0.1, 0.5, 0.4), V3d(0.11, 1e-3, 1));
  pin.pivot = V3d(0.1, 0.4, 0.3);
  const double rate = 90 / 0.25;  // deg/s
  pin.rotation_deg.keys = {{frame_at(shot, 0), V3d(0)}, {frame_at(shot, 1), V3d(0, rate, 0)}};
  Stepper run(shot);
  const sim::ClothPins::Group& group = run.scene.pins.groups().at(0);
  const std::vector<V3d> start = places(run);
  const V3d origin(run.scene.frame.origin[0], run.scene.frame.origin[1], run.scene.frame.origin[2]);
  while (run.time < 0.25) run.step_towards(0.25, 1e-3);
  const sim::HostState state = run.solver->save();
  const double omega = rate * M_PI / 180;
  for (const int v : group.vertex) {
    const V3d r = start[size_t(v)] + origin - *pin.pivot;
    const V3d turned(r.z, r.y, -r.x);  // by 90 degrees about y
    EXPECT_LT((at(state.cloth_position, size_t(v)) + origin - *pin.pivot - turned).length(), 1e-7);
    const V3d velocity = V3d(0, omega, 0).cross(turned);
    EXPECT_LT((at(state.cloth_velocity, size_t(v)) - velocity).length(), 1e-4 * omega);
  }
}

// Only what keys change by since the start counts: the group starts where the sheet has it.
TEST(Pin, CountsKeysFromWhatTheyAreAtTheStart) {
  Shot shot = bare_shot();
  Cloth& c = add_cloth(shot, V3d(0, 0.5, 0), V3d(0.1, 0, 0), V3d(0, 0, 0.1), {2, 2});
  ClothPin& pin = pin_all(c);
  pin.position.keys = {{frame_at(shot, -1), V3d(2, 0, 0)}, {frame_at(shot, 1), V3d(4, 0, 0)}};
  Stepper run(shot);
  const std::vector<V3d> start = places(run);
  EXPECT_NEAR(run.limits.max_speed, 1, 1e-6);
  while (run.time < 0.5) run.step_towards(0.5, 1e-2);
  for (size_t v = 0; v < start.size(); ++v)
    EXPECT_LT((places(run)[v] - start[v] - V3d(0.5, 0, 0)).length(), 1e-7);
}

TEST(Pin, LimitsStepsByItsSpeed) {
  Shot shot = bare_shot();
  Cloth& c = add_cloth(shot, V3d(0, 0.5, 0), V3d(0.1, 0, 0), V3d(0, 0, 0.1), {2, 2});
  ClothPin& pin = pin_all(c);
  // at rest for a frame, then 20 m/s
  pin.position.keys = {{1002, V3d(0)}, {1003, V3d(20 / shot.timeline.fps, 0, 0)}};
  Stepper run(shot);
  const double frame = 1 / shot.timeline.fps, most = 0.4 * shot.fluid.spacing;
  run.step_towards(frame, 1e-3);
  V3d before = places(run)[0];
  while (run.time < 2 * frame) {
    run.step_towards(2 * frame, run.next_dt());
    EXPECT_LT((places(run)[0] - before).length(), 1.001 * most);
    before = places(run)[0];
  }
}

// --- Letting go, soft pins ----------------------------------------------------------------------

// Thrown upwards at 1.5 m/s. As in ShellMotion, the first free step falls by g dt^2. A velocity's
// rounding, 1e-7 m/s, counts a hundred times.
TEST(Pin, LetsGoOfAParabola) {
  Shot shot = bare_shot();
  const V3d velocity(0.4, 1.5, 0);
  Cloth& c = add_cloth(shot, V3d(0, 0, 0), V3d(0.2, 0, 0), V3d(0, 0, 0.2), {6, 6});
  c.velocity = velocity;
  ClothPin& pin = pin_all(c);
  pin.position = at_velocity(shot, velocity), pin.release = 0.1037;
  Stepper run(shot);
  const std::vector<V3d> start = places(run);
  const double dt = 2e-3;
  while (run.time < pin.release) run.step_towards(1, dt);
  EXPECT_EQ(run.time, pin.release);
  for (int k = 0; k < 100; ++k) run.step(dt);
  const double free = run.time - pin.release;
  for (size_t v = 0; v < start.size(); ++v) {
    const V3d fallen(0, -gravity / 2 * (free * free + free * dt), 0);
    const V3d first(0, gravity / 2 * (free * dt - dt * dt), 0);
    EXPECT_LT((places(run)[v] - start[v] - velocity * run.time - fallen - first).length(), 1e-5);
  }
}

// A stiff sheet of mass M on n springs hangs by M g / (n k) and swings about that in 2 pi sqrt(M /
// (n k)).
TEST(Pin, OfAStiffnessIsASpring) {
  Shot shot = bare_shot();
  Cloth& c = add_cloth(shot, V3d(0, 0.5, 0), V3d(0.1, 0, 0), V3d(0, 0, 0.1), {4, 4});
  c.bend_warp = c.bend_weft = c.bend_bias = 10;
  ClothPin& pin = pin_all(c);
  const double mass = 0.2 * 0.01, period = 0.2, all = mass * std::pow(2 * M_PI / period, 2);
  pin.stiffness = all / 25;
  Stepper run(shot);
  const sim::HostState& start = run.scene.start;
  double before = 0, time = 0, lowest = 0;
  std::vector<double> turns;  // times of the middle
  const double middle = -mass * gravity / all;
  while (turns.size() < 9) {
    run.step(1e-3);
    double height = 0;
    for (size_t v = 0; v < 25; ++v)
      height += double(run.scene.cloth.mass[v]) * (places(run)[v].y - start.cloth_position.y[v]);
    height /= mass;
    lowest = std::min(lowest, height);
    const double now = height - middle;
    if (time > 0 && before * now < 0)
      turns.push_back(time + (run.time - time) * before / (before - now));
    before = now, time = run.time;
  }
  EXPECT_NEAR((turns[8] - turns[0]) / 4, period, 0.005 * period);
  // The middle is passed in equal times: it is that of the swing.
  EXPECT_NEAR((turns[1] - turns[0]) / (turns[2] - turns[1]), 1, 0.02);
  EXPECT_NEAR(lowest, 2 * middle, 0.02 * -middle);
}

// --- On obstacles -------------------------------------------------------------------------------

TEST(Pin, OnAnObstacleStaysWhereItIsInTheObstaclesFrame) {
  Shot shot = bare_shot();
  Obstacle& box = add_obstacle(shot, ObstacleType::box, V3d(0.1, 0.2, 0));
  box.name = "handle", box.size = V3d(0.2, 0.1, 0.1);
  box.position.keys = {{1001, V3d(0.1, 0.2, 0)}, {1013, V3d(-0.3, 0.5, 0.2)}};
  box.rotation_deg.keys = {{1001, V3d(0, 10, 0)}, {1013, V3d(40, 200, -30)}};
  Cloth& c = add_cloth(shot, V3d(0, 0.27, -0.1), V3d(0.2, 0, 0), V3d(0, 0, 0.3), {8, 12});
  add_pin(c, V3d(0, 0.27, -0.1), V3d(1, 1e-3, 0.03)).on = "handle";
  Stepper run(shot);
  const sim::ClothPins::Group group = run.scene.pins.groups().at(0);
  const V3d origin(run.scene.frame.origin[0], run.scene.frame.origin[1], run.scene.frame.origin[2]);
  const Pose first = obstacle_pose(box, 1001);
  const std::vector<V3d> start = places(run);
  while (run.time < 0.5) {
    run.step_towards(0.5, run.next_dt());
    const Pose now = obstacle_pose(box, frame_at(shot, run.time));
    const std::vector<V3d> x = places(run);
    for (const int v : group.vertex) {
      const V3d own = now.to_own(x[size_t(v)] + origin);
      ASSERT_LT((own - first.to_own(start[size_t(v)] + origin)).length(), 1e-7) << run.time;
    }
  }
}

/// Nothing near: what deforms is looked at by its mesh alone.
LevelSet nothing(const TriangleMesh&, double voxel, double band, const LevelSetBounds&) {
  LevelSet set;
  set.voxel = float(voxel), set.band = float(band);
  set.blocks[0] = set.blocks[1] = set.blocks[2] = 1;
  set.block = {LevelSet::outside};
  return set;
}

/// A cube of half edge `half` m.
std::string cube(double half) {
  std::string text;
  for (int k = 0; k < 8; ++k)
    text += "v " + std::to_string(k & 1 ? half : -half) + " " +
            std::to_string(k & 2 ? half : -half) + " " + std::to_string(k & 4 ? half : -half) +
            "\n";
  return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

// A cube that grows from half an edge of 0.1 m by 0.02 m a frame: what rides 0.01 m over its top
// keeps that distance and its share of the way to the rim.
TEST(Pin, OnAMeshThatGrowsKeepsItsPlaceOnTheNearestTriangle) {
  const test::TemporaryFolder folder;
  for (int f = 0; f < 4; ++f)
    write_file_whole(folder / ("cube." + std::to_string(f) + ".obj"), cube(0.1 + 0.02 * f));
  Shot shot = bare_shot();
  shot.timeline = {0, 3, 24};
  Obstacle& body = add_obstacle(shot, ObstacleType::mesh, V3d(0));
  body.name = "body", body.mesh_file = folder / "cube.%d.obj";
  Cloth& c = add_cloth(shot, V3d(-0.06, 0.11, -0.05), V3d(0.1, 0, 0), V3d(0, 0, 0.1), {2, 2});
  pin_all(c).on = "body";
  Stepper run(shot, nothing);
  const std::vector<V3d> start = places(run);
  const V3d origin(run.scene.frame.origin[0], run.scene.frame.origin[1], run.scene.frame.origin[2]);
  const double end = 3 / shot.timeline.fps;
  while (run.time < end) run.step_towards(end, run.next_dt());
  const double grown = 1.6;
  const std::vector<V3d> x = places(run);
  const sim::HostState state = run.solver->save();
  for (size_t v = 0; v < x.size(); ++v) {
    const V3d from = start[v] + origin, to = x[v] + origin;
    EXPECT_LT((to - V3d(from.x * grown, 0.16 + 0.01, from.z * grown)).length(), 1e-6) << v;
    const V3d velocity = V3d(from.x, 0.1, from.z) * 0.2 * shot.timeline.fps;
    EXPECT_LT((at(state.cloth_velocity, v) - velocity).length(), 1e-3) << v;
  }
}

// --- Fluid, bits, checks ------------------------------------------------------------------------

/// A splash on a sheet whose one edge is turned and shaken, one follows a ball and one corner is
/// soft and let go.
Shot busy_shot(double shift = 0, ClothModel model = ClothModel::shell) {
  Shot shot = bare_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  shot.domain.min = V3d(shift - 0.3, -0.2, -0.3), shot.domain.max = V3d(shift + 0.3, 0.6, 0.3);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(shift - 0.08, 0.03, -0.08), {16, 8, 16}, V3d(0, -1, 0));
  Cloth& c =
      add_cloth(shot, V3d(shift - 0.15, 0, -0.15), V3d(0.3, 0, 0), V3d(0, 0, 0.3), {16, 16}, model);
  c.young_warp = c.young_weft = 2000, c.shear_modulus = 500;
  c.adjacent_stiffness = 1000, c.diagonal_stiffness = 500;
  c.spring_damping = 0.1, c.damping_time = 0.005;
  ClothPin& edge = add_pin(c, V3d(shift - 0.15, 0, 0), V3d(1e-3, 1, 1));
  edge.position.keys = {{1001, V3d(0)}, {1003, V3d(0.03, 0.02, 0)}, {1005, V3d(0)}};
  edge.rotation_deg.keys = {{1001, V3d(0)}, {1005, V3d(20, 0, 0)}};
  Obstacle& ball = add_obstacle(shot, ObstacleType::sphere, V3d(shift + 0.2, 0, 0));
  ball.radius = 0.05, ball.name = "ball";
  ball.position.keys = {{1001, V3d(shift + 0.2, 0, 0)}, {1005, V3d(shift + 0.2, 0.05, 0.02)}};
  add_pin(c, V3d(shift + 0.15, 0, 0), V3d(1e-3, 1, 0.05)).on = "ball";
  ClothPin& soft = add_pin(c, V3d(shift + 0.15, 0, 0.15), V3d(1e-3, 1, 1e-3));
  soft.stiffness = 50, soft.release = 0.05;
  return shot;
}

TEST(Pin, HasTheSameBitsOnThreadsElsewhereAndResumed) {
  for (const ClothModel model : {ClothModel::shell, ClothModel::springs}) {
    const Shot shot = busy_shot(0, model);
    expect_same_bits_on_threads(shot, 40);
    expect_same_bits_when_resumed(shot, 60, 0);
    expect_same_state(after(shot, 40), after(busy_shot(1e4, model), 40));
  }
  Shot alone = busy_shot();
  alone.fluid.box.clear();
  expect_same_bits_on_threads(alone, 40);
  expect_same_bits_when_resumed(alone, 60, 0);
}

// A plate that is held all over is lifted through water by 2 cm: it goes exactly as its keys say,
// and carries what lies on it.
TEST(Pin, LiftsWaterWithAPlate) {
  Shot shot = bare_shot();
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = 0.02;
  shot.domain.min = V3d(-0.1, 0, -0.1), shot.domain.max = V3d(0.1, 0.4, 0.1);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(-0.1, 0.05, -0.1), {10, 4, 10});
  Cloth& c = add_cloth(shot, V3d(-0.1, 0.05, -0.1), V3d(0.2, 0, 0), V3d(0, 0, 0.2), {10, 10});
  ClothPin& pin = pin_all(c);
  pin.position.keys = {{1001, V3d(0)}, {1009, V3d(0, 0.1, 0)}};
  pin.position.interpolation = Interpolation::smooth;
  Stepper run(shot);
  const double before = centre_of_mass(run.solver->save()).y, end = 8 / shot.timeline.fps;
  const double sheet = run.scene.start.cloth_position.y[0];
  while (run.time < end) run.step_towards(end, run.next_dt());
  const sim::HostState state = run.solver->save();
  for (size_t v = 0; v < state.cloth_position.size(); ++v)
    ASSERT_NEAR(state.cloth_position.y[v], sheet + 0.1, 1e-6);
  EXPECT_NEAR(centre_of_mass(state).y, before + 0.1, 0.005);
  for (size_t i = 0; i < state.id.size(); ++i) ASSERT_GT(state.position.y[i], sheet + 0.1);
}

// A small plate that is held all over is pushed down into a sheet held at two edges, which it
// stretches by a tenth: nothing crosses, and the guard does not keep its pins back.
TEST(Pin, PushesAnotherSheetAndDoesNotCrossIt) {
  Shot shot = bare_shot();
  Cloth& sheet = add_cloth(shot, V3d(-0.15, 0, -0.15), V3d(0.3, 0, 0), V3d(0, 0, 0.3), {16, 16});
  sheet.young_warp = sheet.young_weft = 2000, sheet.shear_modulus = 500, sheet.damping_time = 0.005;
  add_pin(sheet, V3d(-0.15, 0, 0), V3d(1e-3, 1, 1)),
      add_pin(sheet, V3d(0.15, 0, 0), V3d(1e-3, 1, 1));
  Cloth& plate =
      add_cloth(shot, V3d(-0.04, 0.01, -0.05), V3d(0.08, 0, 0.01), V3d(0, 0, 0.08), {5, 5});
  ClothPin& pin = pin_all(plate);
  pin.position.keys = {{1001, V3d(0)}, {1004, V3d(0, -0.06, 0)}};
  Stepper run(shot);
  while (run.time < 0.2) {
    run.step_towards(0.2, run.next_dt());
    const sim::HostState state = run.solver->save();
    ASSERT_EQ(count_sheet_crossings(run.scene.cloth, state.cloth_position), 0) << run.time;
  }
  const size_t last = run.scene.start.cloth_position.size() - 1;
  EXPECT_NEAR(places(run)[last].y - run.scene.start.cloth_position.y[last], -0.06, 1e-5);
}

// A plate that spans two periodic axes slides along itself under a thick fluid, which goes with it:
// what it lacks dies as exp(-pi^2 nu t / (4 h^2)), here to 0.3 %.
TEST(Pin, DragsThickFluidAlongWithAPlate) {
  Shot shot = bare_shot();
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = 0.02;
  shot.fluid.kinematic_viscosity = 0.05, shot.fluid.xsph = 0;
  shot.domain.min = V3d(0), shot.domain.max = V3d(0.2, 0.4, 0.2);
  shot.domain.axis = {Axis::periodic, Axis::walls, Axis::periodic};
  add_box(shot, V3d(0, 0.1, 0), {10, 4, 10});
  Cloth& c = add_cloth(shot, V3d(0, 0.1, 0), V3d(0.2, 0, 0), V3d(0, 0, 0.2), {10, 10});
  pin_all(c).position = at_velocity(shot, V3d(0.2, 0, 0));
  Stepper run(shot);
  while (run.time < 0.3) run.step_towards(0.3, run.next_dt());
  const sim::HostState state = run.solver->save();
  double mean = 0;
  for (const float u : state.velocity.x) mean += double(u) / double(state.velocity.size());
  EXPECT_NEAR(mean, 0.2, 0.004);
}

TEST(Pin, OfTwoKindsOnOneVertexIsRefused) {
  Shot shot = bare_shot();
  Cloth& c = add_cloth(shot, V3d(0), V3d(0.2, 0, 0), V3d(0, 0, 0.2), {2, 2});
  pin_all(c), add_pin(c, V3d(0), V3d(0.01));
  EXPECT_EQ(refusal(shot), "");
  c.pin[1].release = 1;
  expect_words(refusal(shot), {"sheet1", "pins 1 and 2", "vertex 0"});
}

TEST(Pin, ThatTearsOrGoesThroughThingsIsSaid) {
  Shot shot = bare_shot();
  shot.domain.axis[1] = Axis::walls;
  Cloth& c = add_cloth(shot, V3d(0), V3d(0.4, 0, 0), V3d(0, 0, 0.1), {8, 2});
  c.stretch_limit = 1.05;
  add_pin(c, V3d(0), V3d(1e-3, 1, 1));
  ClothPin& pin = add_pin(c, V3d(0.4, 0, 0), V3d(1e-3, 1, 1));
  pin.position.keys = {{1001, V3d(0)}, {1013, V3d(0.015, 0, 0)}};
  EXPECT_EQ(warnings(shot), std::vector<std::string>{});
  pin.position.keys[1].second.x = 0.2;
  ASSERT_EQ(warnings(shot).size(), 1u);
  expect_words(warnings(shot)[0], {"sheet1", "pins 1 and 2", "1.5 times", "frame 1013", "1.05"});
  pin.release = 0.03;
  EXPECT_EQ(warnings(shot), std::vector<std::string>{});
  pin.release = ClothPin::never;
  pin.position.keys[1].second = V3d(0, 0.01, 0);
  Obstacle& ball = add_obstacle(shot, ObstacleType::sphere, V3d(0.4, 0.1, 0.05));
  ball.radius = 0.06, ball.name = "ball";
  EXPECT_EQ(warnings(shot), std::vector<std::string>{});
  pin.position.keys = {{1001, V3d(0)}, {1007, V3d(-0.1, 0.1, 0)}, {1013, V3d(0, 0.1, 0)}};
  ASSERT_EQ(warnings(shot).size(), 1u);
  expect_words(warnings(shot)[0], {"pin 2", "into obstacle \"ball\"", "frame 101"});
  shot.obstacle.clear();
  for (Cloth& cloth : shot.cloth) cloth.pin[0].release = 0.001;
  pin.position.keys = {{1001, V3d(0)}, {1013, V3d(0, 2, 0)}};
  ASSERT_EQ(warnings(shot).size(), 1u);
  expect_words(warnings(shot)[0], {"pin 2", "beyond the domain's wall in y"});
}

}  // namespace
}  // namespace drench::sim_tests
