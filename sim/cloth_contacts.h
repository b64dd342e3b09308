#pragma once

#include <cstdint>

namespace drench::sim {

/// Contacts of implicit sheets that bear in the step's solve.
struct ClothContacts {
  uint64_t sheets = 0;     // pairs of a vertex and a triangle, or of two edges
  uint64_t obstacles = 0;  // vertices, and points within triangles
};

}  // namespace drench::sim
