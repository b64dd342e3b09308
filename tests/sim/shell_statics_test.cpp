// Shells at rest against closed forms and converged solutions (tests/validation/README.md).

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/sim/shell_statics.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

using namespace sim::cpu;

MembraneLaw<double> isotropic(double young, double poisson) {
  return {orthotropic(young, young, young / (2 * (1 + poisson)), poisson), strain_limit(100., 1.),
          0.};
}

/// Young's modulus times thickness of a sheet of rigidity 1 whose length is `slenderness`
/// thicknesses.
double membrane_modulus(double slenderness, double poisson) {
  return 12 * (1 - poisson * poisson) * slenderness * slenderness;
}

sim::ShellConstants bending(double rigidity, double poisson) {
  return {1, sim::rigidity_of_plate(rigidity, poisson)};
}

// u/L = beta/2, beta = w L / (E h): here 1e-4, so that Green strain is that of small stretches to
// 1e-4. StVK's next term is 0.75 beta of it.
TEST(ShellStatics, HangingSheetStretchesAsItsClosedForm) {
  for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::union_jack, SheetMesh::equilateral,
                               SheetMesh::unstructured}) {
    auto surface = flat_sheet(mesh, {1, 0.5, 8});
    hold(surface, [](V3d x) { return x.x < 1e-9; });
    ShellStatics sheet(surface, bending(1e-6, 0), isotropic(1e4, 0));
    sheet.add_gravity(V3d(1, 0, 0));
    ASSERT_GE(sheet.solve(1e-8), 0);
    double end = 0;
    int vertices = 0;
    for (size_t v = 0; v < surface.rest.size(); ++v)
      if (surface.rest[v].x > 1 - 1e-9) end += sheet.x[v].x - 1, ++vertices;
    EXPECT_NEAR(end / vertices, 0.5e-4, 0.5e-4 * 1e-3) << int(mesh);
  }
}

// E h = 1e4 w L leaves 1e-4 of stretch.
TEST(ShellStatics, ALimpStripHangsInACatenary) {
  const double arc = 1.2;
  double sag = 0;
  for (const auto& row : read_validation("catenary.csv"))
    if (row[0] == "1.2") sag = std::stod(row[2]);
  ASSERT_GT(sag, 0);
  for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::unstructured}) {
    auto surface = flat_sheet(mesh, {arc, 0.15, 32});
    hold(surface, [&](V3d x) { return x.x < 1e-9 || x.x > arc - 1e-9; });
    ShellStatics strip(surface, bending(1e-6, 0), isotropic(1e4, 0));
    for (V3d& x : strip.x) {  // a bow of about that length
      const double s = x.x / arc;
      x = {s, x.y, -1.2 * s * (1 - s)};
    }
    strip.add_gravity(V3d(0, 0, -1));
    ASSERT_GE(strip.solve(1e-6), 0);
    double lowest = 0;
    for (const V3d& x : strip.x) lowest = std::min(lowest, x.z);
    EXPECT_NEAR(-lowest, sag, 5e-3 * sag) << int(mesh);
  }
}

/// Drop over span of a cantilever of rigidity 1, length 1, width 0.2 under weights per area.
double drop_over_span(SheetMesh mesh, int cells, double weight, double slenderness) {
  auto surface = flat_sheet(mesh, {1, 0.2, cells, 1});
  hold(surface, [](V3d x) { return x.x < 1e-9; });
  ShellStatics strip(surface, bending(1, 0), isotropic(membrane_modulus(30, 0), 0));
  for (const double part : {0.25, 0.5, 0.75, 1.}) {  // a thick one on the way is quick
    strip.load.assign(strip.x.size(), V3d(0));
    strip.add_gravity(V3d(0, 0, -weight * part));
    EXPECT_GE(strip.solve(1e-3), 0);
  }
  strip.set_law(isotropic(membrane_modulus(slenderness, 0), 0));
  EXPECT_GE(strip.solve(), 0);
  V3d tip(0);
  for (size_t v = 0; v < surface.rest.size(); ++v)
    if (surface.rest[v].x > 1 - 1e-9) tip += strip.x[v];
  return -tip.z / tip.x;
}

