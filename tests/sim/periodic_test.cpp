// Periodic axes: what leaves through one side comes in at the other, and nothing tells where the
// seam is.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/files/files.h"
#include "sim/columns.h"
#include "sim/passes/pressure/incompressible.h"
#include "sim/passes/pressure/measure_density.h"
#include "sim/simulator.h"
#include "tests/sim/listed.h"
#include "tests/sim/periodic_scenes.h"
#include "tests/temporary_folder.h"

namespace drench::sim_tests {
namespace {

constexpr std::array<Axis, 3> all_periodic{Axis::periodic, Axis::periodic, Axis::periodic};

/// A periodic box of `cells` particles, or of that room; default spacing 0.01 m.
Shot periodic_box(FluidSolver solver, std::array<int, 3> cells) {
  Shot shot = empty_shot();
  shot.fluid.solver = solver;
  shot.domain.min = V3d(0);
  shot.domain.max = V3d(cells[0], cells[1], cells[2]) * shot.fluid.spacing;
  shot.domain.axis = all_periodic;
  return shot;
}

class Periodic : public testing::TestWithParam<FluidSolver> {};
INSTANTIATE_TEST_SUITE_P(Solver, Periodic,
                         testing::Values(FluidSolver::incompressible,
                                         FluidSolver::weakly_compressible),
                         [](const auto& solver) {
                           return solver.param == FluidSolver::incompressible
                                      ? "Incompressible"
                                      : "WeaklyCompressible";
                         });

// 5 layers are two cells of an axis, whose three neighbours are an image each of the same two; 9
// are four.
TEST_P(Periodic, ALatticeThatFillsTheBoxIsAtRestAndStaysSo) {
  Shot shot = periodic_box(GetParam(), {5, 9, 12});
  add_box(shot, V3d(0.003, 0.052, -0.11), {5, 9, 12});  // across all seams
  Stepper run(shot);
  run.solver->refresh();
  for (const float density : run.solver->density()) EXPECT_NEAR(density, 1000, 0.02);
  const sim::HostState before = run.solver->save();
  for (int k = 0; k < 50; ++k) run.step(1e-3);
  const sim::HostState after = run.solver->save();
  const std::vector<int> from = place_of_id(before), to = place_of_id(after);
  for (size_t i = 0; i < from.size(); ++i) {
    const V3d moved = at(after.position, size_t(to[i])) - at(before.position, size_t(from[i]));
    EXPECT_LT(nearest_image(moved, period_of(shot)).length(), 1e-6);
  }
}

/// The same, every particle shaken by up to `share` of a spacing and as fast in m/s.
sim::Scene shaken(Shot shot, double share) {
  sim::Scene scene = sim::build_scene(shot);
  Random random(7);
  const double a = shot.fluid.spacing;
  for (size_t i = 0; i < scene.start.id.size(); ++i) {
    sim::HostVec &x = scene.start.position, &v = scene.start.velocity;
    const auto shake = [&](int axis, std::vector<float>& place, std::vector<float>& speed) {
      const double world = scene.frame.to_world(axis, place[i]) + share * a * (random() - 0.5);
      place[i] = scene.place(axis, world), speed[i] = float(share * (random() - 0.5));
    };
    shake(0, x.x, v.x), shake(1, x.y, v.y), shake(2, x.z, v.z);
  }
  return scene;
}

TEST_P(Periodic, MomentumIsKeptToRounding) {
  Shot shot = periodic_box(GetParam(), {10, 12, 14});
  add_box(shot, V3d(0.02, 0, 0.05), {8, 12, 12}, V3d(0.3, 0, 0));
  Stepper run(shaken(shot, 0.4));
  const V3d before = total_momentum(run.scene, run.solver->save());
  for (int k = 0; k < 200; ++k) run.step(5e-4);
  ASSERT_EQ(run.solver->particles(), 8 * 12 * 12);
  const sim::HostState state = run.solver->save();
  const V3d change = total_momentum(run.scene, state) - before;
  EXPECT_LT(change.length(), 1e-5 * momentum_scale(run.scene, state, 0));
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d p = at(state.position, i);
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(p[k] >= 0 && p[k] < period_of(shot)[k]);
  }
}

// Gravity along a periodic axis meets nothing: a drop falls through the seam as the parabola says.
TEST_P(Periodic, ADropFallsThroughTheSeam) {
  Shot shot = periodic_box(GetParam(), {12, 20, 12});
  shot.gravity = V3d(0, -9.81, 0);
  add_box(shot, V3d(0.04), {5, 5, 5});
  Stepper run(shot);
  constexpr int n = 800;
  for (int k = 0; k < n; ++k) run.step(5e-4);
  const sim::HostState state = run.solver->save();
  double speed = 0;
  for (size_t i = 0; i < state.id.size(); ++i) speed += state.velocity.y[i];
  EXPECT_NEAR(speed / 125, -9.81 * 0.4, 1e-4);
  const double fall = 0.5 * 9.81 * 0.4 * 0.4 * (1 + 1.0 / n);  // 3.9 times around
  for (size_t i = 0; i < state.id.size(); ++i) {
    const double start = 0.045 + 0.01 * ((state.id[i] / 5) % 5);
    const double off = std::remainder(state.position.y[i] - start + fall, 0.2);
    EXPECT_LT(std::abs(off), 2e-5) << i;
  }
}

/// Two drops that collide, all moved by `shift` and as fast as `drift`.
Shot collision(FluidSolver solver, const V3d& shift, const V3d& drift) {
  Shot shot = periodic_box(solver, {24, 20, 16});
  shot.fluid.sound_speed = 10;  // the automatic one counts the drift
  shot.fluid.tolerance = 1e-6;  // coarse levels stand at other places: solves agree when done
  shot.fluid.sphere.push_back({V3d(0.08, 0.1, 0.08) + shift, 0.035, drift + V3d(0.5, 0, 0)});
  shot.fluid.sphere.push_back({V3d(0.17, 0.11, 0.08) + shift, 0.035, drift - V3d(0.5, 0, 0)});
  return shot;
}

/// RMS distance of each particle of one state from that of the other, moved by `shift`, m.
double rms_difference(const sim::HostState& a, const sim::HostState& b, const V3d& shift,
                      const V3d& period) {
  const std::vector<int> of_a = place_of_id(a), of_b = place_of_id(b);
  double sum = 0;
  for (size_t i = 0; i < of_a.size(); ++i) {
    const V3d d = at(b.position, size_t(of_b[i])) - at(a.position, size_t(of_a[i])) - shift;
    sum += nearest_image(d, period).length2();
  }
  return std::sqrt(sum / double(of_a.size()));
}

// Drops moved by whole spacings, so that both lie across seams; drops that fly through all seams.
// They meet at 25 ms: what rounding began (4e-8 and 6e-7 m then) grows tenfold every 5 ms while
// lattices break.
TEST_P(Periodic, NothingTellsWhereTheSeamIs) {
  const V3d far(0.13, 0.09, 0.11), drift(1.2, -0.9, 0.7);
  Stepper plain(collision(GetParam(), V3d(0), V3d(0))), moved(collision(GetParam(), far, V3d(0))),
      flying(collision(GetParam(), V3d(0), drift));
  const double dt = 2e-4;
  for (int k = 0; k < 175; ++k) plain.step(dt), moved.step(dt), flying.step(dt);
  const sim::HostState state = plain.solver->save();
  double spread = 0;  // it did collide
  for (const float v : state.velocity.y) spread = std::max(spread, double(std::abs(v)));
  ASSERT_GT(spread, 0.1);
  const V3d period = period_of(collision(GetParam(), V3d(0), V3d(0)));
  EXPECT_LT(rms_difference(state, moved.solver->save(), far, period), 2e-5);
  EXPECT_LT(rms_difference(state, flying.solver->save(), drift * 0.035, period), 2e-5);
}

TEST(PeriodicLists, HoldWhatABruteForceSearchOfNearestImagesFinds) {
  Shot shot = periodic_box(FluidSolver::incompressible, {5, 9, 7});
  shot.domain.axis[1] = Axis::walls;
  add_box(shot, V3d(0), {5, 9, 7});
  V3d period = period_of(shot);
  period.y = 1e30;
  sim::Scene scene = shaken(shot, 1);
  const auto solver = sim::cpu::make_solver(scene.parameters, scene.cloth);
  solver->load(scene.start);
  solver->refresh();  // density by cells
  const std::vector<float> measured = solver->density();
  const double h = scene.parameters.support_radius;
  const sim::cpu::ImageWalls walls = sim::cpu::image_walls_of(scene.parameters);

  sim::cpu::State state;
  state.parameters = scene.parameters;
  sim::cpu::FluidState& f = state.fluid;
  const int n = f.count = int(scene.start.id.size());
  using enum sim::ColumnGroup;
  sim::cpu::resize_particles(state,
                             position | velocity | cells | sorting | density | pressure | lists |
                                 projection | solve | scratch,
                             size_t(n));
  sim::cpu::PressureState& s = state.pressure;
  for (int i = 0; i < n; ++i) {
    const V3d p = at(scene.start.position, size_t(i));
    f.position.view().set(i, {float(p.x), float(p.y), float(p.z)}), f.id.data()[i] = i;
  }
  sim::cpu::sort_particles(state);
  sim::cpu::find_neighbours(state);
  remove_correction(state);
  s.control.data()->done = 0;
  const sim::cpu::NeighbourView list = view_of(s.lists);
  const auto place = [&](int i) { return at(scene.start.position, size_t(f.id.data()[i])); };
  Random random(3);
  for (int i = 0; i < n; ++i)
    s.scratch_a.data()[i] = {float(random() - 0.5), float(random() - 0.5), float(random() - 0.5),
                             0.f};
  sim::cpu::density_rate(state);
  for (int i = 0; i < n; ++i) {
    std::vector<int> found, expected;
    for (size_t k = list.first(i); k < list.end(i); ++k)
      if (list.closeness(k) > 0) found.push_back(list.index(k));
    double sum = 0, rate = 0;
    const auto vector = [&](int j) {
      const sim::cpu::Float4 v = s.scratch_a.data()[j];
      return V3d(v.x, v.y, v.z);
    };
    for (int j = 0; j < n; ++j) {
      const V3d d = nearest_image(place(i) - place(j), period);
      const double u = std::max(0.0, 1 - d.length() / h);
      if (u > 1e-6) expected.push_back(j);
      sum += 10.5 / M_PI * std::pow(u, 4) * (5 - 4 * u);
      rate -= 210 / M_PI * std::pow(u, 3) * d.dot(vector(i) - vector(j));
    }
    std::sort(found.begin(), found.end());
    EXPECT_TRUE(std::includes(found.begin(), found.end(), expected.begin(), expected.end())) << i;
    EXPECT_LE(found.size(), expected.size() + 1) << i;  // one on the border may be either
    const V3d p = place(i);
    const sim::cpu::WallDensity wall = walls.density({float(p.x), float(p.y), float(p.z)});
    const double scale =
        scene.parameters.particle_mass / scene.parameters.lattice_sum / (h * h * h);
    const double rho = scale * sum + 1000 * wall.value;
    EXPECT_NEAR(f.density.data()[i], rho, 1e-4 * rho);
    EXPECT_NEAR(measured[size_t(f.id.data()[i])], rho, 1e-4 * rho) << "measured";
    rate *= scale / (h * h);
    rate += 1000 * V3d(wall.gradient.x, wall.gradient.y, wall.gradient.z).dot(vector(i));
    EXPECT_NEAR(s.product.data()[i], rate, 5);  // of a few 10^4 kg/(m^3 s)
  }
}

// A source that stands outside is where its image is, and what another source holds already it
// leaves out, across the seam too.
TEST(PeriodicSources, StandAtTheirImages) {
  Shot shot = periodic_box(FluidSolver::incompressible, {16, 16, 16});
  add_box(shot, V3d(0), {4, 4, 4});
  add_box(shot, V3d(0.14, 0, 0.16), {4, 4, 4});  // shares two layers
  const sim::Scene scene = sim::build_scene(shot);
  ASSERT_EQ(scene.start.id.size(), size_t(64 + 32));
  for (size_t i = 0; i < 96; ++i) {
    const V3d p = at(scene.start.position, i);
    EXPECT_TRUE(p.x < 0.04 || (p.x > 0.14 && p.x < 0.16)) << p.x;
    EXPECT_TRUE(p.z > 0 && p.z < 0.04) << p.z;
  }
}

TEST(PeriodicSources, DropsDoNotTouchAcrossTheSeam) {
  Shot shot = periodic_box(FluidSolver::incompressible, {16, 16, 16});
  shot.fluid.drops.push_back({});
  FluidDrops& drops = shot.fluid.drops.back();
  drops.min = V3d(0), drops.max = V3d(0.16), drops.radius = 0.025, drops.count = 6;
  const sim::Scene scene = sim::build_scene(shot);
  const size_t n = scene.start.id.size(), each = n / 6;
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < n; ++j) {
      if (i / each == j / each) continue;
      const V3d d = at(scene.start.position, i) - at(scene.start.position, j);
      EXPECT_GT(nearest_image(d, period_of(shot)).length(), 0.0099);
    }
  }
}

