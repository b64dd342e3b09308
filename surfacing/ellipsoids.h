#pragma once
// Kernels that are no balls.

#include <Imath/ImathVec.h>

#include <cstdint>
#include <vector>

namespace drench::surfacing {

/// weight s det A W(|A d| / support) in place of weight s W(|d| / support), d from the
/// centre: 1 along the longest axis of A, at most 4 along the others.
struct Ellipsoid {
  float xx, yy, zz, xy, xz, yz;  // A A, symmetric
  float peak;                    // weight det A
  Imath::V3f shift;              // of the centre from the particle, voxels
  float pull;  // fraction by which the field is too thick / (square of the squeeze - 1)
};

/// The particles whose kernel is an ellipsoid; that of all others is round.
struct Ellipsoids {
  static constexpr uint32_t none = ~0u;
  std::vector<uint32_t> of;  // of each particle the index in `shape`, or none; empty: all round
  std::vector<Ellipsoid> shape;
  std::vector<uint8_t> in_block;  // by occupied block: 1 where there are any

  const Ellipsoid* find(uint32_t particle) const {
    return of.empty() || of[particle] == none ? nullptr : &shape[of[particle]];
  }
  double bytes() const {
    return static_cast<double>(of.size() * sizeof(of[0]) + shape.size() * sizeof(shape[0]));
  }
};

}  // namespace drench::surfacing
