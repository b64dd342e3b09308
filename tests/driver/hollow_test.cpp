// Meshes with cavities as obstacle, volume, mesh emitter and sink, and what is far larger than the
// domain, with level sets by OpenVDB.

#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/geometry/level_set.h"
#include "sim/setup/scene.h"
#include "sim/simulator.h"
#include "tests/contract/shells_mesh.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using test::TemporaryFolder;

constexpr double a = 0.02;                  // m
constexpr double outer = 0.3, inner = 0.2;  // m, radii of the hollow ball

class Hollow : public testing::Test {
 protected:
  void SetUp() override {
    write_mesh(folder_ / "same.ply", test::joined(test::ball(outer), test::ball(inner)));
    write_mesh(folder_ / "opposite.ply",
               test::joined(test::ball(outer), test::reversed(test::ball(inner))));
  }
  Shot empty() const {
    Shot shot;
    shot.name = shot.file = "hollow";
    shot.timeline = {1001, 1005, 24};
    shot.fluid.spacing = a;
    shot.domain.min = V3d(-0.5), shot.domain.max = V3d(0.5);
    return shot;
  }
  Obstacle solid(const std::string& file) const {
    Obstacle obstacle;
    obstacle.type = ObstacleType::mesh, obstacle.name = "hollow";
    obstacle.mesh_file = folder_ / file;
    return obstacle;
  }
  static Simulator simulator_of(const Shot& shot) {
    return {shot, {.device = Device::cpu, .level_set = make_level_set}};
  }
  TemporaryFolder folder_;
};

size_t within(const ParticleFrame& frame, double low, double high) {
  size_t n = 0;
  for (const V3f& p : frame.position) n += p.length() >= float(low) && p.length() < float(high);
  return n;
}

/// Lattice places between two radii; each sphere's surface counts or not by chance.
double cells(double low, double high) {
  return 4 * M_PI / 3 * (std::pow(high, 3) - std::pow(low, 3)) / (a * a * a);
}

// Fluid that starts in the cavity stays there, what is in the wall is lost, what is outside stays
// outside.
TEST_F(Hollow, ObstacleHoldsFluidInItsCavity) {
  for (const char* file : {"same.ply", "opposite.ply"}) {
    Shot shot = empty();
    shot.obstacle.push_back(solid(file));
    shot.fluid.box.push_back({V3d(-0.1, -0.1, -0.1), V3d(0.1, 0, 0.1), V3d(0)});
    shot.fluid.box.push_back({V3d(-0.5, -0.5, -0.5), V3d(0.5, -0.3, -0.3), V3d(0)});
    Simulator simulator = simulator_of(shot);
    const size_t there = simulator.particles().position.size();
    EXPECT_EQ(within(simulator.particles(), 0, inner), 500u) << file;
    for (int k = 0; k < 4; ++k) simulator.advance_frame();
    EXPECT_EQ(within(simulator.particles(), 0, inner), 500u) << file;
    EXPECT_EQ(within(simulator.particles(), inner, outer), 0u) << file;
    EXPECT_EQ(simulator.particles().position.size(), there) << file;
  }
}

TEST_F(Hollow, VolumeFillsTheWallAlone) {
  Shot shot = empty();
  FluidVolume volume;
  volume.mesh_file = folder_ / "same.ply";
  shot.fluid.volume.push_back(volume);
  const ParticleFrame frame = simulator_of(shot).particles();
  EXPECT_EQ(within(frame, 0, inner), 0u);
  EXPECT_NEAR(double(frame.position.size()), cells(inner + 0.5 * a, outer - 0.5 * a), 300);
}

TEST_F(Hollow, EmitterKeepsTheWallFull) {
  Shot shot = empty();
  shot.gravity = V3d(0);
  FluidEmitter emitter;
  emitter.type = EmitterType::mesh, emitter.mesh_file = folder_ / "opposite.ply";
  shot.fluid.emitter.push_back(emitter);
  Simulator simulator = simulator_of(shot);
  simulator.advance_frame();
  EXPECT_EQ(within(simulator.particles(), 0, inner - 0.5 * a), 0u);
  EXPECT_NEAR(double(simulator.particles().position.size()),
              cells(inner + 0.5 * a, outer - 0.5 * a), 300);
}

