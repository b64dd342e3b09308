// Light and heavy sheets, fine, coarse and graded ones, and meshes that are hardly any.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "pipeline/contract/error.h"
#include "sim/simulator.h"
#include "tests/stress/report.h"
#include "tests/stress/scenes.h"

namespace drench::stress_tests {
namespace {

class MassRatio : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Ratios, MassRatio, testing::Values(0.1, 1., 3., 10., 50., 200.));

TEST_P(MassRatio, NeitherBlowsUpNorLeaks) {
  Watch watch(fall_on_sheet(GetParam()));
  watch.until(long_form() ? 3 : 0.4);
  report("mass ratio", fmt::format("rho a / sigma = {}", GetParam()), watch);
}

class Stiffness : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Moduli, Stiffness, testing::Values(1., 1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
                         [](const auto& p) { return std::to_string(int(p.param)); });

// The softest are stretched down to the floor. Sheets have no stiffness in bending to vary.
TEST_P(Stiffness, NeitherBlowsUpNorLeaks) {
  Shot shot = fall_on_sheet(100);
  shot.cloth[0].adjacent_stiffness = GetParam(), shot.cloth[0].diagonal_stiffness = GetParam() / 2;
  Watch watch(shot);
  watch.until(long_form() ? 3 : 0.4);
  Gates gates;
  // Pressed onto the floor, a sheet that is stretched to 2.5 times its length folds: 15 m/s, as
  // fast as a vertex goes that hardly weighs anything.
  if (GetParam() < 100) gates = squeezed(), gates.speed = 10;
  // The one linear step of a flat sheet stretches it; with half the step 1.4 %, a quarter none.
  if (GetParam() > 1e4) gates.energy = 1.5e-6 * GetParam();
  report("stiffness", fmt::format("{:g} N/m", GetParam()), watch, gates);
}

class EdgeRatio : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Edges, EdgeRatio, testing::Values(0.25, 0.5, 1., 2., 4., 8., 16.),
                         [](const auto& p) { return std::to_string(int(100 * p.param)); });

// Edges of 16 spacings: a sheet of two cells has one vertex that is free.
TEST_P(EdgeRatio, NeitherBlowsUpNorLeaks) {
  const double a = 0.02, edge = GetParam() * a, half = std::max(8 * a, edge);
  Shot shot = fall_on_sheet(100, std::max(2, int(std::lround(16 / GetParam()))));
  shot.domain.min.x = shot.domain.min.z = -half, shot.domain.max.x = shot.domain.max.z = half;
  Cloth& sheet = shot.cloth[0];
  sheet.corner = V3d(-half, 0, -half), sheet.u.x = sheet.v.z = 2 * half;
  Watch watch(shot);
  watch.until(long_form() ? 1 : 0.3);
  report("resolution jump", fmt::format("edge / a = {}", GetParam()), watch);
}

/// Grid lines from a finest cell in the middle to cells `ratio` times as long at both ends.
std::vector<double> graded(int half_cells, double ratio) {
  std::vector<double> width, line{0};
  for (int k = 0; k < half_cells; ++k)
    width.push_back(std::pow(ratio, double(k) / (half_cells - 1)));
  for (int k = half_cells - 1; k >= 0; --k) line.push_back(line.back() + width[k]);
  for (int k = 0; k < half_cells; ++k) line.push_back(line.back() + width[k]);
  const double whole = line.back();
  for (double& x : line) x /= whole;
  return line;
}

TEST(Mesh, OfEdgesOneToFiftyNeitherBlowsUpNorLeaks) {
  const test::TemporaryFolder folder;
  Shot shot = fall_on_sheet(100);
  shot.cloth.clear();
  add_mesh(shot, square_mesh(0.32, 0, graded(10, 50)), folder);
  Watch watch(shot);
  watch.until(long_form() ? 1 : 0.3);
  report("resolution jump", "graded 1:50, edge / a = 0.06 to 2.9", watch);
}

