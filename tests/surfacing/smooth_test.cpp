// Smoothing part by part: drops, cavities and specks.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "surfacing/smooth.h"

namespace drench::surfacing {
namespace {

/// An octahedron whose faces are split `splits` times, of mean radius `radius` voxels with bumps of
/// `bump`, far from the origin of the lattice; turned inside out it is a cavity.
LatticeMesh ball(float radius, float bump, int splits, bool cavity) {
  LatticeMesh mesh;
  mesh.position = {V3f(1, 0, 0),  V3f(-1, 0, 0), V3f(0, 1, 0),
                   V3f(0, -1, 0), V3f(0, 0, 1),  V3f(0, 0, -1)};
  for (uint32_t x : {0u, 1u})
    for (uint32_t y : {2u, 3u})
      for (uint32_t z : {4u, 5u}) {
        if ((x + y + z) % 2 == 0)
          mesh.triangle.push_back({x, y, z});
        else
          mesh.triangle.push_back({x, z, y});
      }
  for (int split = 0; split < splits; ++split) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middle;
    std::vector<Triangle> finer;
    for (const Triangle& t : mesh.triangle) {
      std::array<uint32_t, 3> m;
      for (int k = 0; k < 3; ++k) {
        const auto edge = std::minmax(t[k], t[(k + 1) % 3]);
        const auto [at, is_new] = middle.try_emplace(edge, uint32_t(mesh.position.size()));
        if (is_new)
          mesh.position.push_back(
              (mesh.position[edge.first] + mesh.position[edge.second]).normalized());
        m[k] = at->second;
      }
      for (int k = 0; k < 3; ++k) finer.push_back({t[k], m[k], m[(k + 2) % 3]});
      finer.push_back({m[0], m[1], m[2]});
    }
    mesh.triangle = finer;
  }
  for (size_t v = 0; v < mesh.position.size(); ++v)
    mesh.position[v] =
        V3f(1000.3f, 700.6f, 1200.9f) + mesh.position[v] * (radius + bump * std::sin(37.f * v));
  if (cavity)
    for (Triangle& t : mesh.triangle) std::swap(t[1], t[2]);
  return mesh;
}

double smoothed_volume(LatticeMesh& mesh, int passes) {
  const VertexRings rings = rings_of(mesh);
  const Components parts = components_of(mesh);
  EXPECT_EQ(parts.size(), 1u);
  if (passes > 0) smooth_mesh(mesh, rings, parts, passes);
  return volumes_of(mesh, rings, parts)[0];
}

// Rounding at 1,200 voxels is 6e-5, of a radius of 0.4 or 3 voxels.
TEST(Smoothing, KeepsTheVolumeOfDropsAndCavitiesOfAnySize) {
  for (const bool cavity : {false, true})
    for (const auto& [radius, splits] : {std::pair{0.4f, 0}, {0.4f, 1}, {3.f, 2}, {6.f, 4}})
      for (const int passes : {1, 10, 30}) {
        LatticeMesh mesh = ball(radius, 0.1f * radius, splits, cavity);
        const double wanted = smoothed_volume(mesh, 0);
        EXPECT_EQ(wanted < 0, cavity);
        const double got = smoothed_volume(mesh, passes);
        EXPECT_NEAR(got / wanted, 1, 2e-3) << radius << ' ' << splits << ' ' << passes;
        for (const V3f& p : mesh.position) ASSERT_TRUE(std::isfinite(p.x + p.y + p.z));
      }
}

// Which side is water does not matter to the shape.
TEST(Smoothing, TreatsACavityAsItsDrop) {
  for (const int splits : {2, 3}) {
    LatticeMesh drop = ball(3, 0.3f, splits, false), cavity = ball(3, 0.3f, splits, true);
    const LatticeMesh raw = drop;
    smoothed_volume(drop, 10);
    smoothed_volume(cavity, 10);
    float moved = 0;
    for (size_t v = 0; v < raw.position.size(); ++v) {
      EXPECT_LT((drop.position[v] - cavity.position[v]).length(), 1e-3f) << splits << ' ' << v;
      moved = std::max(moved, (drop.position[v] - raw.position[v]).length());
    }
    EXPECT_GT(moved, 0.1f);
  }
}

}  // namespace
}  // namespace drench::surfacing
