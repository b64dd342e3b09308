// Inputs that cannot be simulated are refused with what, where, why and what to do.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "pipeline/contract/error.h"
#include "pipeline/contract/log.h"
#include "sim/simulator.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

/// The error that building and running one frame of a shot gives, or "none".
std::string error_of(const Shot& shot) {
  try {
    Simulator simulator(shot, {});
    simulator.advance_frame();
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

/// A cloth from an OBJ file with these lines.
std::string error_of_mesh(const std::string& lines) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("drench_input_" + std::to_string(::getpid()) + ".obj");
  std::ofstream(path) << lines;
  Shot shot = empty_shot();
  Cloth cloth;
  cloth.name = "flag", cloth.mesh_file = path;
  shot.cloth.push_back(cloth);
  const std::string error = error_of(shot);
  std::filesystem::remove(path);
  return error;
}

TEST(Input, AGoodMeshIsAccepted) {
  EXPECT_EQ(error_of_mesh("v 0 0 0\nv 0.1 0 0\nv 0 0 0.1\nv 0.1 0 0.1\nf 1 3 2\nf 2 3 4\n"),
            "none");
}

TEST(Input, ADegenerateTriangleIsNamed) {
  const std::string error =
      error_of_mesh("v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nv 0 0 0.1\nf 1 2 4\nf 1 2 3\n");
  EXPECT_SAYS(error, "flag");
  EXPECT_SAYS(error, "triangle 1");
  EXPECT_SAYS(error, "degenerate");
}

// Three triangles at one edge: two of them run along it in the same direction.
TEST(Input, ANonManifoldEdgeIsNamed) {
  const std::string error = error_of_mesh(
      "v 0 0 0\nv 0.1 0 0\nv 0 0 0.1\nv 0 0.1 0\nv 0 0 -0.1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n");
  EXPECT_SAYS(error, "flag");
  EXPECT_SAYS(error, "edge 0-1");
  EXPECT_SAYS(error, "not manifold");
}

TEST(Input, AnUnusedVertexIsLeftOutAndNamed) {
  forget_warnings();
  EXPECT_EQ(error_of_mesh("v 0 0 0\nv 0.1 0 0\nv 0 0 0.1\nv 1 2 3\nf 1 3 2\n"), "none");
  ASSERT_EQ(logged_warnings().size(), 1u);
  EXPECT_SAYS(logged_warnings()[0].text, "flag");
  EXPECT_SAYS(logged_warnings()[0].text, "vertex 3 at (1, 2, 3) m");
  forget_warnings();
}

TEST(Input, AMissingMeshFileIsNamed) {
  Shot shot = empty_shot();
  Cloth cloth;
  cloth.mesh_file = "/nowhere/flag.obj";
  shot.cloth.push_back(cloth);
  EXPECT_SAYS(error_of(shot), "/nowhere/flag.obj");
}

TEST(Input, APinThatHoldsNothingIsNamed) {
  Shot shot = empty_shot();
  Cloth& cloth = add_sheet(shot, 0.2, 0, 4);
  ClothPin pin;
  pin.box = {{V3d(5), V3d(6)}};
  cloth.pin.push_back(pin);
  EXPECT_SAYS(error_of(shot), "pin 1 holds no vertex");
  cloth.pin[0] = ClothPin{{25}, {}};  // a 4 x 4 grid has vertices 0 to 24
  EXPECT_SAYS(error_of(shot), "names vertex 25");
  cloth.pin[0] = ClothPin{{24}, {}};
  EXPECT_EQ(error_of(shot), "none");
}

TEST(Input, FluidInsideClothIsRefused) {
  Shot shot = empty_shot();
  add_box(shot, V3d(-0.05, -0.023, -0.05), {10, 4, 10});
  add_sheet(shot, 0.3, 0, 6).name = "towel";
  const std::string error = error_of(shot);
  EXPECT_SAYS(error, "test.toml");
  EXPECT_SAYS(error, "inside cloth \"towel\"");
  EXPECT_SAYS(error, "Move the fluid");
}

TEST(Input, NothingToSimulateIsRefused) {
  EXPECT_SAYS(error_of(empty_shot()), "nothing to simulate");
}

TEST(Input, AFixedStepAboveTheStableOneIsRefused) {
  Shot shot = empty_shot();
  add_box(shot, V3d(0), {4, 4, 4});
  shot.time_step = 0.05;
  const std::string error = error_of(shot);
  EXPECT_SAYS(error, "shot.time_step is 0.05 s");
  EXPECT_SAYS(error, "sound speed");
}

// Two blocks meet at 100 m/s in water whose sound is slower than a cyclist: no such flow exists.
TEST(Input, ABlowUpNamesFrameTimeParticleAndCheckpoint) {
  Shot shot = empty_shot();
  shot.fluid.sound_speed = 1;
  add_box(shot, V3d(0), {4, 4, 4}, V3d(100, 0, 0));
  const auto path =
      std::filesystem::temp_directory_path() / ("drench_blow_up_" + std::to_string(::getpid()));
  Simulator simulator(shot, {});
  simulator.write_checkpoint(path);
  std::string error = "none";
  try {
    simulator.advance_frame();
  } catch (const Error& caught) {
    error = caught.what();
  }
  std::filesystem::remove(path);
  EXPECT_SAYS(error, "blew up after frame 1001");
  EXPECT_SAYS(error, "t = 0.0");
  EXPECT_SAYS(error, "particle ");
  EXPECT_SAYS(error, path.string());
}

TEST(Input, AStopRequestLeavesAWholeState) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  add_box(shot, V3d(0), {4, 4, 4});
  Simulator simulator(shot, {});
  int asked = 0;
  EXPECT_THROW(simulator.advance_frame([&] { return ++asked < 5; }), Stopped);
  EXPECT_EQ(simulator.frame(), 1001);
  EXPECT_NO_THROW(simulator.advance_frame());
  EXPECT_EQ(simulator.frame(), 1002);
}

}  // namespace
}  // namespace drench::sim_tests
