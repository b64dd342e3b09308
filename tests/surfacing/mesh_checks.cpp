#include "tests/surfacing/mesh_checks.h"

#include <Imath/ImathBox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "pipeline/contract/geometry/triangle.h"

namespace drench::surfacing_checks {
namespace {

using Imath::V3d;
using Imath::V3f;

uint64_t directed(uint32_t from, uint32_t to) { return static_cast<uint64_t>(from) << 32 | to; }

double degrees_between(V3d a, V3d b) {
  return std::atan2(a.cross(b).length(), a.dot(b)) * 180 / std::numbers::pi;
}

/// Vertices whose triangles do not form exactly one ring: from any triangle (v, a, b) the step to
/// the one that starts with b must come round after all of them.
size_t count_split_fans(const TriangleMesh& mesh) {
  std::vector<std::vector<std::pair<uint32_t, uint32_t>>> around(mesh.position.size());
  for (const auto& t : mesh.triangle)
    for (int k = 0; k < 3; ++k) around[t[k]].emplace_back(t[(k + 1) % 3], t[(k + 2) % 3]);
  size_t split = 0;
  for (const auto& fan : around) {
    size_t steps = 0;
    if (!fan.empty()) {
      uint32_t at = fan[0].first;
      do {
        const auto next =
            std::find_if(fan.begin(), fan.end(), [&](const auto& w) { return w.first == at; });
        if (next == fan.end()) break;
        at = next->second;
        ++steps;
      } while (at != fan[0].first && steps <= fan.size());
      if (at != fan[0].first) steps = 0;
    }
    split += fan.empty() || steps != fan.size();
  }
  return split;
}

}  // namespace

Defects defects_of(const TriangleMesh& mesh) {
  Defects defects;
  std::vector<uint64_t> edges;
  for (const auto& t : mesh.triangle) {
    const bool in_range = std::max({t.x, t.y, t.z}) < mesh.position.size();
    if (!in_range || t.x == t.y || t.y == t.z || t.z == t.x) {
      ++defects.bad_triangles;
      continue;
    }
    for (int k = 0; k < 3; ++k) edges.push_back(directed(t[k], t[(k + 1) % 3]));
  }
  if (defects.bad_triangles > 0) return defects;
  std::sort(edges.begin(), edges.end());
  for (size_t k = 0; k < edges.size(); ++k) {
    defects.repeated_edges += k > 0 && edges[k] == edges[k - 1];
    const uint64_t opposite = edges[k] << 32 | edges[k] >> 32;
    const auto [low, high] = std::equal_range(edges.begin(), edges.end(), opposite);
    defects.unmatched_edges += high - low != 1;
  }
  defects.split_fans = count_split_fans(mesh);
  return defects;
}

Topology topology_of(const TriangleMesh& mesh) {
  std::vector<uint32_t> parent(mesh.position.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& t : mesh.triangle) {
    parent[root(t.x)] = root(t.y);
    parent[root(t.z)] = root(t.y);
  }
  Topology topology;
  for (uint32_t v = 0; v < parent.size(); ++v) topology.components += parent[v] == v;
  const long faces = static_cast<long>(mesh.triangle.size());  // of a closed mesh: 3 F = 2 E
  topology.euler = static_cast<long>(mesh.position.size()) - 3 * faces / 2 + faces;
  return topology;
}

double volume_of(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangle)
    sum += V3d(mesh.position[t.x]).dot(V3d(mesh.position[t.y]).cross(V3d(mesh.position[t.z])));
  return sum / 6;
}

SphereError sphere_error(const TriangleMesh& mesh, double radius, double unit) {
  SphereError error;
  double sum = 0, squares = 0;
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    const V3d p(mesh.position[v]);
    const double distance = (p.length() - radius) / unit;
    sum += distance;
    squares += distance * distance;
    error.max = std::max(error.max, std::abs(distance));
    const double angle = degrees_between(p, V3d(mesh.normal[v]));
    error.normal_mean += angle;
    error.normal_max = std::max(error.normal_max, angle);
  }
  const double n = static_cast<double>(mesh.position.size());
  error.bias = sum / n;
  error.scatter = std::sqrt(std::max(squares / n - error.bias * error.bias, 0.0));
  error.normal_mean /= n;
  error.volume = volume_of(mesh) / (4 * std::numbers::pi / 3 * radius * radius * radius) - 1;
  return error;
}

double sliver_share(const TriangleMesh& mesh, double degrees) {
  size_t slivers = 0;
  for (const auto& t : mesh.triangle) {
    double smallest = 180;
    for (int k = 0; k < 3; ++k) {
      const V3d p(mesh.position[t[k]]);
      smallest = std::min(smallest, degrees_between(V3d(mesh.position[t[(k + 1) % 3]]) - p,
                                                    V3d(mesh.position[t[(k + 2) % 3]]) - p));
    }
    slivers += smallest < degrees;
  }
  return static_cast<double>(slivers) / static_cast<double>(mesh.triangle.size());
}

namespace {

using Corners = std::array<V3d, 3>;
Corners corners_of(const TriangleMesh& mesh, size_t t) {
  const auto& index = mesh.triangle[t];
  return {V3d(mesh.position[index.x]), V3d(mesh.position[index.y]), V3d(mesh.position[index.z])};
}

double volume_of(const V3d& a, const V3d& b, const V3d& c, const V3d& d) {
  return (b - a).dot((c - a).cross(d - a));
}

bool edge_passes(const Corners& from, const Corners& through) {
  for (int k = 0; k < 3; ++k) {
    const V3d &p = from[k], &q = from[(k + 1) % 3];
    if (volume_of(p, through[0], through[1], through[2]) *
            volume_of(q, through[0], through[1], through[2]) >=
        0)
      continue;
    const double u = volume_of(p, q, through[0], through[1]),
                 v = volume_of(p, q, through[1], through[2]),
                 w = volume_of(p, q, through[2], through[0]);
    if ((u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0)) return true;
  }
  return false;
}

}  // namespace

size_t crossings_of(const TriangleMesh& mesh, const TriangleMesh& sheet) {
  size_t crossings = 0;
  for (size_t s = 0; s < sheet.triangle.size(); ++s) {
    const Corners b = corners_of(sheet, s);
    Imath::Box3d box;
    for (const V3d& p : b) box.extendBy(p);
    for (size_t t = 0; t < mesh.triangle.size(); ++t) {
      const Corners a = corners_of(mesh, t);
      Imath::Box3d own;
      for (const V3d& p : a) own.extendBy(p);
      if (box.intersects(own)) crossings += edge_passes(a, b) || edge_passes(b, a);
    }
  }
  return crossings;
}

double distance_to(const TriangleMesh& mesh, const V3f& point) {
  double least = 1e30;
  for (const auto& t : mesh.triangle)
    least = std::min(least, double((closest_on_triangle(point, mesh.position[t.x],
                                                        mesh.position[t.y], mesh.position[t.z]) -
                                    point)
                                       .length()));
  return least;
}

}  // namespace drench::surfacing_checks
