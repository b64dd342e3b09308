// Obstacles of type mesh from file to flow: OpenVDB's level sets in the simulator.

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <fstream>

#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/shot/shot_file.h"
#include "pipeline/driver/keys.h"
#include "sim/passes/obstacle/obstacle_distance.h"
#include "sim/simulator.h"
#include "tests/contract/box_mesh.h"
#include "tests/contract/sphere_mesh.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using test::TemporaryFolder;

sim::cpu::FieldView view_of(const LevelSet& set) {
  sim::cpu::FieldView view = sim::cpu::field_view(set);
  view.block = set.block.data(), view.value = set.value.data();
  return view;
}

// |x| - 1 within a voxel, in every block; plus or minus the band beyond it.
TEST(LevelSetBlocks, HoldTheDistanceToASphere) {
  const double voxel = 0.05, band = 0.2;
  const LevelSet set = make_level_set(test::unit_sphere(128, 256), voxel, band);
  const sim::cpu::FieldView at = view_of(set);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const double z = -1 + 2 * (i + 0.5) / 20000, phi = 2.399963 * i;
    const double radius = 1 + 0.95 * voxel * std::sin(0.37 * i),
                 ring = radius * std::sqrt(1 - z * z);
    const float d =
        at({float(ring * std::cos(phi)), float(ring * std::sin(phi)), float(radius * z)});
    worst = std::max(worst, std::abs(double(d) - (radius - 1)));
  }
  // The mesh is 3e-4 off, a curved distance between corners voxel^2 / 8 an axis across.
  EXPECT_LT(worst, 3e-4 + 2 * voxel * voxel / 8 / 0.75);
  EXPECT_FLOAT_EQ(at({0, 0, 0}), float(-band));
  EXPECT_FLOAT_EQ(at({0, 1.7f, 0}), float(band));
  EXPECT_FLOAT_EQ(at({300, 0, 0}), float(band));
}

TEST(LevelSetBlocks, HaveTheSameBitsForAnyNumberOfThreads) {
  const tbb::global_control cores(tbb::global_control::max_allowed_parallelism, 8);
  std::vector<LevelSet> made;
  for (const int threads : {1, 8}) {
    tbb::task_arena arena(threads);
    arena.execute([&] { made.push_back(make_level_set(test::unit_sphere(60, 90), 0.03, 0.15)); });
  }
  EXPECT_EQ(made[0].block, made[1].block);
  EXPECT_EQ(made[0].value, made[1].value);
}

/// Water that falls on an obstacle made of a file, 2,000 particles.
Shot falling_on(const Obstacle& obstacle) {
  Shot shot;
  shot.name = shot.file = "falling";
  shot.timeline = {1001, 1013, 24};
  shot.fluid.spacing = 0.02;
  shot.domain.min = V3d(-0.2, 0, -0.2), shot.domain.max = V3d(0.2, 1, 0.2);
  shot.fluid.box.push_back({.min = V3d(-0.14, 0.3, -0.14), .max = V3d(0.14, 0.5, 0.14)});
  shot.obstacle.push_back(obstacle);
  return shot;
}

// The guard works on the level set; the count is made with the mesh's own planes, in double.
TEST(MeshObstacle, OfABoxLetsNoParticleIn) {
  const TemporaryFolder folder;
  Obstacle block;
  block.type = ObstacleType::mesh, block.mesh_file = folder / "block.ply";
  block.position = V3d(0.01, 0.12, 0), block.rotation_deg = V3d(45, 30, 20);
  const V3f size(0.12f, 0.06f, 0.2f);
  write_mesh(block.mesh_file, test::box_mesh(-size / 2, size / 2));
  Simulator simulator(falling_on(block), {.device = Device::cpu, .level_set = make_level_set});
  const Pose pose = obstacle_pose(block, 1001);
  size_t hits = 0;
  for (int frame = 0; frame < 12; ++frame) {
    simulator.advance_frame();
    for (const V3f& p : simulator.particles().position) {
      const V3d own = pose.to_own(V3d(p));
      const double d = std::max({std::abs(own.x) - 0.5 * size.x, std::abs(own.y) - 0.5 * size.y,
                                 std::abs(own.z) - 0.5 * size.z});
      ASSERT_GT(d, 0) << "frame " << 1002 + frame;
      hits += d < 0.02;
    }
  }
  EXPECT_GT(hits, 100u);  // it was met
}

