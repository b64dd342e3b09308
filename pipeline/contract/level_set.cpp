#include "pipeline/contract/level_set.h"

#include <fmt/format.h>
#include <openvdb/tools/MeshToVolume.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <stdexcept>

#include "pipeline/contract/error.h"
#include "pipeline/contract/vdb_archive.h"

namespace drench {

namespace {

openvdb::FloatGrid::Ptr narrow_band(const TriangleMesh& mesh, double voxel, double band) {
  std::vector<openvdb::Vec3s> positions;
  positions.reserve(mesh.position.size());
  for (const Imath::V3f& x : mesh.position) positions.emplace_back(x.x, x.y, x.z);
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(mesh.triangle.size());
  for (const auto& t : mesh.triangle) triangles.emplace_back(t.x, t.y, t.z);
  initialize_vdb();
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
  const float width = float(band / voxel) + 1;
  return openvdb::tools::meshToSignedDistanceField<openvdb::FloatGrid>(*transform, positions,
                                                                       triangles, {}, width, width);
}

/// Blocks that the active voxels touch, and a rim so that a sample beside them finds a block.
void frame_blocks(const openvdb::CoordBBox& box, LevelSet& set) {
  double total = 1;
  for (int k = 0; k < 3; ++k) {
    set.low[k] = int(std::floor(double(box.min()[k]) / LevelSet::side)) - 1;
    set.blocks[k] = int(std::floor(double(box.max()[k]) / LevelSet::side)) + 2 - set.low[k];
    total *= set.blocks[k];
  }
  if (total > 1e9) {
    throw Error(
        fmt::format("an obstacle's mesh spans {} x {} x {} blocks of {} voxels of {} m; "
                    "use a larger fluid.spacing or a smaller mesh",
                    set.blocks[0], set.blocks[1], set.blocks[2], LevelSet::side, set.voxel));
  }
}

}  // namespace

LevelSet make_level_set(const TriangleMesh& mesh, double voxel, double band) {
  if (!(voxel > 0) || !(band >= voxel)) throw std::logic_error("make_level_set: voxel or band");
  const openvdb::FloatGrid::Ptr grid = narrow_band(mesh, voxel, band);
  LevelSet set;
  set.voxel = float(voxel), set.band = float(band);
  frame_blocks(grid->evalActiveVoxelBoundingBox(), set);
  const int bx = set.blocks[0], by = set.blocks[1], total = bx * by * set.blocks[2];
  set.block.assign(size_t(total), LevelSet::outside);
  const auto origin = [&](int b) {
    constexpr int side = LevelSet::side;
    return openvdb::Coord(side * (set.low[0] + b % bx), side * (set.low[1] + b / bx % by),
                          side * (set.low[2] + b / bx / by));
  };
  // A block has values if any of its corners lies in the band.
  std::vector<char> wanted(size_t(total), 0);
  ::tbb::parallel_for(0, total, [&](int b) {
    auto at = grid->getConstAccessor();
    const openvdb::Coord low = origin(b);
    for (int k = 0; k < LevelSet::corners && !wanted[size_t(b)]; ++k)
      wanted[size_t(b)] = at.isValueOn(low + openvdb::Coord(k % 9, k / 9 % 9, k / 81));
    if (!wanted[size_t(b)] && at.getValue(low) < 0) set.block[size_t(b)] = LevelSet::inside;
  });
  int count = 0;
  for (int b = 0; b < total; ++b)
    if (wanted[size_t(b)]) set.block[size_t(b)] = count++;
  set.value.resize(size_t(count) * LevelSet::corners);
  ::tbb::parallel_for(0, total, [&](int b) {
    if (set.block[size_t(b)] < 0) return;
    auto at = grid->getConstAccessor();
    const openvdb::Coord low = origin(b);
    float* to = set.value.data() + size_t(set.block[size_t(b)]) * LevelSet::corners;
    for (int k = 0; k < LevelSet::corners; ++k) {
      const float d = at.getValue(low + openvdb::Coord(k % 9, k / 9 % 9, k / 81));
      to[k] = std::clamp(d, -set.band, set.band);
    }
  });
  return set;
}

}  // namespace drench
