#pragma once
// What the triangles of shells are strained by, for files.

#include <vector>

#include "sim/solver.h"

namespace drench::sim {

/// Of a vertex, the mean over its triangles by area. Principal strains are length over rest length
/// less 1. Stresses are elastic, that of the strain limit with them but not that of the inner
/// friction: force over the width that a sheet has now, N/m.
struct ClothStrain {
  float strain_max = 0, strain_min = 0, stress_max = 0, stress_min = 0;
};

/// @param vertices  of one sheet, which must be a shell
std::vector<ClothStrain> cloth_strain(const ClothTopology& cloth, const HostState& state,
                                      VertexRange vertices);

}  // namespace drench::sim
