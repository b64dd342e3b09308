// Closed meshes full of fluid, with level sets by OpenVDB.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "pipeline/contract/files/files.h"
#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "sim/setup/scene.h"
#include "sim/simulator.h"
#include "tests/contract/box_mesh.h"
#include "tests/contract/sphere_mesh.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using test::TemporaryFolder;

class Volume : public testing::Test {
 protected:
  Shot shot_of(const std::string& file, double spacing) const {
    Shot shot;
    shot.name = shot.file = "volume";
    shot.fluid.spacing = spacing;
    shot.domain.min = V3d(-1.5), shot.domain.max = V3d(1.5);
    FluidVolume volume;
    volume.mesh_file = folder_ / file;
    shot.fluid.volume.push_back(volume);
    return shot;
  }
  static sim::InitialFluid fill(const Shot& shot) {
    return sim::initial_fluid(shot, make_level_set);
  }
  static std::string refusal(const Shot& shot) {
    return test::error_of([&] { fill(shot); });
  }
  TemporaryFolder folder_;
};

// A box of whole cells on the lattice holds every one of them.
TEST_F(Volume, OfABoxOnTheLatticeIsTheBox) {
  test::write_box(folder_ / "box.obj", V3f(0.5f, 0.3f, 0.2f));
  Shot shot = shot_of("box.obj", 0.02), boxes = shot;
  shot.fluid.volume[0].position = V3d(-0.1, 0.1, -0.3);
  const sim::InitialFluid fluid = fill(shot);
  EXPECT_EQ(fluid.position.size(), size_t(25 * 15 * 10));
  boxes.fluid.volume.clear();
  boxes.fluid.box.push_back({V3d(-0.1, 0.1, -0.3), V3d(0.4, 0.4, -0.1), V3d(0)});
  double worst = 0;
  const std::vector<V3d> lattice = sim::initial_fluid(boxes).position;
  ASSERT_EQ(lattice.size(), fluid.position.size());
  for (size_t i = 0; i < lattice.size(); ++i)
    worst = std::max(worst, (lattice[i] - fluid.position[i]).length());
  EXPECT_LT(worst, 1e-9);
}

// Turned and scaled: every particle at least half a spacing inside the true planes, and every
// lattice place that deep is filled, but for the edges that the level set rounds off.
TEST_F(Volume, HoldsTheLatticePlacesHalfASpacingInside) {
  test::write_box(folder_ / "box.obj", V3f(0.5f, 0.3f, 0.2f));
  Shot shot = shot_of("box.obj", 0.02);
  FluidVolume& volume = shot.fluid.volume[0];
  volume.scale = 2, volume.position = V3d(0.05, 0.02, 0.01), volume.rotation_deg = V3d(30, 40, 50);
  Obstacle frame;
  frame.position = volume.position, frame.rotation_deg = volume.rotation_deg;
  const Pose pose = obstacle_pose(frame, 0);
  const V3d size(1, 0.6, 0.4);
  const auto depth = [&](const V3d& world) {
    const V3d own = pose.to_own(world);
    double least = 1e30;
    for (int k = 0; k < 3; ++k) least = std::min({least, own[k], size[k] - own[k]});
    return least;
  };
  const sim::InitialFluid fluid = fill(shot);
  for (const V3d& p : fluid.position) ASSERT_GT(depth(p), 0.49 * 0.02);
  size_t places = 0;
  for (int i = 0; i < 150 * 150 * 150; ++i) {
    const V3d p = V3d(i % 150 + 0.5, i / 150 % 150 + 0.5, i / 22500 + 0.5) * 0.02 + V3d(-1.5);
    places += depth(p) > 0.5 * 0.02;
  }
  EXPECT_LE(fluid.position.size(), places + places / 500);
  EXPECT_GT(fluid.position.size(), places - places / 100);
}

// 4/3 pi R^3 with inset 0, and of the radius less half a spacing with inset 0.5; three resolutions.
// Cells on the surface, 4 pi (R/a)^2 of them, count or not by chance: a few of their square root.
TEST_F(Volume, OfABallConvergesToItsVolume) {
  write_mesh(folder_ / "ball.ply", test::unit_sphere(96, 192));
  for (const double cells : {5., 10., 20.}) {
    Shot shot = shot_of("ball.ply", 1 / cells);
    shot.fluid.volume[0].position = V3d(0.013, -0.021, 0.007);
    for (const double inset : {0., 0.5}) {
      shot.fluid.volume[0].inset = inset;
      const double expected = 4 * M_PI / 3 * std::pow(cells - inset, 3);
      const double spread = 3 * std::sqrt(4 * M_PI) * cells;
      EXPECT_NEAR(double(fill(shot).position.size()), expected, spread) << cells << ' ' << inset;
    }
  }
}

