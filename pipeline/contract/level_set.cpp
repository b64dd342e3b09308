#include "pipeline/contract/level_set.h"

#include <fmt/format.h>
#include <openvdb/tools/MeshToVolume.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "pipeline/contract/error.h"
#include "pipeline/contract/frames.h"
#include "pipeline/contract/triangle.h"
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

/// Within this of a triangle distances are exact, voxels. OpenVDB takes the nearest of the
/// triangles that it has handed from voxel to voxel: up to 0.2 voxels too far on a fine sphere, one
/// below.
constexpr double refined = 2;

struct Span {
  openvdb::Coord low, high;  // voxels, inclusive
};
Span span_of(const TriangleMesh& mesh, uint32_t triangle, double voxel) {
  Span span;
  const auto& t = mesh.triangle[triangle];
  for (int k = 0; k < 3; ++k) {
    const double a = mesh.position[t.x][k], b = mesh.position[t.y][k], c = mesh.position[t.z][k];
    span.low[k] = int(std::ceil(std::min({a, b, c}) / voxel - refined));
    span.high[k] = int(std::floor(std::max({a, b, c}) / voxel + refined));
  }
  return span;
}

/// Triangles that may be within `refined` of a block's corners, in order.
std::vector<std::vector<uint32_t>> triangles_by_block(const TriangleMesh& mesh,
                                                      const LevelSet& set) {
  std::vector<std::vector<uint32_t>> near(set.block.size());
  const auto block = [&](int voxel, int k) {
    const int b = int(std::floor(double(voxel) / LevelSet::side)) - set.low[k];
    return std::clamp(b, 0, set.blocks[k] - 1);
  };
  for (uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    const Span span = span_of(mesh, t, set.voxel);
    // The lower corners of a block are the upper ones of the block before.
    for (int z = block(span.low[2] - 1, 2); z <= block(span.high[2], 2); ++z) {
      for (int y = block(span.low[1] - 1, 1); y <= block(span.high[1], 1); ++y) {
        for (int x = block(span.low[0] - 1, 0); x <= block(span.high[0], 0); ++x)
          near[size_t((z * set.blocks[1] + y) * set.blocks[0] + x)].push_back(t);
      }
    }
  }
  return near;
}

/// Exact distances to one triangle where they are less; the sign stays.
void refine(const TriangleMesh& mesh, uint32_t triangle, const openvdb::Coord& low, float voxel,
            float* value) {
  Span span = span_of(mesh, triangle, voxel);
  for (int k = 0; k < 3; ++k) {
    span.low[k] = std::max(span.low[k] - low[k], 0);
    span.high[k] = std::min(span.high[k] - low[k], LevelSet::side);
  }
  const auto& t = mesh.triangle[triangle];
  const Imath::V3f &a = mesh.position[t.x], &b = mesh.position[t.y], &c = mesh.position[t.z];
  for (int z = span.low[2]; z <= span.high[2]; ++z) {
    for (int y = span.low[1]; y <= span.high[1]; ++y) {
      for (int x = span.low[0]; x <= span.high[0]; ++x) {
        const Imath::V3f p(float(low[0] + x) * voxel, float(low[1] + y) * voxel,
                           float(low[2] + z) * voxel);
        float& d = value[(z * 9 + y) * 9 + x];
        const float exact = (p - closest_on_triangle(p, a, b, c)).length();
        if (exact < std::abs(d)) d = std::copysign(exact, d);
      }
    }
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
  const std::vector<std::vector<uint32_t>> near = triangles_by_block(mesh, set);
  ::tbb::parallel_for(0, total, [&](int b) {
    if (set.block[size_t(b)] < 0) return;
    auto at = grid->getConstAccessor();
    const openvdb::Coord low = origin(b);
    float* to = set.value.data() + size_t(set.block[size_t(b)]) * LevelSet::corners;
    for (int k = 0; k < LevelSet::corners; ++k) {
      const float d = at.getValue(low + openvdb::Coord(k % 9, k / 9 % 9, k / 81));
      to[k] = std::clamp(d, -set.band, set.band);
    }
    for (const uint32_t t : near[size_t(b)]) refine(mesh, t, low, set.voxel, to);
  });
  return set;
}

}  // namespace drench
