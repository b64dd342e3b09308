#include "surfacing/cloth_contact.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <utility>

#include "surfacing/slivers.h"

namespace drench::surfacing {
namespace {

/// Calls f(block, v) for the vertices of the blocks that are near cloth.
template <class F>
void for_each_near_vertex(const LatticeMesh& mesh, const ClothSolids& cloth, F f) {
  tbb::parallel_for(size_t{0}, mesh.block.size(), [&](size_t b) {
    const BlockVertices& range = mesh.block[b];
    if (!cloth.near(range.block)) return;
    for (uint32_t v = range.begin; v < range.end; ++v) f(range.block, v);
  });
}

V3i block_of_vertex(const LatticeMesh& mesh, uint32_t v) {
  const auto after =
      std::upper_bound(mesh.block.begin(), mesh.block.end(), v,
                       [](uint32_t i, const BlockVertices& b) { return i < b.begin; });
  return std::prev(after)->block;
}

/// Does the segment from p to q pass through the triangle?
bool pierces(const V3d& p, const V3d& q, const std::array<V3d, 3>& t) {
  const V3d u = t[1] - t[0], v = t[2] - t[0], normal = u.cross(v);
  const double from = normal.dot(p - t[0]), to = normal.dot(q - t[0]);
  if ((from > 0) == (to > 0)) return false;
  const V3d at = p + (q - p) * (from / (from - to));
  for (int k = 0; k < 3; ++k)
    if (normal.dot((t[(k + 1) % 3] - t[k]).cross(at - t[k])) < 0) return false;
  return true;
}

using Corners = std::array<V3f, 3>;

bool boxes_meet(const Corners& a, const Corners& b) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto [a0, a1] = std::minmax({a[0][axis], a[1][axis], a[2][axis]});
    const auto [b0, b1] = std::minmax({b[0][axis], b[1][axis], b[2][axis]});
    if (a1 < b0 || b1 < a0) return false;
  }
  return true;
}

bool cross_each_other(const Corners& a, const Corners& b) {
  if (!boxes_meet(a, b)) return false;
  const std::array<V3d, 3> c{V3d(a[0]), V3d(a[1]), V3d(a[2])}, d{V3d(b[0]), V3d(b[1]), V3d(b[2])};
  for (int k = 0; k < 3; ++k)
    if (pierces(c[k], c[(k + 1) % 3], d) || pierces(d[k], d[(k + 1) % 3], c)) return true;
  return false;
}

/// Those with a corner that is marked.
std::vector<uint32_t> crossing_triangles(const LatticeMesh& mesh, const ClothSolids& cloth,
                                         const std::vector<uint8_t>& marked) {
  return tbb::parallel_deterministic_reduce(
      tbb::blocked_range<uint32_t>(0, static_cast<uint32_t>(mesh.triangle.size()), 4096),
      std::vector<uint32_t>{},
      [&](const auto& range, std::vector<uint32_t> found) {
        for (uint32_t t = range.begin(); t < range.end(); ++t) {
          const Triangle& triangle = mesh.triangle[t];
          if ((marked[triangle.x] || marked[triangle.y] || marked[triangle.z]) &&
              crosses_cloth(mesh, triangle, cloth))
            found.push_back(t);
        }
        return found;
      },
      [](std::vector<uint32_t> a, const std::vector<uint32_t>& b) {
        a.insert(a.end(), b.begin(), b.end());
        return a;
      });
}

V3f laid(const ClothSolids& cloth, V3i block, const V3f& p, int side, float offset) {
  const Foot foot = cloth.foot(block, p);
  if (!foot.found()) return p;
  V3f away = p - foot.point;
  // smoothing may have moved it through
  if (away.dot(foot.normal) * static_cast<float>(side) < 0) away = -away;
  const float length = away.length();
  return foot.point + (length > 1e-3f ? away / length : foot.normal * float(side)) * offset;
}

/// p, farther from the nearest cloth.
V3f pushed(const ClothSolids& cloth, V3i block, const V3f& p, float distance) {
  const Foot foot = cloth.foot(block, p);
  if (!foot.found() || distance <= 0) return p;
  return p + (p - foot.point).normalized() * distance;
}

V3f mean_of_ring(const std::vector<V3f>& position, const VertexRings& rings, uint32_t v) {
  V3f sum(0);
  for (uint32_t k = rings.first[v]; k < rings.first[v + 1]; ++k)
    sum += position[rings.neighbour[k]];
  return sum / static_cast<float>(rings.first[v + 1] - rings.first[v]);
}

/// Moves the corners of triangles that cross cloth until none does, at most eight times.
/// @param moved  the next position of a vertex
/// @return       how many still cross
template <class F>
size_t move_until_free(LatticeMesh& mesh, const ClothSolids& cloth, F moved) {
  std::vector<uint8_t> stirred(mesh.position.size(), 0);  // vertices that may be across
  for_each_near_vertex(mesh, cloth, [&](V3i, uint32_t v) { stirred[v] = 1; });
  std::vector<uint32_t> crossing = crossing_triangles(mesh, cloth, stirred);
  for (int round = 0; round < 8 && !crossing.empty(); ++round) {
    stirred.assign(stirred.size(), 0);
    for (const uint32_t t : crossing)
      for (int k = 0; k < 3; ++k)
        if (const uint32_t v = mesh.triangle[t][k]; !std::exchange(stirred[v], 1))
          mesh.position[v] = moved(v);
    crossing = crossing_triangles(mesh, cloth, stirred);
  }
  return crossing.size();
}

}  // namespace

