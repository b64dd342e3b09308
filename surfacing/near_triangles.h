#pragma once
// Triangles of what is no fluid (cloth, obstacles) near the fluid, by blocks of the lattice.

#include <span>
#include <vector>

#include "surfacing/particle_bins.h"

namespace drench::surfacing {

/// The nearest point of the triangles.
struct Foot {
  float distance = 1e30f;  // voxels
  V3f point{0};            // voxels from the lattice's origin
  V3f normal{0};           // of the triangle, unit
  uint32_t triangle = ~0u;
  V3f weight{0};  // of the triangle's corners

  bool found() const { return triangle != ~0u; }
};

/// Sphere around a triangle: most triangles are passed by for it alone.
struct TriangleSphere {
  V3f center{0};
  float radius = 0;

  explicit TriangleSphere(const std::array<V3f, 3>& t);
  /// Whether some of it may come as near to p as this.
  bool within(const V3f& p, float distance) const {
    const float sum = (radius + distance) * (1 + 1e-5f);  // more than rounding
    return (p - center).length2() <= sum * sum;
  }
};

class NearTriangles {
 public:
  NearTriangles() = default;
  /// @param meshes  positions in m, world; taken together. Only what is near a particle is kept.
  /// @param reach   within which feet are found, voxels
  /// @param what    the meshes are, and what to do about a damaged one: for errors
  /// @throws Error if a position is not finite or an index is beyond the vertices.
  NearTriangles(std::span<const TriangleMesh> meshes, const BinnedParticles& particles, float reach,
                const char* what, const char* cure);

  bool empty() const { return corner_.empty(); }
  bool near(V3i block) const { return !empty() && map_.find(block) != BlockMap::none; }
  /// The nearest point within reach of p, a point of `block` or up to half a voxel beyond.
  Foot foot(V3i block, const V3f& p) const;
  /// Calls f(triangle) for the triangles that come within reach of a block.
  template <class F>
  void for_each_near(V3i block, F f) const {
    const uint32_t list = map_.find(block);
    if (list == BlockMap::none) return;
    for (uint32_t k = first_[list]; k < first_[list + 1]; ++k) f(member_[k]);
  }
  const std::array<V3f, 3>& corners(uint32_t triangle) const { return corner_[triangle]; }
  const TriangleSphere& sphere(uint32_t triangle) const { return sphere_[triangle]; }

 private:
  void list_near(const BinnedParticles& particles);

  float reach_ = 0;
  std::vector<std::array<V3f, 3>> corner_;  // voxels from the lattice's origin
  std::vector<TriangleSphere> sphere_;
  BlockMap map_;  // block -> its list
  std::vector<uint32_t> first_, member_;
};

/// Box around a triangle, grown to every side.
struct TriangleBox {
  V3f low, high;
};
TriangleBox box_of(const std::array<V3f, 3>& t, float grown);

}  // namespace drench::surfacing