double elastica(double gamma) {
  for (const auto& row : read_validation("cantilever_heavy_elastica.csv"))
    if (row[0] == std::to_string(int(gamma))) return std::stod(row[3]);
  return 0;
}

struct Cantilever {
  double gamma, tolerance;
};
class Heavy : public testing::TestWithParam<Cantilever> {};

// 1000 thicknesses long where the mesh is regular, so that what is left is bending's: second order.
// Unstructured triangles cannot bend without stretch (see AnUnstructuredMeshLocks), which sets in
// at 300.
TEST_P(Heavy, CantileverDropsAsTheElastica) {
  const auto [gamma, tolerance] = GetParam();
  const double exact = elastica(gamma);
  ASSERT_GT(exact, 0);
  for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::union_jack, SheetMesh::equilateral,
                               SheetMesh::unstructured}) {
    const double slenderness = mesh == SheetMesh::unstructured ? 100 : 1000;
    double error[3];
    for (int k = 0; k < 3; ++k)
      error[k] = drop_over_span(mesh, 10 << k, gamma, slenderness) / exact - 1;
    RecordProperty("error_" + std::to_string(int(mesh)), std::to_string(error[2]));
    EXPECT_LT(std::abs(error[2]), tolerance) << int(mesh);
    EXPECT_GT(std::log2(error[0] / error[2]) / 2, 1.5) << int(mesh);
  }
}

INSTANTIATE_TEST_SUITE_P(Gamma, Heavy,
                         testing::Values(Cantilever{1, 0.02}, Cantilever{10, 0.03},
                                         Cantilever{100, 0.05}));

// Linear triangles cannot bend on a mesh without lines across it unless they stretch: the stiffer
// they are against bending the less they drop. Regular meshes have the lines.
TEST(ShellStatics, AnUnstructuredMeshLocks) {
  const double exact = elastica(10);
  const double loose = drop_over_span(SheetMesh::unstructured, 20, 10, 100) / exact - 1,
               tight = drop_over_span(SheetMesh::unstructured, 20, 10, 1000) / exact - 1;
  EXPECT_NEAR(loose, 0.004, 0.003);
  EXPECT_NEAR(tight, -0.019, 0.01);
  EXPECT_NEAR(drop_over_span(SheetMesh::diagonal, 20, 10, 1000) / exact - 1, 0.005, 0.001);
}

/// Whether a strip on edge, clamped at one end, stays in its plane.
bool stands(SheetMesh mesh, double width, int cells, double gamma) {
  const double poisson = 0.3;
  auto surface = flat_sheet(mesh, {1, width, cells, 1});
  hold(surface, [](V3d x) { return x.x < 1e-9; });
  ShellStatics strip(surface, bending(1, poisson),
                     isotropic(membrane_modulus(1000, poisson), poisson));
  strip.add_gravity(V3d(0, -gamma, 0));
  EXPECT_GE(strip.solve(), 0);
  return strip.negative_eigenvalues() == 0;
}

TEST(ShellStatics, AStripOnEdgeLeansAtItsCriticalWeight) {
  for (const auto& row : read_validation("lateral_buckling_plate.csv")) {
    if (row[0] != "0.3" || (row[1] != "0.1" && row[1] != "0.5")) continue;
    const double width = std::stod(row[1]), critical = std::stod(row[2]);
    const int cells = width < 0.2 ? 40 : 20;
    for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::union_jack, SheetMesh::equilateral,
                                 SheetMesh::unstructured}) {
      EXPECT_TRUE(stands(mesh, width, cells, 0.92 * critical)) << int(mesh) << " " << width;
      EXPECT_FALSE(stands(mesh, width, cells, 1.08 * critical)) << int(mesh) << " " << width;
    }
  }
}

enum class Edges { clamped, supported };