// A jet that goes around, stopped and taken up again from its checkpoint.
TEST(PeriodicResume, HasTheSameBitsAndLosesNothing) {
  const test::TemporaryFolder folder;
  Shot shot = periodic_box(FluidSolver::incompressible, {16, 16, 16});
  shot.domain.axis[1] = Axis::walls;
  FluidEmitter jet;
  jet.center = V3d(0.155, 0.08, 0.159), jet.direction = V3d(1, 0, 0);
  jet.radius = 0.02, jet.speed = 1.5, jet.stop = 0.1;
  shot.fluid.emitter.push_back(jet);
  Simulator whole(shot, {.device = Device::cpu}), first(shot, {.device = Device::cpu}),
      second(shot, {.device = Device::cpu});
  for (int frame = 0; frame < 3; ++frame) whole.advance_frame(), first.advance_frame();
  first.write_checkpoint(folder / "state");
  second.read_checkpoint(folder / "state");
  for (int frame = 0; frame < 3; ++frame) whole.advance_frame(), second.advance_frame();
  const ParticleFrame a = whole.particles(), b = second.particles();
  ASSERT_EQ(a.position.size(), size_t(14 * 13));  // 188 in whole layers
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.velocity, b.velocity);
  EXPECT_EQ(a.density, b.density);
  for (const V3f& p : a.position) EXPECT_TRUE(p.x >= 0 && p.x < 0.16f && p.z >= 0 && p.z < 0.16f);
}

