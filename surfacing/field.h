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
  float support;      // spacings
  float iso_value;    // c of the surface
  float lone_weight;  // of a particle without neighbours

  ColourKernel(float support, float voxel, float iso_value);  // support and voxel in spacings

  float scale() const;
  /// Shape at q = r / support.
  static float shape(float q);
  /// Weight of a particle at which the field of equal weights is c, from the mean position of its
  /// neighbours (weighted by W, itself among them), `offset` supports away from it.
  ///
  /// In the bulk it is constant. Where neighbours are missing it grows as c falls, which evens out
  /// the noise of their number:
  /// * missing on one side (a large offset), the particle lies at a surface of the bulk: as 1 / c,
  ///   a little, so that the field there is what it is where the particles lie evenly;
  /// * missing all around, it is a drop or part of a film: from 1 in a film one particle thick up
  ///   to the weight that gives a lone particle the volume spacing^3, and between them so that a
  ///   film stretched to 1.5 spacings does not tear.
  /// The constants are fitted at support 2.5 and iso value 0.45, where they take a third off the
  /// scatter of equal weights.
  float weight(float c, float offset) const;
  float bulk_weight() const;
};

/// The values of a block's 8^3 lattice points; x runs fastest.
using BlockValues = std::array<float, block_size>;

struct FieldBlock {
  V3i block;
  std::array<uint8_t, block_edge * block_edge> inside;  // a byte a row, bit x: value >= iso
};

struct FieldStats {
  size_t candidates = 0, interior = 0, evaluated = 0, grown = 0;
  int closure_rounds = 0;
};

/// Evaluated blocks; every lattice point elsewhere is on the same side as all its neighbours.
struct ColourField {
  std::vector<FieldBlock> block;
  std::vector<BlockValues> value;  // of each
  std::vector<uint32_t> order;     // of the blocks by their keys
  BlockMap map;                    // evaluated block -> index in `block`
  FieldStats stats;
};

inline constexpr size_t bytes_a_block = sizeof(FieldBlock) + sizeof(BlockValues);

class ClothSolids;

/// Marks occupied blocks that a count of particles calls full, with all their bins: 1, else 0.
std::vector<uint8_t> count_interior(const BinnedParticles& particles);

/// Weighs all particles from the unweighted colour field, those in `interior` blocks as in the
/// bulk. With anisotropic kernels it finds the ellipsoids among those that miss neighbours.
void weigh_particles(BinnedParticles& particles, const ColourKernel& kernel,
                     const std::vector<uint8_t>& interior, SurfaceKernel shape);

/// Evaluates every block that may hold surface. Interior blocks are left out unless told otherwise,
/// and taken in again wherever a neighbour's border has a point outside, until nothing changes.
/// The field is cut around cloth; no block near it is interior.
/// @throws Error when the blocks would take more than max_bytes.
ColourField evaluate_field(const BinnedParticles& particles, const ColourKernel& kernel,
                           const std::vector<uint8_t>& interior, const ClothSolids& cloth,
                           InteriorBlocks mode, double max_bytes);

}  // namespace drench::surfacing
