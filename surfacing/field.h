#pragma once
// The colour field on sparse blocks of lattice points: which blocks, and their values.

#include <array>
#include <vector>

#include "surfacing/particle_bins.h"
#include "surfacing/surface.h"

namespace drench::surfacing {

/// c(x) = sum_j weight_j s W(|x - x_j| / support), W the cubic spline with W(0) = 1, W(1) = 0 and
/// s = 8 / (pi support^3) its normalisation per spacing^3, so that c is 1 inside a full lattice.
struct ColourKernel {
  float support;    // spacings
  float iso_value;  // c of the surface

  float scale() const;
  /// Shape at q = r / support.
  static float shape(float q);
  /// Weight of a particle at which the unweighted field is c. One in the bulk and at surfaces of
  /// the bulk. Where neighbours are missing it grows as 1 / c, so that a lone particle keeps its
  /// volume: the iso surface then has the radius of a ball of spacing^3.
  float weight(float c) const;
  float full_colour() const;  // below it, neighbours are missing
};

/// The values of a block's 8^3 lattice points; x runs fastest.
struct FieldBlock {
  V3i block;
  std::array<float, block_size> value;
  std::array<uint8_t, block_edge * block_edge> inside;  // a byte a row, bit x: value >= iso
};

struct FieldStats {
  size_t candidates = 0, interior = 0, evaluated = 0, grown = 0;
  int closure_rounds = 0;
};

/// Evaluated blocks; every lattice point elsewhere is on the same side as all its neighbours.
struct ColourField {
  std::vector<FieldBlock> block;
  std::vector<uint32_t> order;  // of the blocks by their keys
  BlockMap map;                 // evaluated block -> index in `block`
  FieldStats stats;
};

/// Marks occupied blocks that a count of particles calls full, with all their bins: 1, else 0.
std::vector<uint8_t> count_interior(const BinnedParticles& particles);

/// Weights of all particles from the unweighted colour field; 1 in `interior` blocks.
std::vector<float> weigh_particles(const BinnedParticles& particles, const ColourKernel& kernel,
                                   const std::vector<uint8_t>& interior);

/// Evaluates every block that may hold surface. Interior blocks are left out unless told otherwise,
/// and taken in again wherever a neighbour's border has a point outside, until nothing changes.
/// @throws Error when the blocks would take more than max_bytes.
ColourField evaluate_field(const BinnedParticles& particles, const ColourKernel& kernel,
                           const std::vector<uint8_t>& interior, InteriorBlocks mode,
                           double max_bytes);

}  // namespace drench::surfacing
