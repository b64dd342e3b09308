#pragma once
// Cuts a polygon of a mesh file into triangles.

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace drench {

/// Triangles of a simple polygon, as indices of its corners, oriented as it is. A polygon that is
/// convex along its normal becomes a fan around corner 0 if none of its triangles is a sliver; any
/// other loses its ears one by one (Meisters 1975, "Polygons have ears"), slivers last. Corners off
/// its mean plane are projected onto it (Newell's normal: Tampieri 1992). Corners may coincide, so
/// that a hole can be joined to the rim by a slit. A polygon without area becomes a fan.
/// @param corner  n >= 3 positions, m, in order; every one finite.
/// @return n - 2 triangles; none if the polygon crosses itself, or is not convex and has more than
/// most_corners.
std::optional<std::vector<std::array<uint32_t, 3>>> triangulate(std::span<const Imath::V3f> corner);

/// Of a polygon that is not convex: its edges are tried against one another.
inline constexpr size_t most_corners = 4096;

}  // namespace drench
