#include "surfacing/marching_cubes.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>

#include "pipeline/contract/error.h"
#include "surfacing/marching_cubes_table.h"

namespace drench::surfacing {
namespace {

constexpr int corner_edge = block_edge + 1;  // lattice points along the edge of a block's cells

/// What a block owns: the cut edges that start at its lattice points, and its cells' triangles.
struct BlockPlan {
  uint32_t field = 0;
  uint32_t first_vertex = 0, vertices = 0;
  uint32_t first_triangle = 0, triangles = 0;
  std::array<std::array<uint64_t, block_edge>, 3> cut{};   // axis, z: bit 8 y + x: the edge is cut
  std::array<std::array<uint16_t, block_edge>, 3> rank{};  // cut edges before the layer

  uint32_t vertex(int axis, int x, int y, int z) const {
    const uint64_t before = cut[axis][z] & ((uint64_t{1} << (block_edge * y + x)) - 1);
    return first_vertex + rank[axis][z] + static_cast<uint32_t>(std::popcount(before));
  }
};

/// Blocks at +0 or +1 along each axis, bit a of the index for axis a; none where not evaluated.
using Upper = std::array<uint32_t, 8>;

Upper upper_blocks(const ColourField& field, uint32_t f) {
  Upper upper;
  for (int k = 0; k < 8; ++k)
    upper[k] = field.map.find(field.block[f].block + V3i(k & 1, k >> 1 & 1, k >> 2));
  return upper;
}

/// Inside bits of the 9^3 points of a block's cells, bit x of a row. The points of a block that was
/// not evaluated are on the side of their neighbours (evaluate_field sees to it): taken from below.
using InsideRows = std::array<std::array<uint16_t, corner_edge>, corner_edge>;

InsideRows inside_rows(const ColourField& field, const Upper& upper) {
  InsideRows inside{};
  const auto byte = [&](uint32_t f, int z, int y) {
    return field.block[f].inside[z * block_edge + y];
  };
  for (int z = 0; z < corner_edge; ++z)
    for (int y = 0; y < corner_edge; ++y) {
      int k = (y == block_edge) << 1 | (z == block_edge) << 2;
      int yy = y % block_edge, zz = z % block_edge;
      if (upper[k] == BlockMap::none) {  // the row's own block, at its last layer
        k = 0;
        yy = std::min(y, block_edge - 1);
        zz = std::min(z, block_edge - 1);
      }
      const unsigned low = byte(upper[k], zz, yy);
      const uint32_t next = upper[k | 1];
      const unsigned high = next == BlockMap::none ? low >> 7 : byte(next, zz, yy) & 1u;
      inside[z][y] = static_cast<uint16_t>(low | high << block_edge);
    }
  return inside;
}

/// Calls f(x, y, z, case) for every cell with corners on both sides.
template <class F>
void for_each_cut_cell(const InsideRows& inside, F f) {
  for (int z = 0; z < block_edge; ++z)
    for (int y = 0; y < block_edge; ++y) {
      const unsigned row[4] = {inside[z][y], inside[z][y + 1], inside[z + 1][y],
                               inside[z + 1][y + 1]};
      const unsigned any = row[0] | row[1] | row[2] | row[3];
      const unsigned all = row[0] & row[1] & row[2] & row[3];
      unsigned mixed = (any | any >> 1) & ~(all & all >> 1) & 0xff;
      for (; mixed != 0; mixed &= mixed - 1) {
        const int x = std::countr_zero(mixed);
        unsigned index = 0;
        for (int k = 0; k < 4; ++k) index |= (row[k] >> x & 3) << 2 * k;
        f(x, y, z, index);
      }
    }
}

bool may_hold_surface(const FieldBlock& field) {
  // Points of a block that are all outside start no cut edge unless an upper neighbour is inside.
  return std::any_of(field.inside.begin(), field.inside.end(), [](uint8_t v) { return v != 0; });
}

/// Blocks, in order, of which an upper neighbour or they themselves may hold surface.
std::vector<uint32_t> blocks_with_surface(const ColourField& field) {
  std::vector<uint8_t> any(field.order.size());
  tbb::parallel_for(size_t{0}, any.size(), [&](size_t k) {
    const Upper upper = upper_blocks(field, field.order[k]);
    any[k] = std::any_of(upper.begin(), upper.end(), [&](uint32_t f) {
      return f != BlockMap::none && may_hold_surface(field.block[f]);
    });
  });
  std::vector<uint32_t> blocks;
  for (size_t k = 0; k < any.size(); ++k)
    if (any[k]) blocks.push_back(field.order[k]);
  return blocks;
}

void plan_block(const ColourField& field, BlockPlan& plan) {
  const InsideRows inside = inside_rows(field, upper_blocks(field, plan.field));
  uint32_t count = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int z = 0; z < block_edge; ++z) {
      uint64_t& cut = plan.cut[axis][z];
      for (int y = 0; y < block_edge; ++y) {
        const unsigned here = inside[z][y];
        const unsigned there = axis == 0   ? here >> 1
                               : axis == 1 ? inside[z][y + 1]
                                           : inside[z + 1][y];
        cut |= uint64_t{static_cast<uint8_t>(here ^ there)} << block_edge * y;
      }
      plan.rank[axis][z] = static_cast<uint16_t>(count);
      count += static_cast<uint32_t>(std::popcount(cut));
    }
  plan.vertices = count;
  const auto& table = marching_cubes_table();
  for_each_cut_cell(
      inside, [&](int, int, int, unsigned index) { plan.triangles += table[index].triangles; });
}

/// Point on the cut edge. Kept a little off the lattice points, so that triangles keep an area.
float cut_at(float here, float there, float iso_value) {
  constexpr float margin = 1.f / 256;
  return std::clamp((iso_value - here) / (there - here), margin, 1 - margin);
}

void emit_vertices(const ColourField& field, const BlockPlan& plan, float iso_value,
                   std::vector<V3f>& position) {
  const Upper upper = upper_blocks(field, plan.field);
  const V3f corner(field.block[plan.field].block * block_edge);
  uint32_t next = plan.first_vertex;
  for (int axis = 0; axis < 3; ++axis)
    for (int z = 0; z < block_edge; ++z)
      for (uint64_t bits = plan.cut[axis][z]; bits != 0; bits &= bits - 1) {
        const int bit = std::countr_zero(bits);
        const V3i at(bit % block_edge, bit / block_edge, z);
        V3i end = at;
        ++end[axis];
        const uint32_t other = end[axis] < block_edge ? plan.field : upper[1 << axis];
        end[axis] %= block_edge;
        const auto value = [&](uint32_t f, V3i p) {
          return field.value[f][(p.z * block_edge + p.y) * block_edge + p.x];
        };
        V3f p = corner + V3f(at);
        p[axis] += cut_at(value(plan.field, at), value(other, end), iso_value);
        position[next++] = p;
      }
}

void emit_triangles(const ColourField& field, const std::vector<BlockPlan>& plans,
                    const std::vector<uint32_t>& plan_of, const BlockPlan& plan,
                    std::vector<Triangle>& triangle) {
  const Upper upper = upper_blocks(field, plan.field);
  const InsideRows inside = inside_rows(field, upper);
  const auto& table = marching_cubes_table();
  uint32_t next = plan.first_triangle;
  for_each_cut_cell(inside, [&](int x, int y, int z, unsigned index) {
    const auto vertex = [&](int edge) {
      const CubeEdge e = cube_edge(edge);
      const int ex = x + (e.start & 1), ey = y + (e.start >> 1 & 1), ez = z + (e.start >> 2);
      const uint32_t owner = upper[ex / block_edge | ey / block_edge << 1 | ez / block_edge << 2];
      return plans[plan_of[owner]].vertex(e.axis, ex % block_edge, ey % block_edge,
                                          ez % block_edge);
    };
    const CubeCase& cube = table[index];
    for (int t = 0; t < cube.triangles; ++t) {
      const auto& edge = cube.edge[t];
      triangle[next++] = {vertex(edge[0]), vertex(edge[1]), vertex(edge[2])};
    }
  });
}

}  // namespace

