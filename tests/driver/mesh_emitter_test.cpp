// Closed meshes that are kept full, with level sets by OpenVDB.

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"
#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/geometry/level_set.h"
#include "sim/setup/scene.h"
#include "sim/simulator.h"
#include "tests/contract/box_mesh.h"
#include "tests/contract/sphere_mesh.h"
#include "tests/same_bits.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using test::TemporaryFolder;

constexpr double a = 0.02;  // m

class MeshEmitter : public testing::Test {
 protected:
  void SetUp() override {
    test::write_box(folder_ / "box.obj", V3f(0.2f));
    write_mesh(folder_ / "ball.ply", test::unit_sphere(24, 48));
  }
  FluidEmitter emitter_of(const std::string& file, const V3d& center) const {
    FluidEmitter emitter;
    emitter.type = EmitterType::mesh, emitter.mesh_file = folder_ / file, emitter.center = center;
    return emitter;
  }
  /// Open on all sides, 0.8 m wide, 100 frames a second.
  Shot shot_of(const std::vector<FluidEmitter>& emitters) const {
    Shot shot;
    shot.name = shot.file = "mesh_emitter";
    shot.timeline = {1001, 1101, 100};
    shot.fluid.spacing = a, shot.fluid.solver = FluidSolver::incompressible;
    shot.domain.min = V3d(-0.4), shot.domain.max = V3d(0.4);
    shot.domain.axis = {Axis::open, Axis::open, Axis::open};
    shot.fluid.emitter = emitters;
    return shot;
  }
  Shot shot_of(const FluidEmitter& emitter) const { return shot_of(std::vector{emitter}); }
  static Simulator simulator_of(const Shot& shot) {
    return {shot, {.device = Device::cpu, .level_set = make_level_set}};
  }
  static std::string refusal(const Shot& shot) {
    try {
      sim::build_scene(shot, make_level_set);
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing was refused";
  }
  TemporaryFolder folder_;
};

/// Particles in the box from `low` to `high`.
size_t count_in(const ParticleFrame& frame, const V3d& low, const V3d& high) {
  return size_t(std::count_if(frame.position.begin(), frame.position.end(), [&](const V3f& p) {
    return p.x > low.x && p.y > low.y && p.z > low.z && p.x < high.x && p.y < high.y &&
           p.z < high.z;
  }));
}

// Water falls out of a box over an open floor. The box stays full, every particle is there or has
// left, and no id is given twice.
TEST_F(MeshEmitter, KeepsABoxFullAboveAnOpenFloor) {
  Simulator simulator = simulator_of(shot_of(emitter_of("box.obj", V3d(-0.1, 0, -0.1))));
  uint64_t emitted = 0, lost = 0;
  EXPECT_EQ(simulator.particles().id.size(), 0u);
  for (int frame = 0; frame < 50; ++frame) {
    const StepReport report = simulator.advance_frame();
    emitted += report.emitted, lost += report.lost;
    ASSERT_EQ(emitted, report.particles + lost);
    const ParticleFrame fluid = simulator.particles();
    const std::set<uint32_t> ids(fluid.id.begin(), fluid.id.end());
    ASSERT_EQ(ids.size(), fluid.id.size());
    ASSERT_LT(*ids.rbegin(), emitted);
    const size_t inside = count_in(fluid, V3d(-0.1, 0, -0.1), V3d(0.1, 0.2, 0.1));
    EXPECT_GT(inside, 555u) << frame;  // two spacings of 0.9 do not fit between two layers
    EXPECT_LT(inside, 1100u) << frame;
  }
  EXPECT_GT(lost, 500u);
}

/// Emitted in `frames` frames.
uint64_t emitted_in(Simulator& simulator, int frames) {
  uint64_t emitted = 0;
  for (int k = 0; k < frames; ++k) emitted += simulator.advance_frame().emitted;
  return emitted;
}

// The mesh is a vessel: once full it stays as full as its cells, and nothing more comes.
TEST_F(MeshEmitter, StopsWhenThereIsNoRoom) {
  Shot shot = shot_of(emitter_of("box.obj", V3d(-0.1)));
  shot.domain.min = V3d(-0.1), shot.domain.max = V3d(0.1, 0.4, 0.1);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  Simulator simulator = simulator_of(shot);
  EXPECT_EQ(emitted_in(simulator, 1), 1000u);
  EXPECT_LE(emitted_in(simulator, 50), 10u);  // 1 %
}

/// Emitted in 0.4 s without gravity in an endless space over area x speed x time and the cells of
/// the box, which are full at once. @param step  s; 0: as large as is stable.
double share_of_flow(Shot shot, const V3d& velocity, double step) {
  shot.fluid.emitter[0].velocity = velocity;
  shot.gravity = V3d(0), shot.timeline.fps = 5, shot.time_step = step;
  shot.domain.min = V3d(-4), shot.domain.max = V3d(4);
  Simulator simulator(shot, {.device = Device::cpu, .level_set = make_level_set});
  const double area = (std::abs(velocity.x) + std::abs(velocity.y) + std::abs(velocity.z)) * 0.04;
  return (double(emitted_in(simulator, 2)) - 1000) * a * a * a / (area * 0.4);
}

// Area x speed x time to the layer where steps end just as a layer is free (a quarter of a spacing
// each). Others are late by up to a step: 0.9 to 1.3 spacings from layer to layer at steps of 0.4.
TEST_F(MeshEmitter, DeliversWhatAUniformFlowTakesAway) {
  const Shot shot = shot_of(emitter_of("box.obj", V3d(-0.1)));
  EXPECT_NEAR(share_of_flow(shot, V3d(0, -1, 0), 0.25 * a), 1, 1.01 / 20);
  EXPECT_NEAR(share_of_flow(shot, V3d(0, 0, 0.5), 0.5 * a), 1, 1.01 / 10);
  for (const V3d& velocity : {V3d(0, -1, 0), V3d(0.6, -0.8, 0), V3d(0.5, -0.7, 0.51)}) {
    const double share = share_of_flow(shot, velocity, 0);
    EXPECT_GT(share, 1 / 1.3 - 0.05) << velocity;
    EXPECT_LT(share, 1 / 0.9 + 0.05) << velocity;
  }
}

/// Distance of two points, over the seams of periodic axes too.
double apart(const Domain& domain, V3d d) {
  for (int k = 0; k < 3; ++k) {
    const double period = domain.max[k] - domain.min[k];
    if (domain.axis[size_t(k)] == Axis::periodic) d[k] -= period * std::round(d[k] / period);
  }
  return d.length();
}

// Against all pairs: what is missing of a ball across a corner where two axes are periodic is what
// has no particle within 0.9 spacings; the lattice does not even fit the period.
TEST_F(MeshEmitter, FillsExactlyTheFreePlaces) {
  FluidEmitter emitter = emitter_of("ball.ply", V3d(0.39, 0.1, -0.38));
  emitter.scale = 0.13, emitter.inset = 0;
  Shot shot = shot_of(emitter);
  shot.domain.max = V3d(0.413, 0.4, 0.407);
  shot.domain.axis = {Axis::periodic, Axis::open, Axis::periodic};
  sim::Scene scene = sim::build_scene(shot, make_level_set);
  std::vector<V3d> particles;
  sim::HostVec local;
  uint32_t random = 1;
  const auto next = [&] { return double(random = random * 1664525 + 1013904223) / 4294967296.0; };
  for (int k = 0; k < 40000; ++k) {
    const V3d p(-0.4 + 0.813 * next(), -0.4 + 0.8 * next(), -0.4 + 0.807 * next());
    local.push(scene.place(0, p.x), scene.place(1, p.y), scene.place(2, p.z));
    particles.emplace_back(scene.frame.to_world(0, local.x.back()),
                           scene.frame.to_world(1, local.y.back()),
                           scene.frame.to_world(2, local.z.back()));
  }
  std::vector<V3d> found;
  for (const sim::NewParticle& n : scene.mesh_emitter.at(0).missing(scene, local, 0))
    found.push_back(n.position);
  for (size_t i = 0; i < found.size(); ++i) {
    EXPECT_LT((found[i] - V3d(0.39, 0.1, -0.38)).length(), 0.13 + 0.05 * a);
    for (const V3d& p : particles) ASSERT_GT(apart(shot.domain, p - found[i]), 0.8999 * a);
    for (size_t j = 0; j < i; ++j) ASSERT_GT(apart(shot.domain, found[j] - found[i]), 0.8999 * a);
  }
  size_t places = 0, missed = 0;  // of those well inside, and not found though nothing is near
  for (int i = 0; i < 80 * 40 * 80; ++i) {
    const V3d p = V3d(i % 80 + 0.5, i / 80 % 40 + 0.5, i / 3200 + 0.5) * a + V3d(-0.4, -0.4, -1.2);
    if ((p - V3d(0.39, 0.1, -0.38)).length() > 0.13 - 0.1 * a) continue;
    ++places;
    const auto near = [&](const V3d& q) { return apart(shot.domain, p - q) < 0.9001 * a; };
    if (std::none_of(particles.begin(), particles.end(), near) &&
        std::none_of(found.begin(), found.end(), near))
      ++missed;
  }
  EXPECT_GT(places, 1000u);
  EXPECT_GT(found.size(), 30u);
  EXPECT_LT(found.size(), places / 2);
  EXPECT_EQ(missed, 0u);
}

// v + c' + omega x (p - c) of a ball that flies and turns about an axis that stands askew to
// nothing but z: one turn a second.
TEST_F(MeshEmitter, GivesTheVelocityOfTheMesh) {
  FluidEmitter emitter = emitter_of("ball.ply", V3d(0));
  emitter.scale = 0.1, emitter.velocity = V3d(0.1, -0.2, 0.3);
  emitter.center.keys = {{1001, V3d(-0.2, 0, 0)}, {1101, V3d(0.2, 0.1, 0)}};
  emitter.rotation_deg.keys = {{1001, V3d(0)}, {1101, V3d(0, 0, 360)}};
  sim::Scene scene = sim::build_scene(shot_of(emitter), make_level_set);
  const V3d flies(0.4, 0.1, 0), turns(0, 0, 2 * M_PI);
  for (const double time : {0.1, 0.37, 0.9}) {
    const auto fresh = scene.mesh_emitter.at(0).missing(scene, {}, time);
    EXPECT_GT(fresh.size(), 300u);
    const V3d center = V3d(-0.2, 0, 0) + flies * time;
    for (const auto& [p, v] : fresh) {
      EXPECT_LT((p - center).length(), 0.1);
      const V3d expected = emitter.velocity + flies + turns.cross(p - center);
      EXPECT_LT((v - expected).length(), 1e-4);  // of differences over 1e-5 s: 2e-5
    }
  }
}

// Free flight of a mesh through empty space: it stays full, and what it leaves behind is what it
// met: none, since the fluid flies along.
TEST_F(MeshEmitter, CarriesItsFluidAlong) {
  FluidEmitter emitter = emitter_of("ball.ply", V3d(0));
  emitter.scale = 0.1;
  emitter.center.keys = {{1001, V3d(-0.25, 0, 0)}, {1101, V3d(0.75, 0, 0)}};  // 1 m/s
  Shot shot = shot_of(emitter);
  shot.gravity = V3d(0);
  Simulator simulator = simulator_of(shot);
  const uint64_t first = emitted_in(simulator, 1);
  EXPECT_GT(first, 350u);
  EXPECT_LT(emitted_in(simulator, 40), first / 4);
  const ParticleFrame fluid = simulator.particles();
  for (size_t i = 0; i < fluid.position.size(); ++i) {
    EXPECT_LT((V3d(fluid.position[i]) - V3d(0.16, 0, 0)).length(), 0.1 + a) << i;
    EXPECT_NEAR(fluid.velocity[i].x, 1, 0.05);
  }
}

TEST_F(MeshEmitter, KeepsToItsTime) {
  FluidEmitter emitter = emitter_of("box.obj", V3d(-0.1));
  emitter.start = 0.035, emitter.stop = 0.065;
  Shot shot = shot_of(emitter);
  shot.preroll = 0.02;
  Simulator simulator = simulator_of(shot);
  EXPECT_EQ(simulator.preroll().emitted, 0u);  // to 0.02 s after the start
  EXPECT_EQ(emitted_in(simulator, 1), 0u);     // to 0.03
  EXPECT_EQ(emitted_in(simulator, 2), 1000u);  // to 0.05
  emitted_in(simulator, 2);                    // to 0.07
  EXPECT_EQ(emitted_in(simulator, 10), 0u);
}

// Beyond the walls nothing appears, nor nearer to them than half a spacing, nor in an obstacle.
TEST_F(MeshEmitter, LeavesOutWallsAndObstacles) {
  Shot shot = shot_of(emitter_of("box.obj", V3d(-0.45, -0.41, 0.3)));
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  Obstacle ball;
  ball.type = ObstacleType::sphere, ball.radius = 0.05, ball.position = V3d(-0.3, -0.3, 0.35);
  shot.obstacle.push_back(ball);
  shot.gravity = V3d(0);
  Simulator simulator = simulator_of(shot);
  const uint64_t emitted = emitted_in(simulator, 1);
  // 7 x 9 x 5 whole cells less a ball of 2.5 + 0.5 spacings, which the box cuts by half a spacing
  // at both ends: 206. About 100 of them are on its surface, there or not by chance.
  const double cap = M_PI * 0.25 * (9 - 0.5) / 3;
  EXPECT_NEAR(double(emitted), 315 - (4. / 3 * M_PI * 27 - 2 * cap), 15);
  for (const V3f& p : simulator.particles().position) {
    EXPECT_GT((V3d(p) - V3d(-0.3, -0.3, 0.35)).length(), 0.05);
    for (int k = 0; k < 3; ++k) EXPECT_LT(std::abs(p[k]), 0.4 - 0.4 * a);
  }
}

TEST_F(MeshEmitter, ThatCannotBeFilledIsRefused) {
  const auto refused = [&](const std::string& file, const V3d& center = V3d(0)) {
    return refusal(shot_of(emitter_of(file, center)));
  };
  write_file_whole(folder_ / "open.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\nf 1 3 4\n");
  EXPECT_NE(refused("open.obj").find("not closed"), std::string::npos);
  write_file_whole(folder_ / "empty.obj", "");
  EXPECT_NE(refused("empty.obj").find("empty.obj"), std::string::npos);
  write_file_whole(folder_ / "nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\n");
  EXPECT_NE(refused("nan.obj").find("nan.obj"), std::string::npos);
  EXPECT_NE(refused("none.obj").find("none.obj"), std::string::npos);
  EXPECT_NE(refused("box.obj", V3d(0.45, 0, 0)).find("never holds"), std::string::npos);
  test::write_box(folder_ / "small.obj", V3f(0.2f, 0.2f, 0.6f * float(a)));
  EXPECT_NE(refused("small.obj").find("never holds"), std::string::npos);
  FluidEmitter huge = emitter_of("box.obj", V3d(0));
  huge.scale = 1e5;
  EXPECT_NE(refusal(shot_of(huge)).find("smaller scale"), std::string::npos);
  // One that comes into the domain later is not.
  FluidEmitter comes = emitter_of("box.obj", V3d(0));
  comes.center.keys = {{1001, V3d(1, 0, 0)}, {1050, V3d(0)}};
  EXPECT_EQ(refusal(shot_of(comes)), "nothing was refused");
}

/// A box over a floor and a turning ball beside it, in a box of water.
Shot busy(Shot shot) {
  shot.timeline = {1001, 1010, 60};
  shot.domain.axis = {Axis::open, Axis::walls, Axis::periodic};
  shot.fluid.box.push_back({V3d(-0.3, -0.4, -0.3), V3d(0.3, -0.3, 0.3), V3d(0.1, 0, 0)});
  return shot;
}
FluidEmitter turning(FluidEmitter emitter) {
  emitter.scale = 0.09, emitter.velocity = V3d(0, -1, 0.5);
  emitter.rotation_deg.keys = {{1001, V3d(0)}, {1010, V3d(90, 0, 300)}};
  emitter.center.keys = {{1001, V3d(0.2, 0, 0.3)}, {1010, V3d(0.2, -0.1, 0.5)}};
  return emitter;
}

bool same(const ParticleFrame& one, const ParticleFrame& other) {
  return test::same_bits(one.position, other.position) &&
         test::same_bits(one.velocity, other.velocity) && one.id == other.id;
}

TEST_F(MeshEmitter, GivesTheSameBitsForAnyNumberOfThreads) {
  const Shot shot = busy(shot_of(
      {emitter_of("box.obj", V3d(-0.25, -0.1, -0.1)), turning(emitter_of("ball.ply", V3d(0)))}));
  std::vector<ParticleFrame> end;
  for (const int threads : {1, 2, 16}) {
    tbb::task_arena arena(threads);
    arena.execute([&] {
      Simulator simulator = simulator_of(shot);
      EXPECT_GT(emitted_in(simulator, 6), 1500u);
      end.push_back(simulator.particles());
    });
  }
  EXPECT_TRUE(same(end[0], end[1]));
  EXPECT_TRUE(same(end[0], end[2]));
}

TEST_F(MeshEmitter, GivesTheSameBitsAfterResume) {
  const Shot shot = busy(shot_of(
      {emitter_of("box.obj", V3d(-0.25, -0.1, -0.1)), turning(emitter_of("ball.ply", V3d(0)))}));
  Simulator whole = simulator_of(shot), resumed = simulator_of(shot);
  for (int k = 0; k < 3; ++k) whole.advance_frame();
  whole.write_checkpoint(folder_ / "middle");
  const uint64_t emitted = emitted_in(whole, 3);
  whole.write_checkpoint(folder_ / "whole");
  resumed.read_checkpoint(folder_ / "middle");
  EXPECT_EQ(emitted_in(resumed, 3), emitted);
  EXPECT_GT(emitted, 100u);
  resumed.write_checkpoint(folder_ / "resumed");
  EXPECT_EQ(read_text(folder_ / "whole"), read_text(folder_ / "resumed"));
}

// An emitter that is silent brings no pass, no column and no bit; one that works no pass either.
TEST_F(MeshEmitter, CostsNothingWhereItIsNot) {
  FluidEmitter late = emitter_of("box.obj", V3d(-0.25, -0.1, -0.1)), now = late;
  late.start = 100;
  std::vector<ParticleFrame> end;
  std::vector<std::string> plans;
  for (const auto& emitters : {std::vector<FluidEmitter>{}, std::vector{late}, std::vector{now}}) {
    const Shot shot = busy(shot_of(emitters));
    const sim::Scene scene = sim::build_scene(shot, make_level_set);
    const auto solver = sim::cpu::make_solver(scene.parameters, scene.cloth);
    plans.emplace_back();
    for (size_t k = 0; k < sim::column_group_names.size(); ++k)
      plans.back() += solver->allocated().contains(sim::ColumnGroup(k)) ? '1' : '0';
    for (const sim::PassInfo& pass : solver->plan()) plans.back() += ' ' + pass.name;
    Simulator simulator = simulator_of(shot);
    emitted_in(simulator, 4);
    end.push_back(simulator.particles());
  }
  EXPECT_TRUE(same(end[0], end[1]));
  EXPECT_FALSE(same(end[0], end[2]));
  EXPECT_EQ(plans[0], plans[1]);
  EXPECT_EQ(plans[0], plans[2]);
}

}  // namespace
}  // namespace drench
