// Shells that come to rest in the simulator, from shot files, against closed forms and converged
// solutions (tests/validation/README.md). Shapes that a tenth of a percent of a force moves are
// told by the sheet's elastic energy alone: ShellStatics tests those forces, these tests the steps.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/sim/shell_run.h"

namespace drench::sim_tests {
namespace {

constexpr double g = 9.81;

bool near_zero(double x) { return std::abs(x) < 1e-9; }

/// Elongation over length of a sheet that hangs by its edge, w L / (E h) = load: the tension
/// w (L - s) is lambda (lambda^2 - 1) / 2 E h.
double hanging_elongation(double load) {
  const int n = 2000;
  double sum = 0;
  for (int k = 0; k < n; ++k) {
    const double pull = load * (k + 0.5) / n;
    double stretch = 1 + pull;
    for (int i = 0; i < 30; ++i)
      stretch -= (stretch * (stretch * stretch - 1) / 2 - pull) / ((3 * stretch * stretch - 1) / 2);
    sum += (stretch - 1) / n;
  }
  return sum;
}

double hung(SheetMesh mesh, int cells, double load) {
  const double length = 0.5;
  ShellSheet sheet{.mesh = mesh, .size = {length, 0.25, cells}};
  sheet.along = V3d(0, -1, 0), sheet.across = V3d(1, 0, 0);
  sheet.young = sheet.areal_density * g * length / load, sheet.bend = 1e-6;
  sheet.damping = 4 / std::sqrt(load);
  sheet.held = [](V3d x) { return near_zero(x.x); };
  ShellRun run(sheet);
  run.advance(40 * std::sqrt(load));
  const double tip = run.mean([&](V3d x) { return near_zero(x.x - length); }).y;
  printf("hang mesh %d cells %d steps %d\n", int(mesh), cells, int(run.steps));
  return -tip / length - 1;
}

TEST(ShellRest, AHangingSheetStretchesAsItsClosedForm) {
  const double load = 0.01, exact = hanging_elongation(load);
  for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::union_jack, SheetMesh::equilateral,
                               SheetMesh::unstructured})
    for (const int cells : {4, 8, 16}) {
      const double found = hung(mesh, cells, load);
      printf("  error %.4f %%\n", 100 * (found / exact - 1));
      EXPECT_NEAR(found / exact, 1, 1e-3) << int(mesh) << " " << cells;
    }
}

double strip_sag(SheetMesh mesh, int cells, double arc) {
  const double span = 0.5;
  ShellSheet sheet{.mesh = mesh, .size = {arc * span, 0.1 * span, cells}};
  sheet.young = 1e4 * sheet.areal_density * g * span, sheet.bend = 1e-6 * sheet.areal_density * g * span * span * span;
  sheet.damping = 20;
  const double length = sheet.size.length;
  sheet.held = [=](V3d x) { return near_zero(x.x) || near_zero(x.x - length); };
  ShellRun run(sheet);
  std::vector<V3d> x = run.places();
  for (size_t v = 0; v < run.size(); ++v) {
    const double s = run.flat(v).x / length;
    x[v] = V3d(s * span, -1.2 * s * (1 - s) * span, x[v].z);
  }
  run.start_from(x, std::vector<V3d>(run.size(), V3d(0)));
  run.advance(1.5);
  double lowest = 0;
  for (const V3d& p : run.places()) lowest = std::min(lowest, p.y);
  printf("catenary mesh %d cells %d steps %d\n", int(mesh), cells, int(run.steps));
  return -lowest / span;
}

TEST(ShellRest, ALimpStripHangsInACatenary) {
  double exact = 0;
  for (const auto& row : read_validation("catenary.csv"))
    if (row[0] == "1.2") exact = std::stod(row[2]);
  for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::unstructured})
    for (const int cells : {16, 32, 64}) {
      const double found = strip_sag(mesh, cells, 1.2);
      printf("  error %.4f %%\n", 100 * (found / exact - 1));
    }
}

/// Drop over span of a cantilever that comes to rest.
double drop_over_span(SheetMesh mesh, int cells, double gamma, double slenderness) {
  const double length = 0.2;
  ShellSheet sheet{.mesh = mesh, .size = {length, 0.1 * length, cells, 1}};
  const double weight = sheet.areal_density * g;
  sheet.bend = weight * length * length * length / gamma;
  sheet.young = 12 * sheet.bend * slenderness * slenderness / (length * length);
  const double omega = 3.516 * std::sqrt(g / (gamma * length)) + 0.5 * std::sqrt(g / length);
  sheet.damping = 1.5 * omega;
  sheet.held = [](V3d x) { return x.x < 1e-9; };
  ShellRun run(sheet);
  run.advance(15 / omega);
  const V3d tip = run.mean([&](V3d x) { return near_zero(x.x - length); });
  double speed = 0;
  for (const V3d& u : run.velocities()) speed = std::max(speed, u.length());
  printf("cantilever mesh %d cells %d gamma %g steps %d iterations %.0f speed %g\n", int(mesh), cells, gamma, int(run.steps), double(run.limits.sheet_sweeps), speed);
  return -tip.y / tip.x;
}

TEST(ShellRest, ACantileverDropsAsTheElastica) {
  for (const auto& row : read_validation("cantilever_heavy_elastica.csv")) {
    if (row[0] != "1" && row[0] != "10" && row[0] != "100") continue;
    const double gamma = std::stod(row[0]), exact = std::stod(row[3]);
    for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::union_jack, SheetMesh::unstructured})
      for (const int cells : {10, 20, 40}) {
        const double found = drop_over_span(mesh, cells, gamma, mesh == SheetMesh::unstructured ? 100 : 300);
        printf("  error %.4f %%\n", 100 * (found / exact - 1));
      }
  }
}

double plate(SheetMesh mesh, int cells) {
  const double edge = 0.4, ring = edge / cells, deflection = 1e-3, thickness = 0.02, nu = 0.3;
  ShellSheet sheet{.mesh = mesh, .size = {edge + 2 * ring, edge + 2 * ring, cells + 2}};
  sheet.size.still = 1;
  const double weight = sheet.areal_density * g;
  sheet.bend = 0.00126532 * weight * std::pow(edge, 4) / deflection;
  sheet.young = 12 * (1 - nu * nu) * sheet.bend / (thickness * thickness), sheet.poisson = nu;
  sheet.damping = 150;
  sheet.held = [=](V3d x) {
    return std::min({x.x, x.y, edge + 2 * ring - x.x, edge + 2 * ring - x.y}) < ring + 1e-9;
  };
  ShellRun run(sheet);
  run.advance(0.2);
  double most = 0;
  for (const V3d& x : run.places()) most = std::max(most, -x.y);
  printf("plate mesh %d cells %d steps %d iterations %d\n", int(mesh), cells, int(run.steps), run.limits.sheet_sweeps);
  return most / deflection;
}

TEST(ShellRest, AClampedPlateSagsAsItsClosedForm) {
  for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::union_jack, SheetMesh::unstructured})
    for (const int cells : {10, 20, 40}) {
      const double found = plate(mesh, cells);
      printf("  error %.4f %%\n", 100 * (found  - 1));
    }
}

}  // namespace
}  // namespace drench::sim_tests
