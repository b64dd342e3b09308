#pragma once
// Coarse levels of the preconditioner of the sheets' solve (Bramble, Pasciak, Xu 1990):
//   z = D^-1 r + sum_l P_l B_l^-1 P_l^T r,   D the blocks of the vertices.
// A level's functions stand on aggregates of vertices, of about 8 at the finest and four of the
// level before at each further one: the affine functions of the place at rest, 12 to an aggregate,
// which contain what hardly costs a sheet anything, shifts, small turns and even strains (Vanek,
// Mandel, Brezina 1996). B_l: their block of P_l^T A P_l, with all other aggregates still.
// Sums only, nothing is solved. The blocks of the vertices alone lower errors of wavelength L in
// about L / h sweeps; a hanging sheet of 64 x 64 cells takes 0.42 of the sweeps with levels, a
// stiff strip an eighth, and a sweep costs half as much again
// (docs/decisions/0032-levels-of-sheets.md).
//
// Energies are summed by differences: that of two vertices of one aggregate by that of their
// functions, so that the sum of a stiff sheet keeps what its shift has. A vertex that a pin
// holds is no part of its aggregate; one that a wall holds resists along its normal as if its
// neighbours stood still.

#include "sim/state.h"

namespace drench::sim {
struct ClothTopology;
}

namespace drench::sim::DRENCH_BACKEND {

struct ScaledClothMatrix;

constexpr int functions = ClothLevels::functions, unknowns = 3 * functions;
constexpr int most_vertices = 8;  // of an aggregate of the finest level
/// Fields of ClothLevels::partial: of pairs of functions 11 1x 1y 1z xx xy xz yy yz zz, and of
/// differences xx xy xz yy yz zz, each by the entries of a symmetric block.
constexpr int sums_of_all = 60, sums = 96;
constexpr int inverse_entries = unknowns * (unknowns + 1) / 2;

/// The finest level at which two aggregates of the finest have one ancestor.
DRENCH_HD int common_level(int a, int b) {
  int level = 0;
  for (; a != b; a >>= 2, b >>= 2) ++level;
  return level;
}

/// Aggregates of all sheets; none without shells.
void load_cloth_levels(State& state, const ClothTopology& cloth);

/// Blocks of the levels, for the walls that there are. Where sheets touch each other or an obstacle
/// the levels take no part: who touches changes from round to round, blocks made anew for each cost
/// more than they save, and others correct far too much.
void build_cloth_levels(State& state);

/// Whether obstacles or rows of sheets hold any vertex, as far as known.
bool anything_touches(const State& state);

/// Adds to ClothSystem::scaled what the levels make of ClothSystem::residual.
void add_cloth_levels(State& state, const ScaledClothMatrix& matrix);

/// Of other matrices there are none.
template <class Matrix>
void add_cloth_levels(State&, const Matrix&) {}

}  // namespace drench::sim::DRENCH_BACKEND