TEST_F(Hollow, SinkTakesWhatIsInItsWall) {
  Shot shot = empty();
  shot.gravity = V3d(0);
  shot.fluid.box.push_back({V3d(-0.4), V3d(0.4), V3d(0)});
  Sink sink;
  sink.shape = solid("same.ply");
  shot.sink.push_back(sink);
  Simulator simulator = simulator_of(shot);
  const double drained = double(simulator.advance_frame().drained.at(0).second);
  EXPECT_NEAR(drained, cells(inner, outer), 0.05 * cells(inner, outer));
  EXPECT_NEAR(double(within(simulator.particles(), 0, inner)), cells(0, inner),
              0.05 * cells(0, inner));
}

std::string warnings(const Shot& shot) {
  std::string all;
  for (const std::string& one : sim::warnings_of(sim::build_scene(shot, make_level_set).report))
    all += one + "\n";
  return all;
}

// A mug of centimetres taken for metres around a small domain: what of it is there takes megabytes,
// and the word is said.
TEST_F(Hollow, HugeMeshIsMadeWhereTheDomainIs) {
  Shot shot = empty();
  shot.fluid.spacing = 0.01;
  shot.fluid.box.push_back({V3d(-0.1), V3d(0.1), V3d(0)});
  shot.obstacle.push_back(solid("same.ply"));
  shot.obstacle[0].scale = 100;
  const sim::Scene scene = sim::build_scene(shot, make_level_set);
  EXPECT_EQ(scene.start.id.size(), 8000u);  // the domain is in the cavity
  EXPECT_LT(scene.obstacles.level_set_bytes(), size_t(64) << 20);
  const std::string said = warnings(shot);
  EXPECT_NE(said.find("60 m wide in a domain of 1 m: are these centimetres? Set scale = 0.01"),
            std::string::npos)
      << said;
  shot.obstacle[0].position = V3d(25, 0, 0);  // the domain is in the wall
  const std::string refused = test::error_of([&] { warnings(shot); });
  EXPECT_NE(refused.find("all fluid of fluid.box[0] is lost"), std::string::npos) << refused;
  EXPECT_NE(refused.find("centimetres"), std::string::npos) << refused;
}

TEST_F(Hollow, MeshThatNoFluidMeetsIsNamed) {
  Shot shot = empty();
  shot.fluid.box.push_back({V3d(-0.1), V3d(0.1), V3d(0)});
  shot.obstacle.push_back(solid("same.ply"));
  shot.obstacle[0].position = V3d(2, 0, 0);
  EXPECT_NE(warnings(shot).find("obstacle \"hollow\" meets no fluid"), std::string::npos);
  shot.obstacle[0].position.keys = {{1001, V3d(2, 0, 0)}, {1003, V3d(0.5, 0, 0)}};
  EXPECT_EQ(warnings(shot), "");
}

// What a level set may take is known before it is taken.
TEST_F(Hollow, MeshThatNeedsMoreThanItsMemoryIsRefusedByName) {
  Shot shot = empty();
  shot.fluid.spacing = 0.005;
  shot.domain.axis[1] = Axis::periodic;  // all of it is needed
  shot.fluid.box.push_back({V3d(-0.1), V3d(0.1), V3d(0)});
  shot.obstacle.push_back(solid("same.ply"));
  shot.obstacle[0].scale = 100;
  const auto little = [](const TriangleMesh& mesh, double voxel, double band,
                         LevelSetBounds bounds) {
    bounds.most_bytes = 1 << 30;
    return make_level_set(mesh, voxel, band, bounds);
  };
  const std::string refused = test::error_of([&] { sim::build_scene(shot, little); });
  for (const char* word : {"obstacle \"hollow\"", "GiB", "more than the 1 GiB", "centimetres"})
    EXPECT_NE(refused.find(word), std::string::npos) << word << " in: " << refused;
}

}  // namespace
}  // namespace drench
