// What cloth files hold of a sheet besides its motion: numbers, rest shape, strain, contacts.

#include <gtest/gtest.h>

#include <cmath>

#include "sim/cloth_frames.h"
#include "sim/simulator.h"
#include "tests/same_bits.h"
#include "tests/sim/same_state.h"
#include "tests/sim/shell_run.h"
#include "tests/sim/support.h"
#include "tests/temporary_folder.h"

namespace drench::sim_tests {
namespace {

using test::TemporaryFolder;

/// A sheet of 0.4 m in x, z, warp along x, of 1000 N/m and no Poisson ratio, alone.
Shot sheet_alone() {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  Cloth& sheet = add_sheet(shot, 0.4, 0, 8);
  sheet.model = ClothModel::shell, sheet.write_strain = true;
  sheet.young_warp = 1000, sheet.young_weft = 500, sheet.shear_modulus = 300, sheet.poisson = 0;
  sheet.stretch_limit = 10;
  return shot;
}

/// The sheet's frame with every vertex where `moved` puts it.
template <class Moved>
TriangleMesh frame_of(const Shot& shot, const Moved& moved) {
  const sim::Scene scene = sim::build_scene(shot);
  sim::HostState state = scene.start;
  for (size_t v = 0; v < state.cloth_position.size(); ++v) {
    const V3d x = moved(at(state.cloth_position, v));
    state.cloth_position.x[v] = float(x.x), state.cloth_position.y[v] = float(x.y);
    state.cloth_position.z[v] = float(x.z);
  }
  state.shell_landed = state.shell_rounding = state.cloth_position;
  for (auto* c : {&state.shell_rounding.x, &state.shell_rounding.y, &state.shell_rounding.z})
    std::fill(c->begin(), c->end(), 0.f);
  return sim::cloth_frames(shot, scene, state).front().mesh;
}

void expect_all_near(const std::vector<float>& column, size_t size, double value, double error) {
  ASSERT_EQ(column.size(), size);
  for (const float one : column) ASSERT_NEAR(one, value, error);
}

TEST(ClothFrames, HoldWhatAShotAndATextureNumberAVertexBy) {
  Shot shot = sheet_alone();
  shot.cloth[0].write_strain = false;
  const TriangleMesh mesh = Simulator(shot, {}).cloth().front().mesh;
  ASSERT_EQ(mesh.id.size(), 81u);
  for (uint32_t v = 0; v < 81; ++v) {
    EXPECT_EQ(mesh.id[v], v);
    EXPECT_LT((mesh.rest_position[v] - mesh.position[v]).length(), 1e-6f);  // snapped
    EXPECT_EQ(mesh.uv[v], Imath::V2f(float(v % 9) / 8, float(v / 9) / 8));
  }
  EXPECT_TRUE(mesh.strain_max.empty());
}

// Vertices that no triangle has are left out; the others keep their file's numbers.
TEST(ClothFrames, KeepTheNumbersOfAMeshFile) {
  const TemporaryFolder folder;
  test::write_quickly(folder / "sheet.obj",
                      "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 5 5 5\nv 1 0 1\nv 0 0 1\n"
                      "f 2 6 5\nf 2 5 3\n");
  Shot shot = empty_shot();
  Cloth cloth;
  cloth.mesh_file = folder / "sheet.obj";
  shot.cloth.push_back(cloth);
  const TriangleMesh mesh = Simulator(shot, {}).cloth().front().mesh;
  EXPECT_EQ(mesh.id, (std::vector<uint32_t>{1, 2, 4, 5}));
}

// Stretched by l along warp: E = (l^2 - 1)/2, S = 1000 N/m E, and Cauchy's stress l^2 S / l.
TEST(ClothFrames, StrainAndStressOfAStretchedSheetAreThoseOfItsLaw) {
  const double l = 1.1;
  const TriangleMesh mesh = frame_of(sheet_alone(), [&](V3d x) {
    return V3d(x.x * l, 0.6 * x.z, 0.8 * x.z);  // and turned about warp
  });
  expect_all_near(mesh.strain_max, 81, 0.1, 1e-5);
  expect_all_near(mesh.strain_min, 81, 0, 1e-5);
  expect_all_near(mesh.stress_max, 81, l * 1000 * (l * l - 1) / 2, 1e-2);
  expect_all_near(mesh.stress_min, 81, 0, 1e-2);
}

// Along the diagonals simple shear g has the stretches sqrt(1 + g^2/4) +- g/2.
TEST(ClothFrames, PrincipalStrainsAreFoundOffTheFabricsAxes) {
  const double g = 0.2;
  const TriangleMesh mesh =
      frame_of(sheet_alone(), [&](V3d x) { return V3d(x.x + g * x.z, x.y, x.z); });
  const double mean = std::sqrt(1 + g * g / 4);
  expect_all_near(mesh.strain_max, 81, mean + g / 2 - 1, 1e-5);
  expect_all_near(mesh.strain_min, 81, mean - g / 2 - 1, 1e-5);
}

// A sheet of w = 2 N/m^2 that hangs 0.4 m long bears w times what is below; cells are 5 cm, and
// means of triangles lie up to a third of one off their vertex.
TEST(ClothFrames, StressOfAHangingSheetIsTheWeightBelow) {
  Shot shot = sheet_alone();
  shot.gravity = V3d(0, -9.81, 0);
  Cloth& sheet = shot.cloth[0];
  sheet.areal_density = 2 / 9.81, sheet.damping = 20;
  sheet.v = V3d(0, -0.4, 0);
  ClothPin pin;
  for (uint32_t i = 0; i < 9; ++i) pin.vertices.push_back(i);
  sheet.pin.push_back(pin);
  Stepper run(shot);
  run.advance(1.5);
  const TriangleMesh mesh = sim::cloth_frames(shot, run.scene, run.solver->save()).front().mesh;
  for (size_t v = 9; v < 72; ++v) {
    const double below = 0.4 - 0.05 * double(v / 9);
    EXPECT_NEAR(mesh.stress_max[v], 2 * below, 2 * 0.05 / 3) << v;
    EXPECT_NEAR(mesh.strain_max[v], mesh.stress_max[v] / 500, 1e-5) << v;
  }
}

TEST(ClothFrames, OfStrainHaveTheSameBitsOnThreadsAndResumed) {
  Shot shot = sheet_alone();
  shot.gravity = V3d(0, -9.81, 0);
  shot.cloth[0].pin = {{.vertices = {0, 8}, .box = {}}};
  shot.timeline = {1, 10, 60};
  const TemporaryFolder folder;
  Simulator whole(shot, {});
  whole.advance_frame(), whole.advance_frame();
  whole.write_checkpoint(folder / "middle");
  whole.advance_frame(), whole.advance_frame();
  const TriangleMesh mesh = whole.cloth().front().mesh;
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  Simulator resumed(shot, {});
  resumed.read_checkpoint(folder / "middle");
  resumed.advance_frame(), resumed.advance_frame();
  test::expect_same_bits(resumed.cloth().front().mesh, mesh);
}

/// Sheets of 0.2 m in the air over a box whose top is at 0.
Shot sheets_over_box(std::initializer_list<double> heights) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  shot.gravity = V3d(0, -9.81, 0), shot.timeline = {1, 100, 60};
  for (const double height : heights) {
    Cloth& sheet = add_sheet(shot, 0.2, height, 8);
    sheet.model = ClothModel::shell, sheet.name = "sheet" + std::to_string(shot.cloth.size());
  }
  Obstacle box;
  box.position = V3d(0, -0.1, 0), box.size = V3d(0.5, 0.2, 0.5);
  shot.obstacle.push_back(box);
  return shot;
}

TEST(ClothContacts, AreCountedOnceThereIsContact) {
  Simulator above(sheets_over_box({0.3, 0.4}), {});
  const sim::ClothContacts none = above.advance_frame().cloth_contacts;
  EXPECT_EQ(none.sheets, 0u);
  EXPECT_EQ(none.obstacles, 0u);

  Simulator on(sheets_over_box({0.006, 0.0065}), {});
  sim::ClothContacts count;
  for (int k = 0; k < 20; ++k) count = on.advance_frame().cloth_contacts;
  EXPECT_GT(count.sheets, 40u);
  EXPECT_GT(count.obstacles, 40u);
}

}  // namespace
}  // namespace drench::sim_tests
