#pragma once
// Sheets of cloth on the lattice: fluid keeps off them while it is meshed, and lies on them after.
//
// The field is cut to a gap around every sheet, wide enough that no edge of the lattice spans it:
// films on two sides stay apart, and a film on one side has its surface there. After smoothing the
// vertices of the gap go back to the sheet, but for a small distance, and faces between them are
// contact: no water meets air there.

#include <span>
#include <vector>

#include "surfacing/field.h"

namespace drench::surfacing {

/// The nearest point of the sheets.
struct SheetFoot {
  float distance = 1e30f;  // voxels
  V3f place{0};            // voxels from the lattice's origin
  V3f normal{0};           // of the triangle, unit
  uint32_t triangle = ~0u;
  V3f weight{0};  // of the triangle's corners

  bool found() const { return triangle != ~0u; }
};

class Sheets {
 public:
  static constexpr float gap = 0.9f;          // voxels to either side
  static constexpr float reach = gap + 1.05f;  // within which feet are found, voxels

  Sheets() = default;
  /// @param meshes  positions in m, world, and velocities; taken together. Only what is near a
  /// particle is kept. @throws Error if a position is not finite or an index is beyond the
  /// vertices.
  Sheets(std::span<const TriangleMesh> meshes, const BinnedParticles& particles);

  bool empty() const { return corner_.empty(); }
  bool near(V3i block) const { return !empty() && map_.find(block) != BlockMap::none; }
  /// Cuts the field of a block to the gap.
  void cut(FieldBlock& field, float iso_value) const;
  /// The nearest point within reach of p, a point of `block` or up to half a voxel beyond.
  SheetFoot foot(V3i block, const V3f& p) const;
  /// Calls f(triangle) for the triangles that come within reach of a block.
  template <class F>
  void for_each_near(V3i block, F f) const {
    const uint32_t list = map_.find(block);
    if (list == BlockMap::none) return;
    for (uint32_t k = first_[list]; k < first_[list + 1]; ++k) f(member_[k]);
  }
  const std::array<V3f, 3>& corners(uint32_t triangle) const { return corner_[triangle]; }
  /// Of the sheet at a foot, m/s.
  V3f velocity(const SheetFoot& foot) const;

 private:
  void list_near(const BinnedParticles& particles);

  std::vector<std::array<V3f, 3>> corner_;    // voxels from the lattice's origin
  std::vector<std::array<V3f, 3>> velocity_;  // m/s
  BlockMap map_;                              // block -> its list
  std::vector<uint32_t> first_, member_;
};

}  // namespace drench::surfacing