/// A ball about (0, 0.1, 0) as a sequence of 13 frames. @param radius  m, of the frame.
template <class Radius>
Obstacle swelling_ball(const TemporaryFolder& folder, const Radius& radius) {
  for (int frame = 1001; frame <= 1013; ++frame) {
    TriangleMesh ball = test::unit_sphere(24, 48);
    for (V3f& p : ball.position) p *= float(radius(frame));
    write_mesh(folder / ("ball." + std::to_string(frame) + ".ply"), ball);
  }
  Obstacle ball;
  ball.type = ObstacleType::mesh, ball.mesh_file = folder / "ball.%d.ply";
  ball.position = V3d(0, 0.1, 0);
  return ball;
}

// A ball of a sequence that swells from 4 to 9 cm in half a second, in water: none in it.
TEST(MeshObstacle, OfASequenceLetsNoParticleInWhereItSwells) {
  const TemporaryFolder folder;
  const auto radius = [](double frame) { return 0.04 + 0.05 * (frame - 1001) / 12; };
  const Obstacle ball = swelling_ball(folder, radius);
  Shot shot = falling_on(ball);
  shot.fluid.box[0].min = V3d(-0.2, 0, -0.2), shot.fluid.box[0].max = V3d(0.2);
  Simulator simulator(shot, {.device = Device::cpu, .level_set = make_level_set});
  const auto top = [&] {
    double sum = 0;
    const ParticleFrame frame = simulator.particles();
    for (const V3f& p : frame.position) sum += p.y;
    return sum / double(frame.position.size());
  };
  const double before = top();
  for (int frame = 1002; frame <= 1013; ++frame) {
    simulator.advance_frame();
    for (const V3f& p : simulator.particles().position)  // the mesh's facets lie 0.2 % inside
      ASSERT_GT((V3d(p) - ball.position.at(0)).length(), 0.99 * radius(frame)) << frame;
  }
  EXPECT_GT(top(), before);  // water made room
}

// Every frame is cut by the polygons of the first, so that this is an input of all of them.
TEST(MeshObstacle, OfASequenceDependsOnItsFrameAndTheFirst) {
  const TemporaryFolder folder;
  Shot shot = falling_on(swelling_ball(folder, [](int) { return 0.05; }));
  shot.timeline = {1001, 1013, 24};
  const auto inputs = [&](int frame) {
    return sequence_inputs(targets_of(shot, {1001}, {Step::mesh}, "cpu"), frame, frame);
  };
  const InputDigests third = inputs(1003), last = inputs(1013);
  EXPECT_EQ(third, inputs(1003));
  write_mesh(folder / "ball.1003.ply", test::unit_sphere(8, 16));
  EXPECT_NE(third, inputs(1003));
  EXPECT_EQ(last, inputs(1013));
  write_mesh(folder / "ball.1001.ply", test::unit_sphere(8, 16));
  EXPECT_NE(last, inputs(1013));
}

