// Bending of shells: derivatives, energies of bent sheets against those of a plate, slivers.

#include "sim/passes/cloth/shell_bending.h"

#include <Imath/ImathMatrix.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <string>

#include "tests/sim/shell_sheets.h"

namespace drench::sim_tests {
namespace {

using namespace sim::cpu;
using V = Vec3<double>;

constexpr SheetMesh all_meshes[] = {SheetMesh::diagonal, SheetMesh::union_jack,
                                    SheetMesh::equilateral, SheetMesh::unstructured};

Curvature<V> curvature(const sim::BendingPatch& p, const std::vector<V3d>& x) {
  Curvature<V> kappa{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  for (const sim::PatchNode& n : p.node) {
    const V3d at = x[size_t(n.index)] + n.shift;
    add_node(kappa, n.weight, {at.x, at.y, at.z});
  }
  return kappa;
}

double energy(const sim::ShellRest& rest, const std::vector<V3d>& x) {
  double sum = 0;
  for (size_t t = 0; t < rest.patch.size(); ++t) {
    const auto& p = rest.patch[t];
    if (p.node.empty()) continue;
    V corner[3];
    for (int c = 0; c < 3; ++c) {
      const V3d at = x[size_t(p.node[c].index)] + p.node[c].shift;
      corner[c] = {at.x, at.y, at.z};
    }
    const TurningNormal<double> n(corner[0], corner[1], corner[2], rest.triangle[t].area);
    sum += bending_energy(rest.triangle[t].area * p.share, rest.bending,
                          beyond_rest(curvature(p, x), p.rest, n.normal));
  }
  return sum;
}

std::vector<V3d> forces(const sim::ShellRest& rest, const std::vector<V3d>& x) {
  std::vector<V3d> f(x.size(), V3d(0));
  for (size_t t = 0; t < rest.patch.size(); ++t) {
    const auto& p = rest.patch[t];
    const double area = rest.triangle[t].area;
    V corner[3];
    for (int c = 0; c < 3; ++c) {
      const V3d at = x[size_t(p.node[c].index)] + p.node[c].shift;
      corner[c] = {at.x, at.y, at.z};
    }
    const TurningNormal<double> n(corner[0], corner[1], corner[2], area);
    const auto m = moment(rest.bending, beyond_rest(curvature(p, x), p.rest, n.normal));
    const auto add = [&](int k, V force) {
      f[size_t(p.node[k].index)] += V3d(force.x, force.y, force.z);
    };
    for (int k = 0; k < int(p.node.size()); ++k)
      add(k, bending_force(area * p.share, m, p.node[k].weight));
    for (int c = 0; c < 3; ++c) add(c, turning_force(area * p.share, m, p.rest, n, c));
  }
  return f;
}

sim::ShellConstants plate(double bending, double poisson) {
  return {0.2, sim::rigidity_of_plate(bending, poisson)};
}

/// The sheet as z = (a x^2 + b y^2)/2 + c x y.
std::vector<V3d> quadratic(const std::vector<V3d>& flat, double a, double b, double c) {
  std::vector<V3d> x = flat;
  for (V3d& p : x) p.z = (a * p.x * p.x + b * p.y * p.y) / 2 + c * p.x * p.y;
  return x;
}

/// A sheet rolled on a cylinder of radius 1 about the direction at `angle` to x.
std::vector<V3d> rolled(const std::vector<V3d>& flat, double angle) {
  std::vector<V3d> x = flat;
  const V3d along(std::cos(angle), std::sin(angle), 0), across(-along.y, along.x, 0);
  for (V3d& p : x) {
    const double s = p.dot(along);
    p = across * p.dot(across) + along * std::sin(s) + V3d(0, 0, 1 - std::cos(s));
  }
  return x;
}

// Up to the edges. 1e-6 of misfit counts by the condition of a patch.
TEST(ShellBending, QuadraticSurfacesHaveTheirSecondDerivatives) {
  for (const SheetMesh mesh : all_meshes) {
    const auto surface = flat_sheet(mesh, {1, 1, 12});
    const auto rest = sim::shell_rest(surface, plate(1, 0.3));
    const auto x = quadratic(surface.rest, 1, -0.4, 0.7);
    for (size_t t = 0; t < rest.patch.size(); ++t) {
      const auto kappa = curvature(rest.patch[t], x);
      EXPECT_NEAR(kappa.xx.z, 1, 1e-3) << int(mesh) << " " << t;
      EXPECT_NEAR(kappa.yy.z, -0.4, 1e-3) << int(mesh) << " " << t;
      EXPECT_NEAR(kappa.xy.z, 1.4, 1e-3) << int(mesh) << " " << t;
      EXPECT_NEAR(length(kappa.xx) + length(kappa.yy), 1.4, 2e-3);
      EXPECT_EQ(rest.patch[t].share, 1);
    }
  }
}

// Axes that turn from triangle to triangle change nothing of an isotropic sheet.
TEST(ShellBending, EnergyDoesNotDependOnTheAxes) {
  auto surface = flat_sheet(SheetMesh::unstructured, {1, 1, 8});
  const auto straight = sim::shell_rest(surface, plate(1, 0.3));
  for (const V3d& x : surface.rest)
    surface.uv.push_back({float(x.x * x.x - 3 * x.x * x.y + x.y), 0.f});
  const auto turned = sim::shell_rest(surface, plate(1, 0.3));
  const auto x = rolled(surface.rest, 0.4);
  EXPECT_NEAR(energy(turned, x), energy(straight, x), 1e-9);
}

/// Force on inner nodes of a constant moment over the moment, both per width.
double imbalance(SheetMesh mesh) {
  const auto surface = flat_sheet(mesh, {1, 1, 12});
  const auto rest = sim::shell_rest(surface, plate(1, 0.3));
  const auto x = quadratic(surface.rest, 1, -0.4, 0.7);
  const auto f = forces(rest, x);
  double worst = 0;
  for (size_t v = 0; v < x.size(); ++v)
    if (std::abs(x[v].x - 0.5) < 0.2 && std::abs(x[v].y - 0.5) < 0.2)
      worst = std::max(worst, f[v].length());
  return worst;
}

// The divergence theorem: slopes are of sides, so the parts of two neighbours cancel.
TEST(ShellBending, ConstantMomentsAreInEquilibrium) {
  for (const SheetMesh mesh : all_meshes) EXPECT_LT(imbalance(mesh), 2e-3);
}

double interior_energy_error(SheetMesh mesh, int cells, double angle) {
  const auto surface = flat_sheet(mesh, {1, 1, cells});
  const auto rest = sim::shell_rest(surface, plate(1, 0.3));
  const auto x = rolled(surface.rest, angle);
  double sum = 0, area = 0;
  for (size_t t = 0; t < rest.patch.size(); ++t) {
    const auto& c = surface.triangle[t];
    const V3d centre = (surface.rest[c[0]] + surface.rest[c[1]] + surface.rest[c[2]]) / 3;
    if (std::abs(centre.x - 0.5) > 0.25 || std::abs(centre.y - 0.5) > 0.25) continue;
    sum += bending_energy(rest.triangle[t].area, rest.bending, curvature(rest.patch[t], x));
    area += rest.triangle[t].area;
  }
  return sum / (area / 2) - 1;
}

// A cylinder of radius 1: D/2 per area whichever way it is rolled. The error is of second order.
TEST(ShellBending, CylindersOfAnyDirectionHaveTheEnergyOfAPlate) {
  for (const SheetMesh mesh : all_meshes) {
    for (const double angle : {0., 0.4, M_PI / 4, M_PI / 2}) {
      EXPECT_NEAR(interior_energy_error(mesh, 16, angle), 0, 3e-3) << int(mesh) << " " << angle;
      EXPECT_NEAR(interior_energy_error(mesh, 32, angle), 0, 1e-3) << int(mesh) << " " << angle;
    }
  }
}

// An orthotropic sheet rolled along warp, weft and bias costs what bending tests along them say.
TEST(ShellBending, FabricsBendAsTheirThreeRigidities) {
  const double warp = 3, weft = 1, bias = 1.2;
  const auto surface = flat_sheet(SheetMesh::unstructured, {1, 1, 24});
  const auto rest = sim::shell_rest(surface, {0.2, sim::rigidity_of_fabric(warp, weft, bias, 0.1)});
  const auto of = [&](double angle) {
    const auto x = rolled(surface.rest, angle);
    double sum = 0, area = 0;
    for (size_t t = 0; t < rest.patch.size(); ++t) {
      const auto& c = surface.triangle[t];
      const V3d centre = (surface.rest[c[0]] + surface.rest[c[1]] + surface.rest[c[2]]) / 3;
      if (std::abs(centre.x - 0.5) > 0.3 || std::abs(centre.y - 0.5) > 0.3) continue;
      sum += bending_energy(rest.triangle[t].area, rest.bending, curvature(rest.patch[t], x));
      area += rest.triangle[t].area;
    }
    return 2 * sum / area;
  };
  EXPECT_NEAR(of(0), warp, 0.01 * warp);
  EXPECT_NEAR(of(M_PI / 2), weft, 0.01 * weft);
  EXPECT_NEAR(of(M_PI / 4), bias, 0.01 * bias);
}

TEST(ShellBending, WarpFollowsTheTexture) {
  auto surface = flat_sheet(SheetMesh::unstructured, {1, 1, 6});
  for (const V3d& x : surface.rest)  // u along y, twice as dense
    surface.uv.push_back({float(2 * x.y), float(x.x)});
  const auto rest = sim::shell_rest(surface, plate(1, 0.3));
  for (size_t t = 0; t < rest.triangle.size(); ++t) {
    const auto& c = surface.triangle[t];
    const auto at = [&](int k) {
      const V3d& x = surface.rest[c[k]];
      return V{x.x, x.y, x.z};
    };
    const auto f = surface_gradient(rest.triangle[t], at(0), at(1), at(2));
    EXPECT_NEAR(f.warp.y, 1, 1e-6);
    EXPECT_NEAR(f.weft.x, -1, 1e-6);
  }
}

/// A roof of radius 1 whose ends are free: curved at rest.
sim::ShellSurface roof() {
  auto surface = flat_sheet(SheetMesh::unstructured, {1, 0.6, 8});
  surface.rest = rolled(surface.rest, 0.3);
  return surface;
}

TEST(ShellBending, CurvedSheetsAreAtRestAsTheyAre) {
  const auto surface = roof();
  const auto rest = sim::shell_rest(surface, plate(1, 0.3));
  EXPECT_NEAR(energy(rest, surface.rest), 0, 1e-20);
  auto turned = surface.rest;
  for (V3d& x : turned) x = V3d(x.y, x.z, x.x) + V3d(3, 4, 5);
  EXPECT_NEAR(energy(rest, turned), 0, 1e-20);
  const auto flat = flat_sheet(SheetMesh::unstructured, {1, 0.6, 8});
  EXPECT_NEAR(energy(rest, flat.rest) / energy(sim::shell_rest(flat, plate(1, 0.3)), surface.rest),
              1, 0.02);  // to flatten it takes what bending it takes
}

// Central differences; forces are of some N.
TEST(ShellBending, ForceIsTheGradientOfTheEnergyOfACurvedSheet) {
  const auto surface = roof();
  const auto rest = sim::shell_rest(surface, plate(1, 0.3));
  std::mt19937 random(2);
  const auto draw = [&] { return double(random()) / 4294967296.0 - 0.5; };
  auto x = surface.rest;
  for (V3d& p : x) p += V3d(draw(), draw(), draw()) * 0.05;
  const auto f = forces(rest, x);
  V3d sum(0), spin(0);
  double scale = 0;
  for (size_t v = 0; v < x.size(); ++v) {
    sum += f[v], spin += x[v].cross(f[v]), scale += f[v].length();
    const V3d d(draw(), draw(), draw());
    auto high = x, low = x;
    high[v] += d * 1e-5, low[v] -= d * 1e-5;
    EXPECT_NEAR(-f[v].dot(d), (energy(rest, high) - energy(rest, low)) / 2e-5,
                1e-6 * (f[v].length() + 1));
  }
  EXPECT_LT(sum.length(), 1e-12 * scale);
  EXPECT_LT(spin.length(), 1e-10 * scale);
}

// One matrix for all: x . K x / 2 is the energy of a flat sheet, and its rows sum to zero.
TEST(ShellBending, TheMatrixHoldsTheEnergyOfFlatSheets) {
  const auto surface = flat_sheet(SheetMesh::unstructured, {1, 1, 8});
  const auto rest = sim::shell_rest(surface, plate(1, 0.3));
  const auto matrix = sim::bending_matrix(rest, surface.rest.size());
  const auto x = rolled(surface.rest, 0.7);
  double twice = 0;
  for (size_t v = 0; v < x.size(); ++v) {
    double sum = 0;
    for (int k = matrix.start[v]; k < matrix.start[v + 1]; ++k) {
      twice += matrix.weight[k] * x[v].dot(x[matrix.column[k]]);
      sum += matrix.weight[k];
    }
    EXPECT_NEAR(sum, 0, 1e-6);
    EXPECT_EQ(matrix.push[v], V3d(0));
  }
  EXPECT_NEAR(twice / 2, energy(rest, x), 1e-9);
}

/// A flat sheet whose last column of vertices is its first, a period on.
sim::ShellSurface joined_sheet() {
  auto surface = flat_sheet(SheetMesh::diagonal, {1, 0.5, 8});
  const size_t vertices = surface.rest.size(), row = 5;
  surface.node.resize(vertices), surface.shift.assign(vertices, V3d(0));
  for (size_t v = 0; v < vertices; ++v) surface.node[v] = int(v);
  for (size_t j = 0; j < row; ++j) {  // the last column is the first, a length on
    surface.node[vertices - row + j] = int(j);
    surface.shift[vertices - row + j] = V3d(1, 0, 0);
  }
  std::map<std::pair<int, int>, int> at;
  for (int t = 0; t < int(surface.triangle.size()); ++t) {
    const auto node = [&](int k) { return surface.node[surface.triangle[t][k % 3]]; };
    for (int k = 0; k < 3; ++k) at[{node(k), node(k + 1)}] = t;
  }
  for (int t = 0; t < int(surface.triangle.size()); ++t) {
    const auto node = [&](int k) { return surface.node[surface.triangle[t][k % 3]]; };
    for (int k = 0; k < 3; ++k) {
      const auto found = at.find({node(k + 1), node(k)});
      surface.neighbour[t][k] = found == at.end() ? -1 : found->second;
    }
  }
  return surface;
}

// A wave of one period has the same curvature at the seam as elsewhere.
TEST(ShellBending, SheetsBendAcrossAPeriodicSeam) {
  const auto surface = joined_sheet();
  const auto rest = sim::shell_rest(surface, plate(1, 0.));
  std::vector<V3d> x(surface.rest.begin(), surface.rest.end() - 5);
  EXPECT_NEAR(energy(rest, x), 0, 1e-20);
  for (V3d& p : x) p.z = 0.1 * std::sin(2 * M_PI * p.x);
  std::vector<double> of_column(8, 0);
  for (size_t t = 0; t < rest.patch.size(); ++t) {
    const auto& p = rest.patch[t];
    for (const sim::PatchNode& n : p.node) EXPECT_LT(n.index, int(x.size()));
    of_column[t / 8] += bending_energy(rest.triangle[t].area, rest.bending, curvature(p, x));
  }
  for (int i = 0; i < 4; ++i)  // half a period on the energy is the same
    EXPECT_NEAR(of_column[i], of_column[i + 4], 1e-9);
  const auto matrix = sim::bending_matrix(rest, x.size());
  const auto f = forces(rest, x);
  for (size_t v = 0; v < x.size(); ++v) {
    V3d force = matrix.push[v];
    for (int k = matrix.start[v]; k < matrix.start[v + 1]; ++k)
      force -= x[matrix.column[k]] * matrix.weight[k];
    EXPECT_LT((force - f[v]).length(), 1e-9);
  }
}

// Needles of 1 : 10,000 beside ordinary triangles, and six points on a conic: nothing is stiffer
// than 1e4 equilateral triangles of its size, and weights are finite.
TEST(ShellBending, SliversHaveBoundedStiffness) {
  auto surface = flat_sheet(SheetMesh::diagonal, {1, 1, 8});
  for (V3d& x : surface.rest)  // a column that is all but closed, 1e-4 of a cell
    if (std::abs(x.x - 0.5) < 0.01) x.x = 0.375 + 0.125e-4;
  const auto rest = sim::shell_rest(surface, plate(1, 0.3));
  const auto matrix = sim::bending_matrix(rest, surface.rest.size());
  double stiffest = 0;
  for (size_t v = 0; v < surface.rest.size(); ++v) {
    for (int k = matrix.start[v]; k < matrix.start[v + 1]; ++k) {
      ASSERT_TRUE(std::isfinite(matrix.weight[k]));
      if (matrix.column[k] == int(v)) stiffest = std::max(stiffest, matrix.weight[k]);
    }
  }
  const double cell = 1. / 8;
  EXPECT_LT(stiffest, 4 * 1e4 * 20 / (cell * cell));
}

/// A triangle whose neighbours' far corners and own ones are those of a hexagon.
sim::ShellSurface hexagon() {
  sim::ShellSurface s;
  const double c = 0.5, h = std::sqrt(3.) / 2;
  s.rest = {{1, 0, 0}, {-c, h, 0}, {-c, -h, 0}, {c, h, 0}, {-1, 0, 0}, {c, -h, 0}};
  s.triangle = {{0, 1, 2}, {1, 0, 3}, {2, 1, 4}, {0, 2, 5}};
  find_neighbours(s);
  return s;
}

// They lie on a circle: a paraboloid is level at all six, so they do not tell its curvature.
TEST(ShellBending, APatchOnAConicIsFinite) {
  const auto surface = hexagon();
  const auto rest = sim::shell_rest(surface, plate(1, 0.3));
  for (const auto& p : rest.patch) {
    for (const sim::PatchNode& n : p.node)
      EXPECT_LT(std::abs(n.weight.xx) + std::abs(n.weight.yy) + std::abs(n.weight.xy), 1e3);
  }
  auto x = quadratic(surface.rest, 1, 1, 0);  // a paraboloid: all of them at one height
  EXPECT_LT(energy(rest, x), 1e-6);
}

/// A patch that is bent and strained, and displacements of its nodes.
struct BentPatch {
  sim::ShellRest rest;
  std::vector<V3d> x, u;
  size_t triangle;

  const sim::BendingPatch& patch() const { return rest.patch[triangle]; }
  Curvature<V> curvature_of(const std::vector<V3d>& places) const {
    return curvature(patch(), places);
  }
  V corner(const std::vector<V3d>& of, int c) const {
    const V3d d = of[size_t(patch().node[c].index)] - of[size_t(patch().node[0].index)];
    return {d.x, d.y, d.z};
  }
  TriangleTurn<double> turn() const {
    return {corner(x, 1), corner(x, 2), rest.triangle[triangle].area};
  }
  /// What changes of the curvature beside turning.
  Curvature<V> change() const {
    const V theta = turn().of(corner(u, 1), corner(u, 2));
    return curvature_of(u) - turned(theta, curvature_of(x));
  }
};

BentPatch bent_patch(SheetMesh mesh) {
  const sim::ShellSurface surface = flat_sheet(mesh, {1, 1, 8});
  BentPatch b{shell_rest(surface, plate(0.3, 0.2)), surface.rest, {}, 0};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto any = [&] { return V3d(uniform(random), uniform(random), uniform(random)); };
  for (V3d& p : b.x) p = V3d(std::sin(2 * p.x), 1.1 * p.y, std::cos(2 * p.x)) + any() * 5e-3;
  for (size_t v = 0; v < b.x.size(); ++v) b.u.push_back(any());
  for (size_t t = 1; t < b.rest.patch.size(); ++t)
    if (b.rest.patch[t].node.size() > b.patch().node.size()) b.triangle = t;
  return b;
}

// Halfway of a rotation by a finite angle: Cayley's form of it.
TEST(ShellBending, RotationsChangeNoCurvatureAsTheTriangleSeesIt) {
  for (const SheetMesh mesh : all_meshes) {
    BentPatch b = bent_patch(mesh);
    Imath::M44d rotation;
    rotation.setAxisAngle(V3d(1, -2, 3).normalized(), 0.8);
    for (size_t v = 0; v < b.x.size(); ++v) {
      V3d to;
      rotation.multDirMatrix(b.x[v], to);
      b.u[v] = to - b.x[v], b.x[v] = (to + b.x[v]) * 0.5;
    }
    const auto left = b.change(), was = b.curvature_of(b.x);
    EXPECT_LT(contract(left, left), 1e-20 * contract(was, was)) << int(mesh);
  }
}

TEST(ShellBending, TurningPullsCornersByItsDerivative) {
  const BentPatch b = bent_patch(SheetMesh::unstructured);
  const V torque{0.3, -0.7, 0.5};
  const auto turn = b.turn();
  const V d1 = b.corner(b.u, 1), d2 = b.corner(b.u, 2);
  EXPECT_NEAR(dot(torque, turn.of(d1, d2)),
              dot(turn.derivative(1, torque), d1) + dot(turn.derivative(2, torque), d2), 1e-12);
}

// J^T D J <= 4/3 (K + 3 kappa^T D kappa |grad u|^2): the matrix that stands for viscosity is at
// least three quarters of it.
TEST(ShellBending, ItsMatrixHoldsTheViscousForces) {
  for (const SheetMesh mesh : all_meshes) {
    BentPatch b = bent_patch(mesh);
    std::mt19937 random(9);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto& d = b.rest.bending;
    const auto kappa = b.curvature_of(b.x);
    const auto turn = b.turn();
    for (int k = 0; k < 1000; ++k) {
      for (V3d& u : b.u) u = V3d(uniform(random), uniform(random), uniform(random));
      const V d1 = b.corner(b.u, 1), d2 = b.corner(b.u, 2);
      const double gradient2 = length2(turn.dual[0]) * length2(d1) +
                               length2(turn.dual[1]) * length2(d2) +
                               2 * dot(turn.dual[0], turn.dual[1]) * dot(d1, d2);
      const auto straight = b.curvature_of(b.u), change = b.change();
      EXPECT_LE(contract(moment(d, change), change),
                4. / 3 *
                    (contract(moment(d, straight), straight) +
                     3 * contract(moment(d, kappa), kappa) * gradient2));
    }
  }
}

}  // namespace
}  // namespace drench::sim_tests
