#pragma once
// The voxel lattice, locked to the world origin, and the sparse blocks of 8^3 lattice points on it.

#include <Imath/ImathVec.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace drench::surfacing {

using Imath::V3d;
using Imath::V3f;
using Imath::V3i;

inline constexpr int block_edge = 8;  // voxels
inline constexpr int block_size = block_edge * block_edge * block_edge;
inline constexpr int max_block = (1 << 21) - 4;  // a key holds 21 bits an axis

/// Lattice points stand at whole multiples of `voxel` in the world. Blocks count from `origin`,
/// which follows the particles, so that a frame moved by whole voxels is cut into blocks the same
/// way.
struct Lattice {
  double voxel = 0;                // m
  std::array<double, 3> origin{};  // corner of block (0,0,0), whole voxels from the world origin
  float reach = 0;                 // support of the kernel, voxels
  float voxels_per_spacing = 0;
  int bins = 4;  // bins along a block's edge; a bin is about one spacing wide

  int ring() const {
    return (static_cast<int>(reach) + block_edge) / block_edge;
  }  // blocks in reach
  /// Puts the origin below `low`, with room for blocks in reach of [low, high], m.
  /// @return the axis along which these are too far apart for keys, or -1.
  int fit(const V3f& low, const V3f& high) {
    const double margin = block_edge * (ring() + 1);
    for (int axis = 0; axis < 3; ++axis) {
      origin[axis] = std::floor(low[axis] / voxel) - margin;
      if (!(to_voxels(high[axis], axis) + margin < double(block_edge) * max_block)) return axis;
    }
    return -1;
  }
  double to_voxels(double metres, int axis) const { return metres / voxel - origin[axis]; }
  float to_metres(double voxels, int axis) const {
    return static_cast<float>((origin[axis] + voxels) * voxel);
  }
};

/// Keys order blocks by z, then y, then x. Coordinates are in [0, 2^21).
using BlockKey = uint64_t;
inline BlockKey key_of(V3i block) {
  return static_cast<BlockKey>(block.z) << 42 | static_cast<BlockKey>(block.y) << 21 |
         static_cast<BlockKey>(block.x);
}
inline V3i block_of(BlockKey key) {
  constexpr BlockKey mask = (1 << 21) - 1;
  return {static_cast<int>(key & mask), static_cast<int>(key >> 21 & mask),
          static_cast<int>(key >> 42 & mask)};
}

/// Block key -> index. Open addressing, never more than half full.
class BlockMap {
 public:
  static constexpr uint32_t none = ~0u;

  BlockMap() : BlockMap(16) {}
  explicit BlockMap(size_t expected) : slot_(std::bit_ceil(2 * expected + 2), {empty_key, none}) {}

  uint32_t find(BlockKey key) const {
    for (size_t s = hash(key);; ++s) {
      const Slot& slot = slot_[s & (slot_.size() - 1)];
      if (slot.key == key) return slot.value;
      if (slot.key == empty_key) return none;
    }
  }
  uint32_t find(V3i block) const {
    if (((block.x | block.y | block.z) & ~((1 << 21) - 1)) != 0) return none;  // negative or beyond
    return find(key_of(block));
  }
  /// False if the key was there already; its value then stays.
  bool insert(BlockKey key, uint32_t value) {
    if (2 * (count_ + 1) > slot_.size()) grow();
    for (size_t s = hash(key);; ++s) {
      Slot& slot = slot_[s & (slot_.size() - 1)];
      if (slot.key == key) return false;
      if (slot.key != empty_key) continue;
      slot = {key, value};
      ++count_;
      return true;
    }
  }
  size_t size() const { return count_; }

 private:
  struct Slot {
    BlockKey key;
    uint32_t value;
  };
  static constexpr BlockKey empty_key = ~BlockKey{0};

  static size_t hash(BlockKey key) {
    key *= 0x9e3779b97f4a7c15ull;
    return static_cast<size_t>(key ^ key >> 29);
  }
  void grow() {
    BlockMap bigger(2 * slot_.size());
    for (const Slot& slot : slot_)
      if (slot.key != empty_key) bigger.insert(slot.key, slot.value);
    *this = std::move(bigger);
  }

  std::vector<Slot> slot_;
  size_t count_ = 0;
};

}  // namespace drench::surfacing