// A drop in a pool loses what the pool has; nothing stands nearer than 0.9 spacings.
TEST_F(Volume, GivesWayToEarlierSources) {
  write_mesh(folder_ / "ball.ply", test::unit_sphere(24, 48));
  Shot shot = shot_of("ball.ply", 0.05);
  shot.fluid.volume[0].scale = 0.4, shot.fluid.volume[0].position = V3d(0.02, -0.5, 0.01);
  shot.fluid.box.push_back({V3d(-1.5, -1.5, -1.5), V3d(1.5, -0.5, 1.5), V3d(0)});
  const sim::InitialFluid fluid = fill(shot);
  EXPECT_GT(fluid.overlapping, 500u);
  shot.fluid.box.clear();
  EXPECT_EQ(fill(shot).overlapping, 0u);
}

TEST_F(Volume, FallsAsAllFluidDoes) {
  write_mesh(folder_ / "ball.ply", test::unit_sphere(24, 48));
  Shot shot = shot_of("ball.ply", 0.05);
  shot.timeline = {1001, 1003, 24};
  shot.fluid.volume[0].scale = 0.3, shot.fluid.volume[0].velocity = V3d(1, 0, 0);
  Simulator simulator(shot, {.device = Device::cpu, .level_set = make_level_set});
  const StepReport report = simulator.advance_frame();
  EXPECT_GT(report.particles, 500u);
  for (const V3f& v : simulator.particles().velocity) {
    EXPECT_NEAR(v.x, 1, 0.02);
    EXPECT_NEAR(v.y, -9.81 / 24, 0.03);
  }
}

TEST_F(Volume, ThatCannotBeFilledIsRefused) {
  write_file_whole(folder_ / "open.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\nf 1 3 4\n");
  EXPECT_NE(refusal(shot_of("open.obj", 0.05)).find("not closed"), std::string::npos);
  write_file_whole(folder_ / "none.obj", "v 0 0 0\n");
  EXPECT_NE(refusal(shot_of("none.obj", 0.05)).find("none.obj"), std::string::npos);
  write_file_whole(folder_ / "nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\n");
  EXPECT_NE(refusal(shot_of("nan.obj", 0.05)).find("nan.obj"), std::string::npos);
  test::write_box(folder_ / "box.obj", V3f(0.5f, 0.3f, 0.01f));
  EXPECT_NE(refusal(shot_of("box.obj", 0.05)).find("holds no particle"), std::string::npos);
  Shot far_off = shot_of("box.obj", 0.005);
  far_off.fluid.volume[0].position = V3d(1.2, 0, 0);
  EXPECT_NE(refusal(far_off).find("beyond the domain's walls"), std::string::npos);
  Shot huge = shot_of("box.obj", 0.005);
  huge.fluid.volume[0].scale = 1e4;
  EXPECT_NE(refusal(huge).find("smaller scale"), std::string::npos);
}

// A sink of the same file takes what the volume filled, and nothing else.
TEST_F(Volume, IsEmptiedByASinkOfItsMesh) {
  write_mesh(folder_ / "ball.ply", test::unit_sphere(24, 48));
  Shot shot = shot_of("ball.ply", 0.05);
  shot.gravity = V3d(0);
  shot.timeline = {1001, 1003, 24};
  shot.fluid.volume[0].scale = 0.3;
  shot.fluid.box.push_back({V3d(-1.5), V3d(-1, -1, -1), V3d(0)});
  Sink sink;
  sink.shape.type = ObstacleType::mesh, sink.shape.mesh_file = folder_ / "ball.ply";
  sink.shape.scale = 0.3;
  shot.sink.push_back(sink);
  Simulator simulator(shot, {.device = Device::cpu, .level_set = make_level_set});
  const StepReport report = simulator.advance_frame();
  EXPECT_EQ(report.particles, 1000u);
  EXPECT_GT(report.drained.at(0).second, 500u);
}

}  // namespace
}  // namespace drench
