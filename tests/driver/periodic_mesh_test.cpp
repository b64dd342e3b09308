// Obstacles of type mesh in domains with periodic axes: what is as long as the period or longer is
// one body without ends, and the seam is nowhere.

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>

#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/geometry/level_set.h"
#include "sim/simulator.h"
#include "tests/contract/sphere_mesh.h"
#include "tests/sim/obstacle_scenes.h"
#include "tests/sim/periodic_scenes.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using sim_tests::slab;
using sim_tests::Stepper;
using test::TemporaryFolder;

constexpr double a = 0.01, g = 9.81;  // m, m/s^2

/// A closed cylinder along z about the origin.
TriangleMesh cylinder(double radius, double length) {
  constexpr uint32_t n = 128;
  TriangleMesh mesh;
  for (const double z : {-length / 2, length / 2}) {
    for (uint32_t k = 0; k < n; ++k) {
      const double angle = 2 * M_PI * k / n;
      mesh.position.emplace_back(float(radius * std::cos(angle)), float(radius * std::sin(angle)),
                                 float(z));
    }
    mesh.position.emplace_back(0.f, 0.f, float(z));
  }
  for (uint32_t k = 0; k < n; ++k) {
    const uint32_t next = (k + 1) % n, other = n + 1;
    mesh.triangle.emplace_back(k, next, other + next);
    mesh.triangle.emplace_back(k, other + next, other + k);
    mesh.triangle.emplace_back(n, next, k);
    mesh.triangle.emplace_back(other + n, other + k, other + next);
  }
  mesh.velocity.resize(mesh.position.size(), V3f(0));
  return mesh;
}

Obstacle mesh_obstacle(const std::filesystem::path& file, const TriangleMesh& mesh) {
  write_mesh(file, mesh);
  Obstacle o;
  o.type = ObstacleType::mesh, o.mesh_file = file;
  return o;
}

// The distance to a bar that goes around is that to an endless one, at its ends too.
class RoundBar : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Periods, RoundBar, testing::Values(1., 1.05, 1.5, 3.3, 7.),
                         [](const auto& p) { return std::to_string(int(100 * p.param)); });
TEST_P(RoundBar, HasNoEnds) {
  const TemporaryFolder folder;
  Shot shot = slab({20, 20, 6});
  Obstacle bar = mesh_obstacle(folder / "bar.ply", cylinder(0.04, 0.06 * GetParam()));
  bar.position = V3d(0.1, 0.1, 0.021);
  shot.obstacle.push_back(bar);
  sim_tests::add_box(shot, V3d(0, 0.16, 0), {2, 2, 2});
  sim::Scene scene = sim::build_scene(shot, make_level_set);
  for (const double from : {0.25, 0.5, 1.0, 1.3}) {
    double worst = 0;
    for (int k = 0; k < 3000; ++k) {
      const double angle = 2.4 * k, r = 0.04 + from * a;
      const V3d x(0.1 + r * std::cos(angle), 0.1 + r * std::sin(angle), 0.12 * k / 3000 - 0.03);
      worst = std::max(worst, std::abs(scene.obstacles.distance(x, 0) - from * a));
    }
    // A twelfth of a voxel between its corners; 0.033 spacings at the clearance beside caps that
    // just meet, no more anywhere else.
    EXPECT_LT(worst, (from < 0.5 ? 0.04 : 0.011) * a) << from;
  }
}

// rho g times the section, per length.
class RoundBarLift : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(AcrossInSpacings, RoundBarLift, testing::Values(6, 9, 12),
                         [](const auto& p) { return std::to_string(p.param); });
TEST_P(RoundBarLift, IsTheDisplacedWeight) {
  const TemporaryFolder folder;
  const double period = 6 * 0.06 / GetParam();
  for (const double periods : {1., 2.5}) {
    const Obstacle bar = mesh_obstacle(folder / "bar.ply", cylinder(0.03, periods * period));
    const sim_tests::BarForce lift =
        sim_tests::lift_of_bar(bar, M_PI * 0.0009, GetParam(), make_level_set);
    RecordProperty("error_" + std::to_string(int(10 * periods)), std::to_string(lift.error));
    EXPECT_LT(std::abs(lift.error), GetParam() == 6 ? 0.07 : 0.03) << periods;
    EXPECT_LT(std::abs(lift.sideways), 0.01) << periods;
    EXPECT_LT(std::abs(lift.along), 1e-3) << periods;
  }
}

// --- The seam is nowhere ------------------------------------------------------------------------

enum class Form { egg, bar, swelling };

/// Water that falls on an egg, a bar that goes around, or a ball that swells: all moved by `shift`.
Shot splash(const std::filesystem::path& folder, Form form, const V3d& shift) {
  Shot shot = slab({15, 40, 12});
  shot.timeline = {1001, 1005, 60};
  shot.fluid.tolerance = 1e-7;
  TriangleMesh mesh = form == Form::bar ? cylinder(0.03, 0.15) : test::unit_sphere(24, 32);
  for (V3f& p : mesh.position) p = form == Form::bar ? p : p * V3f(0.04f, 0.03f, 0.05f);
  Obstacle o = mesh_obstacle(folder / "body.ply", mesh);
  o.position.keys = {{1001, V3d(0.075, 0.07, 0.06) + shift},
                     {1061, V3d(0.475, 0.07, 0.36) + shift}};  // 0.4 and 0.3 m/s
  for (int frame = 1001; form == Form::swelling && frame <= 1005; ++frame) {
    TriangleMesh ball = test::unit_sphere(24, 32);
    for (V3f& p : ball.position) p *= 0.03f + 0.004f * float(frame - 1001);
    write_mesh(folder / ("ball." + std::to_string(frame) + ".ply"), ball);
    o.mesh_file = folder / "ball.%d.ply";
  }
  shot.obstacle.push_back(o);
  sim_tests::add_box(shot, V3d(0.05, 0.11, 0.03) + shift, {6, 5, 6}, V3d(0.3, -1, 0.2));
  return shot;
}