LatticeMesh extract_surface(ColourField field, float iso_value, double max_bytes) {
  const std::vector<uint32_t> with_surface = blocks_with_surface(field);
  std::vector<BlockPlan> plans(with_surface.size());
  tbb::parallel_for(size_t{0}, plans.size(), [&](size_t k) {
    plans[k].field = with_surface[k];
    plan_block(field, plans[k]);
  });
  std::erase_if(plans, [](const BlockPlan& p) { return p.vertices == 0 && p.triangles == 0; });
  size_t vertices = 0, triangles = 0;
  std::vector<uint32_t> plan_of(field.block.size(), BlockMap::none);
  for (BlockPlan& plan : plans) {
    plan_of[plan.field] = static_cast<uint32_t>(&plan - plans.data());
    plan.first_vertex = static_cast<uint32_t>(vertices);
    plan.first_triangle = static_cast<uint32_t>(triangles);
    vertices += plan.vertices;
    triangles += plan.triangles;
  }
  // A vertex has position, velocity, normal and, while smoothing, three more points and its edges.
  const double bytes = static_cast<double>(vertices) * 110 + static_cast<double>(triangles) * 12;
  if (bytes > max_bytes || triangles > UINT32_MAX / 3)
    throw Error(
        fmt::format("surfacing: {} triangles need {:.3g} GiB, more than the {:.3g} GiB left of "
                    "surface.memory_gib; raise surface.memory_gib or surface.voxel",
                    triangles, bytes / (1 << 30), max_bytes / (1 << 30)));
  LatticeMesh mesh;
  mesh.position.resize(vertices);
  for (const BlockPlan& plan : plans)
    if (plan.vertices > 0)
      mesh.block.push_back(
          {field.block[plan.field].block, plan.first_vertex, plan.first_vertex + plan.vertices});
  tbb::parallel_for(size_t{0}, plans.size(),
                    [&](size_t k) { emit_vertices(field, plans[k], iso_value, mesh.position); });
  field.value = std::vector<BlockValues>();  // frees them
  mesh.triangle.resize(triangles);
  tbb::parallel_for(size_t{0}, plans.size(), [&](size_t k) {
    emit_triangles(field, plans, plan_of, plans[k], mesh.triangle);
  });
  return mesh;
}

}  // namespace drench::surfacing
