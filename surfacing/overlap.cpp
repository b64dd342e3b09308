#include "surfacing/overlap.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace drench::surfacing {
namespace {

/// How far the ray from a point on a solid goes through it, voxels; large where nothing near ends
/// it.
float thickness(const NearTriangles& solids, V3i block, const V3f& from, const V3f& direction) {
  float least = 1e30f;
  solids.for_each_near(block, [&](uint32_t triangle) {
    const auto& t = solids.corners(triangle);
    const V3f u = t[1] - t[0], v = t[2] - t[0], normal = u.cross(v);
    const float rate = normal.dot(direction);
    if (!(rate > 0)) return;  // seen from outside, or along it
    const float distance = normal.dot(t[0] - from) / rate;
    if (distance < 0 || distance >= least) return;
    const V3f at = from + direction * distance - t[0];
    const float b = normal.dot(at.cross(v)), c = normal.dot(u.cross(at)), all = normal.dot(normal);
    if (b >= 0 && c >= 0 && b + c <= all) least = distance;
  });
  return least;
}

V3f pressed(const NearTriangles& solids, V3i block, const V3f& p, float spacing) {
  const Foot foot = solids.foot(block, p);
  if (!foot.found()) return p;
  const V3f away = p - foot.point;
  const float side = away.dot(foot.normal) < 0 ? -1.f : 1.f, distance = side * foot.distance;
  const float reach = 0.6f * spacing;
  if (distance >= reach) return p;
  const V3f outward = foot.distance > 1e-3f * spacing ? away * (side / foot.distance) : foot.normal;
  const float room = 0.5f * thickness(solids, block, foot.point, -outward) + distance;
  const float push = 0.75f * spacing * (1 - std::max(distance, 0.f) / reach);
  return p - outward * std::clamp(push, 0.f, std::max(room, 0.f));
}

float stretched(float y, float ground, float spacing) {
  const float height = y - ground;
  return height < spacing ? y - spacing + std::max(height, -spacing) : y;
}

}  // namespace

std::vector<uint8_t> overlap_solids(LatticeMesh& mesh, const ClothContact& contact,
                                    const NearTriangles& solids, std::optional<float> ground,
                                    float spacing) {
  if (solids.empty() && !ground) return {};
  std::vector<uint8_t> moved(mesh.position.size(), 0);
  tbb::parallel_for(size_t{0}, mesh.block.size(), [&](size_t b) {
    const BlockVertices& range = mesh.block[b];
    const bool near = solids.near(range.block);
    for (uint32_t v = range.begin; v < range.end; ++v) {
      if (!contact.side.empty() && contact.side[v]) continue;
      V3f p = mesh.position[v];
      if (near) p = pressed(solids, range.block, p, spacing);
      if (ground) p.y = stretched(p.y, *ground, spacing);
      moved[v] = p != mesh.position[v];
      mesh.position[v] = p;
    }
  });
  return moved;
}

}  // namespace drench::surfacing