class MeshSeam : public testing::TestWithParam<Form> {};
INSTANTIATE_TEST_SUITE_P(
    Form, MeshSeam, testing::Values(Form::egg, Form::bar, Form::swelling), [](const auto& p) {
      return std::string(p.param == Form::egg ? "Egg" : p.param == Form::bar ? "Bar" : "Swelling");
    });

TEST_P(MeshSeam, IsNowhere) {
  const TemporaryFolder folder;
  const V3d shift(0.08, 0, 0.06), period(0.15, 0, 0.12);
  Stepper here(splash(folder.path(), GetParam(), V3d(0)), make_level_set),
      there(splash(folder.path(), GetParam(), shift), make_level_set);
  double given = 0, other = 0;
  for (int k = 0; k < 60; ++k) {
    here.step(5e-4), there.step(5e-4);
    given += here.solver->obstacle_impulses().at(0).impulse[1];
    other += there.solver->obstacle_impulses().at(0).impulse[1];
  }
  ASSERT_GT(-given, 0.05 * 0.18);  // of the momentum it fell with: they did meet
  EXPECT_NEAR(given, other, 1e-3 * std::abs(given));
  const sim::HostState p = here.solver->save(), q = there.solver->save();
  const std::vector<int> of_p = sim_tests::place_of_id(p), of_q = sim_tests::place_of_id(q);
  double worst = 0;
  for (size_t i = 0; i < of_p.size(); ++i) {
    V3d d = sim_tests::at(q.position, size_t(of_q[i])) -
            sim_tests::at(p.position, size_t(of_p[i])) - shift;
    for (int k = 0; k < 3; ++k)
      if (period[k] > 0) d[k] -= period[k] * std::round(d[k] / period[k]);
    worst = std::max(worst, d.length());
  }
  EXPECT_LT(worst, 2e-5);
}

// Level sets, images and blends all follow from the time.
TEST_P(MeshSeam, SameBitsForAnyNumberOfThreadsAndAfterAResume) {
  const TemporaryFolder folder;
  const tbb::global_control cores(tbb::global_control::max_allowed_parallelism, 16);
  const Shot shot = splash(folder.path(), GetParam(), V3d(0.08, 0, 0.06));
  const SimulatorOptions options{.device = Device::cpu, .level_set = make_level_set};
  std::vector<ParticleFrame> ends;
  for (const int threads : {1, 16}) {
    tbb::task_arena arena(threads);
    arena.execute([&] {
      Simulator whole(shot, options);
      for (int k = 0; k < 4; ++k) {
        whole.advance_frame();
        if (k == 1) whole.write_checkpoint(folder / "at.ckpt");
      }
      ends.push_back(whole.particles());
    });
  }
  Simulator resumed(shot, options);
  resumed.read_checkpoint(folder / "at.ckpt");
  for (int k = 0; k < 2; ++k) resumed.advance_frame();
  ends.push_back(resumed.particles());
  for (const ParticleFrame& other : {ends[1], ends[2]}) {
    EXPECT_EQ(ends[0].id, other.id);
    EXPECT_EQ(ends[0].position, other.position);
    EXPECT_EQ(ends[0].velocity, other.velocity);
  }
}

// A round bar goes around and around along x through a pool and lets nothing in, counted with its
// own surface, in double.
TEST(RoundBar, LetsNoParticleInOnItsWayAround) {
  const TemporaryFolder folder;
  Shot shot = slab({20, 60, 6});
  shot.gravity = V3d(0, -g, 0);
  sim_tests::add_plane(shot, V3d(0), V3d(0, 1, 0));
  Obstacle bar = mesh_obstacle(folder / "bar.ply", cylinder(0.03, 0.06));
  bar.position.keys = {{1001, V3d(0.04, 0.05, 0)}, {1025, V3d(1.04, 0.05, 0.3)}};
  shot.obstacle.push_back(bar);
  sim_tests::add_box(shot, V3d(0), {20, 8, 6});
  Stepper run(shot, make_level_set);
  double least = 1e30;
  while (run.time < 0.6) {  // 3 times around
    run.step();
    const sim::HostState state = run.solver->save();
    const V3d centre = bar.position.at(1001 + run.time * shot.timeline.fps);
    for (size_t i = 0; i < state.id.size(); ++i) {
      double x = run.scene.frame.to_world(0, state.position.x[i]) - centre.x;
      x -= 0.2 * std::round(x / 0.2);
      const double y = run.scene.frame.to_world(1, state.position.y[i]) - centre.y;
      least = std::min(least, std::hypot(x, y) - 0.03);
    }
  }
  EXPECT_GT(least, 0);
  EXPECT_LT(least, a);  // water was there
}

}  // namespace
}  // namespace drench