TEST(PeriodicSkip, SidesOutOfReachAddNoPassAndNoColumn) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  add_box(shot, V3d(0), {6, 6, 6});
  const Stepper open(shot);
  shot.domain.axis = all_periodic;
  const Stepper periodic(shot);
  ASSERT_EQ(open.solver->plan().size(), periodic.solver->plan().size());
  for (size_t k = 0; k < open.solver->plan().size(); ++k)
    EXPECT_EQ(open.solver->plan()[k].name, periodic.solver->plan()[k].name);
  EXPECT_EQ(open.solver->allocated(), periodic.solver->allocated());
}

/// A drop that hits a floor, in a domain whose far sides in x and z are as told. Cells fill a
/// period exactly, so that sums come in another order.
sim::HostState splash(Axis sides) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  shot.gravity = V3d(0, -9.81, 0);
  shot.domain.axis = {sides, Axis::walls, sides};
  shot.fluid.tolerance = 1e-6;  // coarse levels stand at other places: solves agree when done
  shot.fluid.sphere.push_back({V3d(0.003, -0.96, 0.004), 0.035, V3d(0, -1, 0)});
  Stepper run(shot);
  for (int k = 0; k < 60; ++k) run.step(1e-3);
  return run.solver->save();
}

TEST(PeriodicSkip, SidesOutOfReachChangeNothingButRounding) {
  const sim::HostState open = splash(Axis::open), periodic = splash(Axis::periodic);
  EXPECT_LT(rms_difference(open, periodic, V3d(0), V3d(2)), 2e-5);
}

}  // namespace
}  // namespace drench::sim_tests