/// Largest and mean deflection of a unit square of rigidity 1 under pressure 1.
struct Deflection {
  double most = 0, mean = 0;
};
Deflection plate(SheetMesh mesh, Edges edges, int cells) {
  const double ring = edges == Edges::clamped ? 1. / cells : 0;
  SheetSize size{1 + 2 * ring, 1 + 2 * ring, edges == Edges::clamped ? cells + 2 : cells};
  size.still = edges == Edges::clamped ? 1 : 0;
  auto surface = flat_sheet(mesh, size);
  for (V3d& x : surface.rest) x -= V3d(ring, ring, 0);
  hold(surface, [](V3d x) { return std::min({x.x, x.y, 1 - x.x, 1 - x.y}) < 1e-9; });
  ShellStatics sheet(surface, bending(1, 0.3), isotropic(membrane_modulus(100, 0.3), 0.3));
  const double pressure = 0.1;  // deflections of 4 % of the thickness: linear
  sheet.add_gravity(V3d(0, 0, pressure));
  EXPECT_GE(sheet.solve(1e-6), 0);
  Deflection found;
  for (size_t v = 0; v < sheet.x.size(); ++v) {
    found.most = std::max(found.most, sheet.x[v].z / pressure);
    found.mean += sheet.x[v].z / pressure * sheet.rest().mass[v];
  }
  return found;
}

// Timoshenko and Woinowsky-Krieger: 0.00126532 q a^4 / D where clamped, 0.00406235 where supported,
// with mean 64/pi^8 sum 1/(m^2 n^2 (m^2 + n^2)^2) over odd m, n. Second order.
TEST(ShellStatics, PlatesDeflectAsTheirClosedForms) {
  for (const SheetMesh mesh :
       {SheetMesh::diagonal, SheetMesh::union_jack, SheetMesh::unstructured}) {
    const double coarse = plate(mesh, Edges::clamped, 10).most / 0.00126532 - 1,
                 fine = plate(mesh, Edges::clamped, 20).most / 0.00126532 - 1;
    EXPECT_NEAR(fine, 0, 0.035) << int(mesh);
    EXPECT_GT(std::log2(coarse / fine), 1.5) << int(mesh);
  }
  double mean = 0;
  for (int m = 1; m < 40; m += 2)
    for (int n = 1; n < 40; n += 2)
      mean += 64 / std::pow(M_PI, 8) / (m * m * n * n * std::pow(m * m + n * n, 2));
  for (const SheetMesh mesh : {SheetMesh::diagonal, SheetMesh::union_jack, SheetMesh::equilateral,
                               SheetMesh::unstructured}) {
    const Deflection found = plate(mesh, Edges::supported, 20);
    EXPECT_NEAR(found.most, 0.00406235, 0.02 * 0.00406235) << int(mesh);
    EXPECT_NEAR(found.mean, mean, 0.03 * mean) << int(mesh);
  }
}

// A stretch of 1.05 is a limit: three times the weight that takes a sheet there takes it on by a
// tenth of the strain.
TEST(ShellStatics, TheStrainLimitHoldsAHeavySheet) {
  auto surface = flat_sheet(SheetMesh::unstructured, {1, 0.5, 8});
  hold(surface, [](V3d x) { return x.x < 1e-9; });
  auto law = isotropic(100, 0);
  law.limit = strain_limit(1.05, law.moduli.c11);
  ShellStatics sheet(surface, bending(1e-6, 0), law);
  for (size_t v = 0; v < sheet.x.size(); ++v)  // N/m pulled at the end alone
    if (surface.rest[v].x > 1 - 1e-9) sheet.load[v] = V3d(15. / 8, 0, 0);
  ASSERT_GE(sheet.solve(1e-6), 0);
  double end = 0;
  for (const V3d& x : sheet.x) end = std::max(end, x.x);
  EXPECT_GT(end, 1.05);
  EXPECT_LT(end, 1.065);
}

}  // namespace
}  // namespace drench::sim_tests