bool crosses_cloth(const LatticeMesh& mesh, const Triangle& t, const ClothSolids& cloth) {
  const Corners own{mesh.position[t.x], mesh.position[t.y], mesh.position[t.z]};
  const TriangleSphere around(own);
  bool crosses = false;
  V3i last(0);
  for (int k = 0; k < 3 && !crosses; ++k) {
    const V3i block = block_of_vertex(mesh, t[k]);
    if (block == std::exchange(last, block) && k > 0) continue;
    cloth.for_each_near(block, [&](uint32_t s) {
      if (!crosses && cloth.sphere(s).within(around.center, around.radius))
        crosses = cross_each_other(own, cloth.corners(s));
    });
  }
  return crosses;
}

ClothContact find_contact(const LatticeMesh& mesh, const VertexRings& rings,
                          const ClothSolids& cloth) {
  if (cloth.empty()) return {};
  ClothContact contact{std::vector<int8_t>(mesh.position.size(), 0), mesh.position};
  const std::vector<V3f> normal = normals_of(mesh, rings);
  for_each_near_vertex(mesh, cloth, [&](V3i block, uint32_t v) {
    const Foot foot = cloth.foot(block, mesh.position[v]);
    if (foot.distance > ClothSolids::gap + 0.25f) return;
    const V3f to = foot.point - mesh.position[v];
    if (normal[v].dot(to) < 0.4f * foot.distance) return;  // the far side of a thin film
    contact.side[v] = to.dot(foot.normal) < 0 ? 1 : -1;
  });
  return contact;
}

size_t lay_on_cloth(LatticeMesh& mesh, const VertexRings& rings, const ClothContact& contact,
                    const ClothSolids& cloth, const std::vector<V3f>& normal, float offset) {
  if (cloth.empty()) return 0;
  const std::vector<V3f> smooth = mesh.position;
  const auto lay = [&](V3i block, uint32_t v, const V3f& p) {
    return laid(cloth, block, p, contact.side[v], offset);
  };
  for_each_near_vertex(mesh, cloth, [&](V3i block, uint32_t v) {
    if (contact.side[v]) mesh.position[v] = lay(block, v, smooth[v]);
  });
  constexpr float cos2_15 = 0.9330f;  // of 15 degrees
  for (int pass = 0; pass < 3; ++pass) {
    const std::vector<V3f> before = mesh.position;
    for_each_near_vertex(mesh, cloth, [&](V3i block, uint32_t v) {
      if (!has_sliver(before, rings, v, cos2_15)) return;
      const V3f shift = mean_of_ring(before, rings, v) - before[v];
      mesh.position[v] = contact.side[v] ? lay(block, v, before[v] + shift)
                                         : before[v] + shift - normal[v] * normal[v].dot(shift);
    });
  }
  const std::vector<V3f> lying = mesh.position;
  std::vector<uint8_t> steps(mesh.position.size(), 0);  // back
  const auto moved_back = [&](uint32_t v) {             // half of it, smooth, extracted, farther
    steps[v] = std::max<uint8_t>(steps[v] + 1, contact.side[v] ? 1 : 3);
    if (contact.side[v] && steps[v] == 1) return (lying[v] + smooth[v]) * 0.5f;
    if (contact.side[v] && steps[v] == 2) return smooth[v];
    return pushed(cloth, block_of_vertex(mesh, v), contact.extracted[v],
                  0.25f * float(steps[v] - 3));
  };
  return move_until_free(mesh, cloth, moved_back);
}

std::vector<V3f> free_normals(const LatticeMesh& mesh, const VertexRings& rings,
                              const ClothContact& contact) {
  std::vector<V3f> normal(mesh.position.size());
  tbb::parallel_for(size_t{0}, normal.size(), [&](size_t v) {
    V3f free(0);
    rings.for_each_triangle(static_cast<uint32_t>(v), [&](uint32_t a, uint32_t b) {
      if (!contact.touches({static_cast<uint32_t>(v), a, b}))
        free += (mesh.position[a] - mesh.position[v]).cross(mesh.position[b] - mesh.position[v]);
    });
    normal[v] = unit_or(free, V3f(0));
  });
  return normal;
}

void move_with_cloth(const LatticeMesh& mesh, const ClothContact& contact, const ClothSolids& cloth,
                     std::vector<V3f>& velocity) {
  if (cloth.empty()) return;
  for_each_near_vertex(mesh, cloth, [&](V3i block, uint32_t v) {
    if (!contact.side[v]) return;
    const Foot foot = cloth.foot(block, mesh.position[v]);
    if (foot.found()) velocity[v] = cloth.velocity(foot);
  });
}

}  // namespace drench::surfacing