// A sheet that bears water is lifted as a ball of a sequence swells below it: no vertex and no
// particle is in the ball, and a run that is taken up has the same bits.
TEST(MeshObstacle, OfASequenceLiftsTheSheetAboveIt) {
  const TemporaryFolder folder;
  const auto radius = [](double frame) { return 0.06 + 0.05 * (frame - 1001) / 12; };
  const Obstacle ball = swelling_ball(folder, radius);
  Shot shot = falling_on(ball);
  Cloth sheet;
  sheet.corner = V3d(-0.19, 0.18, -0.19), sheet.u = V3d(0.38, 0, 0), sheet.v = V3d(0, 0, 0.38);
  sheet.cells = V2i(16, 16);
  for (const double side : {-0.19, 0.19}) {
    sheet.pin.push_back({{}, {{V3d(side - 1e-3, 0, -1), V3d(side + 1e-3, 1, 1)}}});
    sheet.pin.push_back({{}, {{V3d(-1, 0, side - 1e-3), V3d(1, 1, side + 1e-3)}}});
  }
  shot.cloth.push_back(sheet);
  shot.fluid.box[0].min = V3d(-0.1, 0.2, -0.1), shot.fluid.box[0].max = V3d(0.1, 0.3, 0.1);
  const SimulatorOptions options{.device = Device::cpu, .level_set = make_level_set};
  Simulator whole(shot, options), second(shot, options);
  for (int frame = 1002; frame <= 1013; ++frame) {
    whole.advance_frame();
    for (const V3f& p : whole.particles().position)
      ASSERT_GT((V3d(p) - ball.position.at(0)).length(), 0.99 * radius(frame)) << frame;
    const std::vector<ClothFrame> sheets = whole.cloth();
    for (const V3f& p : sheets[0].mesh.position)
      ASSERT_GT((V3d(p) - ball.position.at(0)).length(), radius(frame)) << frame;
    if (frame == 1006) whole.write_checkpoint(folder / "at.ckpt");
  }
  EXPECT_GT(whole.cloth()[0].mesh.position[8 * 17 + 8].y, 0.1 + radius(1013));
  second.read_checkpoint(folder / "at.ckpt");
  for (int frame = 1007; frame <= 1013; ++frame) second.advance_frame();
  EXPECT_EQ(whole.particles().position, second.particles().position);
  EXPECT_EQ(whole.cloth()[0].mesh.position, second.cloth()[0].mesh.position);
  EXPECT_EQ(whole.cloth()[0].mesh.velocity, second.cloth()[0].mesh.velocity);
}

// State, level sets and blends all follow from the time: a run that is taken up has the same bits.
TEST(MeshObstacle, AResumedRunHasTheSameBits) {
  const TemporaryFolder folder;
  for (int frame = 1001; frame <= 1013; ++frame) {
    TriangleMesh ball = test::unit_sphere(12, 16);
    for (V3f& p : ball.position) p = p * 0.08f + V3f(0.01f * float(frame - 1001), 0, 0);
    write_mesh(folder / ("ball." + std::to_string(frame) + ".ply"), ball);
  }
  Obstacle ball;
  ball.type = ObstacleType::mesh, ball.mesh_file = folder / "ball.%04d.ply";
  ball.position.keys = {{1001, V3d(0, 0.1, 0)}, {1013, V3d(0, 0.14, 0)}};
  const Shot shot = falling_on(ball);
  const SimulatorOptions options{.device = Device::cpu, .level_set = make_level_set};
  Simulator whole(shot, options), first(shot, options), second(shot, options);
  for (int k = 0; k < 8; ++k) whole.advance_frame();
  for (int k = 0; k < 5; ++k) first.advance_frame();
  first.write_checkpoint(folder / "at.ckpt");
  second.read_checkpoint(folder / "at.ckpt");
  for (int k = 0; k < 3; ++k) second.advance_frame();
  const ParticleFrame a = whole.particles(), b = second.particles();
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.velocity, b.velocity);
  EXPECT_EQ(a.density, b.density);
}

/// A plane is drawn as wide as the domain; other pictures know nothing of that.
TEST(PlaneObstacle, IsDrawnAnewInAnotherDomain) {
  const TemporaryFolder folder;
  const auto key = [&](const std::string& type, const std::string& max) {
    std::ofstream(folder / "ball.toml") << "[domain]\nmax = " << max
                                        << "\n[[fluid.sphere]]\ncenter = [0, 1, 0]\nradius = 0.1\n"
                                           "[[obstacle]]\nname = \"o\"\ntype = \""
                                        << type << "\"\nposition = [0, 0.1, 0]\n";
    return targets_of(read_shot(folder / "ball.toml", {}), {1001}, {Step::render}, "cpu")
        .render.digest;
  };
  EXPECT_NE(key("plane", "[1, 2, 1]"), key("plane", "[1, 3, 1]"));
  EXPECT_EQ(key("sphere", "[1, 2, 1]"), key("sphere", "[1, 3, 1]"));
}

}  // namespace
}  // namespace drench