/// What a mesh in the place of the sheet leads to: the message that refuses it, or "".
std::string refusal(const std::string& obj) {
  const test::TemporaryFolder folder;
  Shot shot = fall_on_sheet(100);
  Cloth& sheet = shot.cloth[0];
  sheet.name = "rag", sheet.mesh_file = folder / "rag.obj", sheet.pin.clear();
  std::ofstream(sheet.mesh_file) << obj;
  try {
    Simulator(shot, {}).advance_frame();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

void expect_refusal(const std::string& what, const std::string& obj,
                    const std::vector<std::string>& words) {
  const std::string said = refusal(obj);
  bool named = !said.empty();
  for (const std::string& word : words) named = named && said.find(word) != std::string::npos;
  report("degenerate input", what, named, named ? "refused: " + said.substr(0, 70) + "..." : said);
}

TEST(Degenerate, MeshesAreRefusedByName) {
  expect_refusal("triangle without area",
                 "v -.1 0 -.1\nv .1 0 -.1\nv 0 0 .1\nv .3 0 -.1\nf 1 3 2\nf 1 2 4\n",
                 {"\"rag\"", "triangle 1", "degenerate"});
  expect_refusal("inverted triangle",
                 "v 0 0 0\nv .1 0 0\nv 0 0 .1\nv .1 0 .1\nf 1 3 2\nf 2 3 4\nf 4 3 2\n",
                 {"\"rag\"", "triangle 2", "not manifold"});
  expect_refusal("three triangles at an edge",
                 "v 0 0 0\nv .1 0 0\nv 0 0 .1\nv 0 .1 0\nv 0 0 -.1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n",
                 {"\"rag\"", "edge 0-1", "not manifold"});
  expect_refusal("mesh without triangles", "v 0 0 0\nv .1 0 0\nv 0 0 .1\n", {"rag"});
  expect_refusal("coordinate that is not finite", "v 0 0 nan\nv .1 0 0\nv 0 0 .1\nf 1 3 2\n",
                 {"rag"});
  expect_refusal("vertex that does not exist", "v 0 0 0\nv .1 0 0\nv 0 0 .1\nf 1 3 9\n", {"rag"});
}

void run_mesh(const std::string& what, const TriangleMesh& mesh, const Gates& gates = {}) {
  const test::TemporaryFolder folder;
  Shot shot = fall_on_sheet(100);
  shot.cloth.clear();
  add_mesh(shot, mesh, folder);
  Watch watch(shot);
  watch.until(0.3);
  report("degenerate input", what, watch, gates);
}

// A strip of cells 1e-4 of their length wide across the middle of the sheet.
TEST(Degenerate, NeedlesAreHarmless) {
  const double cell = 1. / 16;
  std::vector<double> line;
  for (int k = 0; k <= 16; ++k) line.push_back(k * cell);
  line.insert(line.begin() + 9, 0.5 + 1e-4 * cell);
  run_mesh("needles, 1:10^4", square_mesh(0.32, 0, line));
}

TEST(Degenerate, ASingleTriangleIsHarmless) {
  TriangleMesh mesh;
  mesh.position = {V3f(-0.1f, 0, -0.1f), V3f(0.1f, 0, -0.1f), V3f(0, 0, 0.1f)};
  mesh.velocity.resize(3, V3f(0)), mesh.triangle.emplace_back(0, 2, 1);
  run_mesh("a single pinned triangle", mesh);
}

// Two halves that are not welded: both have a free edge at the seam, which opens.
TEST(Degenerate, AnUnweldedSeamIsASlit) {
  std::vector<double> line;
  for (int k = 0; k <= 16; ++k) line.push_back(k / 16.);
  TriangleMesh mesh = square_mesh(0.32, 0, line);
  for (uint32_t j = 0; j < 17; ++j) mesh.position.push_back(mesh.position[j * 17 + 8]);
  mesh.velocity.resize(mesh.position.size(), V3f(0));
  for (auto& t : mesh.triangle) {
    const float x = (mesh.position[t.x].x + mesh.position[t.y].x + mesh.position[t.z].x) / 3;
    for (int k = 0; k < 3; ++k)
      if (x > 0 && t[k] % 17 == 8 && t[k] < 289) t[k] = 289 + t[k] / 17;
  }
  run_mesh("vertices in the same place: an open seam", mesh);
}

}  // namespace
}  // namespace drench::stress_tests
