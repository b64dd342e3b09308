#pragma once
// What a shell needs of its sheet at rest: the material axes, areas and masses, and for every
// triangle the weights that give the second derivatives of the surface.
//
// Method of the weights. A quadratic surface through the corners of a triangle and the far corners
// of its neighbours, unfolded into its plane, has a slope across each side (such patches: the
// enhanced basic shell triangle of Flores and Onate 2005, the smoothed hinges of Liang 2025). The
// two patches at a side have different ones; their mean is the slope there, and the divergence
// theorem makes second derivatives of the slopes of three sides, as in the basic shell triangle
// (Onate and Cervera 1993). Quadratic surfaces keep their energy exactly, and fields of constant
// moment are in equilibrium on any mesh, which the patch of one triangle alone is not: decision
// 0029.
//   Where a side is free, its patch has one condition less; of the surfaces that are left it is the
// one whose second derivatives are nearest to its neighbours'. Where a neighbour is held as a
// whole, its plane is what the surface is tangent to: a clamp.

#include <Imath/ImathVec.h>

#include <array>
#include <vector>

#include "sim/passes/cloth/shell_bending.h"
#include "sim/passes/cloth/shell_membrane.h"

namespace drench::sim {

/// A sheet at rest. Vertices that are one node (at seams of the texture, at periodic seams) move as
/// one: vertex v stands at its node plus shift[v].
struct ShellSurface {
  std::vector<Imath::V3d> rest;               // m, of a vertex
  std::vector<Imath::V2f> uv;                 // of a vertex; or empty
  std::vector<std::array<int, 3>> triangle;   // vertices
  std::vector<std::array<int, 3>> neighbour;  // across sides ab, bc, ca; -1: the side is free
  std::vector<int> node;                      // of a vertex; empty: itself
  std::vector<Imath::V3d> shift;              // m, of a vertex; empty: none
  std::vector<char> held;                     // of a node; empty: none is
  Imath::V3d warp{1, 0, 0};  // where uv says nothing, warp is along this, or z where that is across
};

/// Of all its triangles.
struct ShellConstants {
  double areal_density;           // kg/m^2
  cpu::Rigidity<double> bending;  // N m
};

/// Rigidity from what bending tests give: moments per width and curvature of cylinders about the
/// weft (so along warp), about the warp, and along the bias, each across a wide sample.
///   B_45 = (D11 + D22 + 2 D12)/4 + D66, so D66 = B_45 - (D11 + D22 + 2 D12)/4,
/// but at least a hundredth of the mean of D11 and D22. @param poisson  geometric mean of the two
/// Poisson ratios in bending, of |.| < 1: D12 = poisson sqrt(D11 D22).
cpu::Rigidity<double> rigidity_of_fabric(double warp, double weft, double bias, double poisson);
/// Of a plate: D = E h^3 / (12 (1 - nu^2)).
cpu::Rigidity<double> rigidity_of_plate(double bending, double poisson);

/// What a node adds to the second derivatives of a patch.
struct PatchNode {
  int index;
  Imath::V3d shift;               // m, added to the node's place
  cpu::Curvature<double> weight;  // 1/m^2
};

/// Of one triangle. The first three nodes are its corners, a, b, c; with neighbours on all sides
/// and theirs there are twelve. A triangle that is held as a whole has none and does not bend.
struct BendingPatch {
  std::vector<PatchNode> node;
  cpu::Curvature<double> rest{};  // 1/m, kappa_0 along the normal
  double share = 1;  // of its area, where that stands in energy and forces: see shell_rest
};

struct ShellRest {
  std::vector<cpu::RestTriangle<double>> triangle;
  std::vector<BendingPatch> patch;
  std::vector<double> mass;  // kg, of a node: a third of each triangle at it
  cpu::Rigidity<double> bending;
};

/// Triangles must be wound the same way, with area. A sliver that is stiffer than 1e4 equilateral
/// triangles on its longest side has that stiffness (BendingPatch::share < 1); a patch whose six
/// points lie near a conic, so that no quadratic fits, spends energy on the misfit instead.
ShellRest shell_rest(const ShellSurface& surface, const ShellConstants& constants);

/// Bending of all triangles as one sparse matrix over the nodes, N/m, times the unit matrix: the
/// force on node i is -(sum_k weight[k] x[column[k]]) + push[i] for sheets that are flat at rest.
/// Rows sum to zero. In float sum x[column[k]] - x[i]: a metre from the origin, cotton in cells of
/// 5 mm, rounding of the places themselves would be 1 % of its weight.
struct BendingMatrix {
  std::vector<int> start, column;  // by rows, columns rising
  std::vector<double> weight;
  std::vector<Imath::V3d> push;  // N, of the shifts
};
BendingMatrix bending_matrix(const ShellRest& rest, size_t nodes);

}  // namespace drench::sim
