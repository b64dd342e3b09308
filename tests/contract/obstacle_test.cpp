// Obstacles of a shot: where they stand, what is drawn of them, their files and level sets.

#include "pipeline/contract/geometry/obstacle.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/shot_file.h"
#include "tests/contract/shells_mesh.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using test::TemporaryFolder;

constexpr const char* water =
    "[fluid]\nspacing = 0.02\n[[fluid.box]]\nmin = [0, 0, 0]\nmax = [0.1, 0.1, 0.1]\n";

Shot shot_of(const std::string& text, const std::filesystem::path& folder = ".") {
  return parse_shot(water + text, folder / "scene.toml");
}

std::string error_of(const std::string& text) {
  try {
    shot_of(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(ObstacleShot, LocksToTheSame) {
  const TemporaryFolder folder;
  write_mesh(folder / "ball.ply", test::unit_sphere(6, 8));
  const Shot shot = shot_of(
      "[[obstacle]]\ntype = \"plane\"\nnormal = [1, 1, 0]\n"
      "[[obstacle]]\ntype = \"box\"\nname = \"door\"\nsize = [1, 2, 3]\ninterp = \"smooth\"\n"
      "position = [[1001, [0, 0, 0]], [1010.5, [1, 0, 0]]]\nrotation_deg = [[1001, [0, 0, 0]], "
      "[1048, [0, 720, 0]]]\n"
      "[[obstacle]]\ntype = \"sphere\"\nradius = 0.25\nvisible = false\nmatte = "
      "\"holdout\"\n"
      "[[obstacle]]\ntype = \"mesh\"\nmesh = \"ball.ply\"\nscale = 0.1\n",
      folder.path());
  ASSERT_EQ(shot.obstacle.size(), 4u);
  EXPECT_EQ(shot.obstacle[2].name, "obstacle3");
  EXPECT_EQ(shot.obstacle[2].matte, Matte::holdout);
  EXPECT_EQ(shot.obstacle[1].rotation_deg.interpolation, Interpolation::smooth);
  EXPECT_EQ(shot_lock(parse_shot(shot_lock(shot), "shot.lock.toml")), shot_lock(shot));
}

TEST(ObstacleShot, SaysWhatCannotBe) {
  const std::string box = "[[obstacle]]\ntype = \"box\"\n";
  EXPECT_NE(error_of("[[obstacle]]\ntype = \"box\"\nradius = 1\n").find("type sphere"),
            std::string::npos);
  EXPECT_NE(error_of("[[obstacle]]\ntype = \"mesh\"\n").find("mesh is missing"), std::string::npos);
  EXPECT_NE(error_of(box + "interp = \"step\"\n").find("one of \"linear\", \"smooth\""),
            std::string::npos);
  EXPECT_NE(error_of("[[obstacle]]\ntype = \"plane\"\nmaterial = \"water\"\n")
                .find("a plane cannot have"),
            std::string::npos);
  EXPECT_NE(error_of("[[obstacle]]\ntype = \"mesh\"\nmesh = \"no.%04d.ply\"\n").find("no.1001.ply"),
            std::string::npos);
  EXPECT_NE(error_of("[[obstacle]]\ntype = \"plane\"\nnormal = [0, 0, 0]\n").find("no direction"),
            std::string::npos);
}

// About x first, then y, then z: the x axis turned by 90 degrees about y looks along -z, and that
// stays when z turns; the y axis by 90 about x looks along z, then along x, then along y.
TEST(ObstaclePose, TurnsAboutXThenYThenZ) {
  Obstacle box;
  box.position = V3d(1, 2, 3), box.rotation_deg = V3d(90, 90, 90);
  const Pose pose = obstacle_pose(box, 1001);
  EXPECT_LT((pose.axis[0] - V3d(0, 0, -1)).length(), 1e-12);
  EXPECT_LT((pose.axis[1] - V3d(0, 1, 0)).length(), 1e-12);
  EXPECT_LT((pose.to_own(pose.to_world(V3d(0.3, -2, 7))) - V3d(0.3, -2, 7)).length(), 1e-12);
}

// Between keys by frame, held before the first and after the last.
TEST(ObstaclePose, FollowsItsKeys) {
  Obstacle box;
  box.position.keys = {{1001, V3d(0)}, {1011, V3d(1, 0, 0)}};
  box.rotation_deg.keys = {{1001, V3d(0)}, {1011, V3d(0, 0, 720)}};
  EXPECT_DOUBLE_EQ(obstacle_pose(box, 990).position.x, 0);
  EXPECT_DOUBLE_EQ(obstacle_pose(box, 1003.5).position.x, 0.25);
  EXPECT_DOUBLE_EQ(obstacle_pose(box, 1012).position.x, 1);
  EXPECT_LT((obstacle_pose(box, 1003.5).axis[0] - V3d(-1, 0, 0)).length(), 1e-12);
  box.position.interpolation = Interpolation::smooth;
  EXPECT_DOUBLE_EQ(obstacle_pose(box, 1003.5).position.x, 3. / 16 - 2. / 64);
}

double volume_of(const TriangleMesh& mesh) {
  double six = 0;
  for (const auto& t : mesh.triangle)
    six += V3d(mesh.position[t.x]).dot(V3d(mesh.position[t.y]).cross(V3d(mesh.position[t.z])));
  return six / 6;
}

// What is drawn is what is simulated: volumes by the divergence theorem, velocity of a turning
// body omega x r.
TEST(ObstacleSurface, IsClosedOutwardAndMovesAsItsKeysSay) {
  Shot shot = shot_of(
      "[[obstacle]]\ntype = \"box\"\nsize = [1, 2, 3]\n"
      "rotation_deg = [[1001, [0, 0, 0]], [1025, [0, 0, 90]]]\n"
      "[[obstacle]]\ntype = \"sphere\"\nradius = 0.5\n");
  const TriangleMesh box = obstacle_surface(shot, shot.obstacle[0], 1013);
  EXPECT_NEAR(volume_of(box), 6, 1e-5);
  const double omega = M_PI / 2;  // a quarter turn in 24 frames, one second
  ASSERT_EQ(box.velocity.size(), box.position.size());
  for (size_t k = 0; k < box.position.size(); ++k) {
    const V3f p = box.position[k];
    EXPECT_LT((box.velocity[k] - V3f(float(-omega * p.y), float(omega * p.x), 0)).length(), 1e-4);
    EXPECT_NEAR(box.normal[k].length(), 1, 1e-6);
  }
  const TriangleMesh ball = obstacle_surface(shot, shot.obstacle[1], 1013);
  EXPECT_NEAR(volume_of(ball), M_PI / 6, 1e-3 * M_PI / 6);
  EXPECT_TRUE(ball.velocity.empty());
}

TriangleMesh moved(TriangleMesh mesh, const V3f& by) {
  for (V3f& p : mesh.position) p += by;
  return mesh;
}

TEST(ObstacleSequence, HasAFileForEveryFrameAndVelocityBetweenThem) {
  const TemporaryFolder folder;
  for (int frame = 1001; frame <= 1004; ++frame) {
    const auto d = float(frame - 1001);
    write_mesh(folder / ("ball." + std::to_string(frame) + ".ply"),
               moved(test::unit_sphere(6, 8), V3f(0.1f * d * d, 0, 0)));
  }
  const Shot shot = shot_of(
      "[shot]\nframes = [1001, 1004]\n[[obstacle]]\ntype = \"mesh\"\n"
      "mesh = \"ball.%04d.ply\"\n",
      folder.path());
  const Obstacle& ball = shot.obstacle[0];
  // (0.9 - 0.1) / 2 a frame at 1003, one-sided 0.1 at 1001; 24 frames a second.
  EXPECT_NEAR(obstacle_surface(shot, ball, 1003).velocity[5].x, 0.4 * 24, 1e-3);
  EXPECT_NEAR(obstacle_surface(shot, ball, 1001).velocity[5].x, 0.1 * 24, 1e-3);
  write_mesh(folder / "ball.1003.ply", test::unit_sphere(6, 9));
  EXPECT_THROW(obstacle_surface(shot, ball, 1003), Error);
}

/// A prism from z = 0 to 1 over a house whose roof's middle is `top` high and whose eaves are 1.
std::string house(float top) {
  std::string text;
  for (const int z : {0, 1})
    text += fmt::format("v 0 0 {0}\nv 2 0 {0}\nv 2 1 {0}\nv 1 {1} {0}\nv 0 1 {0}\n", z, top);
  text += "f 5 4 3 2 1\nf 6 7 8 9 10\n";
  for (int k = 0; k < 5; ++k)
    text += fmt::format("f {} {} {} {}\n", k + 1, (k + 1) % 5 + 1, (k + 1) % 5 + 6, k + 6);
  return text;
}

class HouseSequence : public testing::Test {
 protected:
  HouseSequence() {
    // A gable, flat, a valley: cut by itself each would have triangles of its own.
    for (int k = 0; k < 4; ++k) set(1001 + k, house(std::array{1.5f, 1.f, 0.5f, 0.1f}[size_t(k)]));
  }
  void set(int frame, const std::string& text) {
    test::write_quickly(folder_ / fmt::format("house.{}.obj", frame), text);
  }
  TemporaryFolder folder_;
  Shot shot() const {
    return shot_of(
        "[shot]\nframes = [1001, 1004]\n[[obstacle]]\ntype = \"mesh\"\n"
        "mesh = \"house.%04d.obj\"\n",
        folder_.path());
  }
};

TEST_F(HouseSequence, IsCutInEveryFrameAsInTheFirst) {
  const Shot shot = this->shot();
  check_obstacle_meshes(shot);
  const SequenceShape shape = read_sequence_shape(shot, shot.obstacle[0]);
  const TriangleMesh first = read_obstacle_mesh(shot, shot.obstacle[0], 1001, shape),
                     last = read_obstacle_mesh(shot, shot.obstacle[0], 1004, shape);
  EXPECT_EQ(first.triangle, last.triangle);
  EXPECT_EQ(last.position[3], V3f(1, 0.1f, 0));
  // The roof sinks by 1 m from 1001 to 1003.
  const TriangleMesh surface = obstacle_surface(shot, shot.obstacle[0], 1002);
  for (size_t v = 0; v < surface.position.size(); ++v)
    EXPECT_NEAR(surface.velocity[v].y, surface.position[v].x == 1 ? -0.5 * 24 : 0, 1e-3);
}

TEST_F(HouseSequence, IsRefusedForAnyOfItsFrames) {
  for (const auto& [text, reason] :
       {std::pair<std::string, std::string>{house(1) + "f 1 2 3\n", "not closed"},
        {"", "no faces"},
        {house(1) + "f 1 2 3\nf 3 2 1\n", "do not have the same triangles"},
        {house(1) + "f 1 2 3 17\n", "without its vertex"},
        {house(1) + "v 0 0 9\nf 1 2 3 11\n", "first frame does not have"}}) {
    set(1003, text);
    try {
      check_obstacle_meshes(shot());
      ADD_FAILURE() << reason;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("house."), std::string::npos) << error.what();
    }
  }
}

// The eave at (0, 1) sinks to the ground in one frame: its wall opens again in the next.
TEST_F(HouseSequence, KeepsTrianglesThatCollapseInAFrame) {
  std::string flat = house(1.5f);
  for (const int z : {0, 1}) {
    const std::string eave = fmt::format("v 0 1 {}\n", z);
    flat.replace(flat.find(eave), eave.size(), fmt::format("v 0 0 {}\n", z));
  }
  for (const int collapsed : {1001, 1002}) {
    set(1001, house(1.5f));
    set(collapsed, flat);
    check_obstacle_meshes(shot());
  }
}

TEST(ObstacleMesh, HasNoTrianglesWithTwoCornersAtOnePlace) {
  const TemporaryFolder folder;
  test::write_box(folder / "box.obj", V3f(1));
  const std::string box = read_text(folder / "box.obj");
  // Of one vertex twice; of two at one place, also as the poles of spheres are split.
  for (const std::string more : {"f 1 1 2\n", "f 3 3 3\n", "v 0 0 0\nf 1 9 2\nf 9 1 2\n",
                                 "v 5 5 5\nf 9 9 9\n", "v nan 0 0\nf 1 1 2\n"}) {
    forget_warnings();
    test::write_quickly(folder / "more.obj", box + more);
    const TriangleMesh mesh = read_closed_mesh(folder / "more.obj", 1);
    EXPECT_EQ(mesh.triangle.size(), 12u) << more;
    EXPECT_EQ(mesh.position.size(), 8u) << more;
    ASSERT_FALSE(logged_warnings().empty()) << more;
    EXPECT_NE(logged_warnings()[0].text.find("with two corners at one place"), std::string::npos);
  }
  forget_warnings();
  test::write_quickly(folder / "point.obj", "v 0 0 0\nv 1 0 0\nf 1 1 2\n");
  EXPECT_THROW(read_closed_mesh(folder / "point.obj", 1), Error);
  forget_warnings();
}

// What the simulation takes as one body is no glass of one piece: a picture counts faces.
TEST(ObstacleMesh, OfGlassIsWarnedOfWhereShellsMeet) {
  const TemporaryFolder folder;
  write_mesh(folder / "one.ply", test::box_mesh(V3f(0), V3f(1)));
  write_mesh(folder / "two.ply", test::joined(test::box_mesh(V3f(0), V3f(1)),
                                              test::box_mesh(V3f(1, 0, 0), V3f(2, 1, 1))));
  for (const std::string file : {"one", "two"}) {
    for (const std::string type : {"diffuse", "dielectric"}) {
      forget_warnings();
      check_obstacle_meshes(shot_of("[[material]]\nname = \"m\"\ntype = \"" + type +
                                        "\"\n[[obstacle]]\ntype = \"mesh\"\nmaterial = \"m\"\n"
                                        "mesh = \"" +
                                        file + ".ply\"\n",
                                    folder.path()));
      EXPECT_EQ(logged_warnings().size(), file == "two" && type == "dielectric" ? 1u : 0u);
    }
  }
  forget_warnings();
}

TEST(ObstacleMesh, IsTurnedOutward) {
  const TemporaryFolder folder;
  TriangleMesh inward = test::unit_sphere(6, 8);
  for (auto& t : inward.triangle) std::swap(t.y, t.z);
  write_mesh(folder / "inward.ply", inward);
  EXPECT_EQ(read_closed_mesh(folder / "inward.ply", 1).triangle, test::unit_sphere(6, 8).triangle);
}

TEST(ObstacleMesh, MustBeClosed) {
  const TemporaryFolder folder;
  TriangleMesh open = test::unit_sphere(6, 8);
  open.triangle.pop_back();
  write_mesh(folder / "open.ply", open);
  const Shot shot = shot_of("[[obstacle]]\ntype = \"mesh\"\nmesh = \"open.ply\"\n", folder.path());
  try {
    read_obstacle_mesh(shot, shot.obstacle[0], 1001, {});
    ADD_FAILURE() << "an open mesh was taken";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("not closed"), std::string::npos);
  }
}

}  // namespace
}  // namespace drench
