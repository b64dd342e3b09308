#pragma once
// A narrow-band level set in plain arrays, for code that links no OpenVDB: blocks of 8^3 voxels
// whose 9^3 corner values are kept together, so that a trilinear sample reads one block.

#include <functional>
#include <vector>

namespace drench {

struct TriangleMesh;  // frames.h, whose Imath nvcc does not take

/// Signed distance, negative inside. Block (i, j, k) spans voxels 8 (low + (i, j, k)) up to 8 more
/// along each axis; corner values lie at multiples of the voxel.
struct LevelSet {
  static constexpr int side = 8, corners = 9 * 9 * 9;
  static constexpr int outside = -1, inside = -2;  // blocks without values: beyond the band

  float voxel = 0;  // m
  float band = 0;   // m; farther off only the sign is known, and samples up to two voxels nearer
                    // may fall short
  int low[3] = {0, 0, 0}, blocks[3] = {0, 0, 0};
  std::vector<int> block;    // x fastest: which run of `corners` values, or outside or inside
  std::vector<float> value;  // m, x fastest; shared faces are repeated
};

/// What a level set may be and must be: where it is asked, and what it may take.
struct LevelSetBounds {
  double low[3] = {-1e30, -1e30, -1e30}, high[3] = {1e30, 1e30, 1e30};  // m, own coordinates
  double most_bytes = 8.0 * (1 << 30);  // while it is made, 0: no limit
};

/// Makes level sets of closed meshes: make_level_set of drench_vdb.
using LevelSetMaker = std::function<LevelSet(const TriangleMesh& mesh, double voxel, double band,
                                             const LevelSetBounds& bounds)>;

/// Narrow-band level set of a closed mesh: distances by OpenVDB, exact near triangles; inside as
/// find_shells (shells.h) says, whatever the orientation. Library drench_vdb.
/// @param voxel, band  m. @param bounds  what reaches beyond them is made within them only if it
/// would take more than 256 MiB; samples beyond are outside then.
/// @throws Error, before it takes any, if it would take more memory than it may or there is.
LevelSet make_level_set(const TriangleMesh& mesh, double voxel, double band,
                        const LevelSetBounds& bounds = {});

/// make_level_set, each within so many GiB; 0: as LevelSetBounds has it.
LevelSetMaker level_sets_within(double gib);

}  // namespace drench
