#include "surfacing/cloth_solid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"
#include "pipeline/contract/geometry/triangle.h"

namespace drench::surfacing {
namespace {

int floor_to_int(float v) { return static_cast<int>(std::floor(v)); }

constexpr const char* cure = "the frame of the cloth is damaged, simulate it again";

}  // namespace

ClothSolids::ClothSolids(std::span<const TriangleMesh> meshes, const BinnedParticles& particles)
    : NearTriangles(meshes, particles, reach, "sheet", cure) {
  for (size_t m = 0; m < meshes.size(); ++m) {
    const TriangleMesh& mesh = meshes[m];
    if (mesh.velocity.size() != mesh.position.size())
      throw Error(fmt::format("surfacing: sheet {}: {} velocities for {} vertices; {}", m,
                              mesh.velocity.size(), mesh.position.size(), cure));
    for (const auto& t : mesh.triangle)
      velocity_.push_back({mesh.velocity[t.x], mesh.velocity[t.y], mesh.velocity[t.z]});
  }
}

void ClothSolids::cut(V3i block, BlockValues& value, float iso_value) const {
  constexpr float slope = 0.25f;  // of the field in a voxel, about that at a surface
  std::array<float, block_size> distance;
  distance.fill(reach);
  const V3f origin(block * block_edge);
  for_each_near(block, [&](uint32_t triangle) {
    const auto& t = corners(triangle);
    const TriangleBox box = box_of(t, reach);
    V3i low, high;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::max(0, floor_to_int(box.low[axis] - origin[axis]));
      high[axis] = std::min(block_edge - 1, floor_to_int(box.high[axis] - origin[axis]));
    }
    for (int z = low.z; z <= high.z; ++z)
      for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) {
          const V3f p = origin + V3f(V3i(x, y, z));
          float& least = distance[(static_cast<size_t>(z) * block_edge + y) * block_edge + x];
          if (!sphere(triangle).within(p, least)) continue;
          least = std::min(least, (closest_on_triangle(p, t[0], t[1], t[2]) - p).length());
        }
  });
  for (size_t k = 0; k < block_size; ++k) {
    if (distance[k] >= reach) continue;
    value[k] = std::min(value[k], iso_value + slope * (distance[k] - gap));
  }
}

V3f ClothSolids::velocity(const Foot& foot) const {
  const auto& v = velocity_[foot.triangle];
  return v[0] * foot.weight.x + v[1] * foot.weight.y + v[2] * foot.weight.z;
}

}  // namespace drench::surfacing
