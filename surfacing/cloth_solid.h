#pragma once
// Cloth on the lattice: fluid keeps off them while it is meshed, and lies on them after.
//
// The field is cut to a gap around it, wide enough that no edge of the lattice spans it:
// films on two sides stay apart, and a film on one side has its surface there. After smoothing the
// vertices of the gap go back to the cloth, but for a small distance, and faces between them are
// contact: no water meets air there.

#include <array>
#include <span>
#include <vector>

#include "surfacing/field.h"
#include "surfacing/near_triangles.h"

namespace drench::surfacing {

class ClothSolids : public NearTriangles {
 public:
  static constexpr float gap = 0.9f;           // voxels to either side
  static constexpr float reach = gap + 1.05f;  // within which feet are found, voxels

  ClothSolids() = default;
  /// @param meshes  with velocities. @throws Error as NearTriangles.
  ClothSolids(std::span<const TriangleMesh> meshes, const BinnedParticles& particles);

  /// Cuts the field of a block to the gap.
  void cut(V3i block, BlockValues& value, float iso_value) const;
  /// Of the cloth at a foot, m/s.
  V3f velocity(const Foot& foot) const;

 private:
  std::vector<std::array<V3f, 3>> velocity_;  // m/s, by triangle
};

}  // namespace drench::surfacing
