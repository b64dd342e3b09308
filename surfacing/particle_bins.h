#pragma once
// Particles sorted into blocks and, inside a block, into bins of about one spacing.

#include <algorithm>
#include <array>
#include <bit>
#include <utility>
#include <vector>

#include "pipeline/contract/frames.h"
#include "surfacing/ellipsoids.h"
#include "surfacing/lattice.h"
#include "surfacing/pack.h"

namespace drench::surfacing {

/// n particles in order of block, bin and index in the frame. A block's bins run z, y, x. The
/// columns of floats are a pack longer, so that packs can be read from any row.
struct BinnedParticles {
  Lattice lattice;
  BlockMap map;                     // occupied block -> its index below
  std::vector<BlockKey> block;      // occupied blocks in order of their keys
  std::vector<uint32_t> first;      // first particle of each block, and n
  std::vector<uint32_t> bin_first;  // (bins^3 + 1) a block, counted from the block's first particle
  std::vector<float> x, y, z;       // voxels from the corner of the particle's block, [0, 8]
  std::vector<uint32_t> source;     // index in the frame
  std::vector<float> weight;        // volume of the particle / spacing^3 as the field counts it
  Ellipsoids ellipsoids;            // the kernels that are not round

  const uint32_t* bins_of(uint32_t block_index) const {
    return bin_first.data() + size_t(block_index) * bin_stride();
  }
  size_t bin_stride() const { return size_t(lattice.bins) * lattice.bins * lattice.bins + 1; }
};

/// Sorts the particles of a frame, all of whose positions are finite.
/// @param origin  of the lattice, whole voxels; every particle lies at least ring() + 1 blocks
/// above.
BinnedParticles bin_particles(const std::vector<V3f>& position, const Lattice& lattice);

/// Particles close to one block, positions in voxels from that block's corner. Only the first
/// size() rows count; in the columns of floats a pack with weight 0, far away, follows them.
struct NearParticles {
  std::vector<float> x, y, z, weight;
  std::vector<uint32_t> index;  // in BinnedParticles

  size_t size() const { return count_; }
  void clear() { count_ = 0; }
  void pad();
  /// Adds those of the particles [begin, end), of a block whose corner is given, that lie within
  /// reach of the box [0, edge]^3.
  void add(const BinnedParticles& particles, uint32_t begin, uint32_t end, V3f corner, float edge,
           float reach);

 private:
  void make_room(size_t more);
  size_t count_ = 0;
};

/// Fills `near` with the particles within `reach` voxels of the box [0, edge]^3 of `block`, in
/// order of block, bin and index.
void gather_near(const BinnedParticles& particles, V3i block, float edge, float reach,
                 NearParticles& near);

/// The particle nearest to a point, voxels from the block's corner; of equals the first. There must
/// be one.
size_t nearest_of(const NearParticles& near, const V3f& p);

/// Eight points of one block, voxels from its corner.
struct PointPack {
  std::array<float, pack_width> x, y, z;
};

/// Points [begin, begin + count) of a block whose corner is given, count from 1 to 8; the last one
/// fills the rest.
PointPack points_of(const std::vector<V3f>& position, uint32_t begin, uint32_t count,
                    const V3f& corner);

/// Calls f(j) for every particle of `near` within `reach` of the box around the points, in order.
template <class F>
void for_each_close(const NearParticles& near, const PointPack& points, float reach, F f) {
  const auto span = [](const std::array<float, pack_width>& v) {
    const auto [low, high] = std::minmax_element(v.begin(), v.end());
    return std::pair{pack(*low), pack(*high)};
  };
  const auto [x0, x1] = span(points.x);
  const auto [y0, y1] = span(points.y);
  const auto [z0, z1] = span(points.z);
  const auto away = [](Pack v, Pack low, Pack high) {
    return larger(larger(low - v, v - high), Pack{});
  };
  const Pack reach2 = pack(reach * reach);
  for (size_t j = 0; j < near.size(); j += pack_width) {
    const Pack dx = away(load(near.x.data() + j), x0, x1);
    const Pack dy = away(load(near.y.data() + j), y0, y1);
    const Pack dz = away(load(near.z.data() + j), z0, z1);
    const Pack distance2 = multiply_add(dx, dx, multiply_add(dy, dy, dz * dz));
    for (unsigned bits = less_bits(distance2, reach2); bits != 0; bits &= bits - 1)
      f(j + static_cast<size_t>(std::countr_zero(bits)));
  }
}

}  // namespace drench::surfacing
