// Smoothing part by part: drops, cavities and specks; slivers.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <utility>

#include "surfacing/cloth_solid.h"
#include "surfacing/slivers.h"
#include "surfacing/smooth.h"
#include "tests/surfacing/mesh_checks.h"

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

/// Of one block, which a sheet comes near without touching the mesh.
ClothSolids sheet_beside(LatticeMesh& mesh) {
  Lattice lattice;
  lattice.voxel = 1;
  const V3f middle = mesh.position[0];
  const V3i block(int(middle.x) / block_edge, int(middle.y) / block_edge,
                  int(middle.z) / block_edge);
  mesh.block = {{block, 0, uint32_t(mesh.position.size())}};
  TriangleMesh sheet;
  for (const V3f& corner : {V3f(0, 0, 0), V3f(0, 1, 0), V3f(0, 0, 1)})
    sheet.position.push_back(V3f(block * block_edge) + corner - V3f(0.5f, 0, 0));
  sheet.velocity.assign(3, V3f(0));
  sheet.triangle.emplace_back(0, 1, 2);
  return {std::vector{sheet}, bin_particles({middle}, lattice)};
}

TriangleMesh as_triangle_mesh(const LatticeMesh& mesh) {
  TriangleMesh result;
  result.position = mesh.position;
  result.triangle = mesh.triangle;
  return result;
}

/// The least cosine between a triangle's normal and the way to it from the middle.
float least_facing(const LatticeMesh& mesh, const V3f& middle) {
  float least = 1;
  for (const Triangle& t : mesh.triangle) {
    const V3f &a = mesh.position[t.x], &b = mesh.position[t.y], &c = mesh.position[t.z];
    least = std::min(least, (b - a).cross(c - a).normalized().dot((a - middle).normalized()));
  }
  return least;
}

// A ball with some vertices drawn close to a neighbour, where no triangle turns over: needles all
// around. The mesh stays a closed ball that faces outward, of vertices that were there, in their
// order.
TEST(Slivers, GoWithoutHolesOrFolds) {
  const V3f middle(1000.3f, 700.6f, 1200.9f);
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    LatticeMesh mesh = ball(3, 0, 4, false);
    VertexRings rings = rings_of(mesh);
    std::mt19937 random(seed);
    for (uint32_t v = 0; v < mesh.position.size(); v += 4) {
      const uint32_t size = rings.first[v + 1] - rings.first[v];
      const V3f to = mesh.position[rings.neighbour[rings.first[v] + random() % size]],
                from = std::exchange(mesh.position[v], to + 0.08f * (mesh.position[v] - to));
      if (least_facing(mesh, middle) < 0.5f) mesh.position[v] = from;
    }
    const LatticeMesh before = mesh;
    const ClothSolids sheets = sheet_beside(mesh);
    ClothContact contact{std::vector<int8_t>(mesh.position.size(), 0), mesh.position};
    std::vector<V3f> normal = normals_of(mesh, rings);
    const double slivers = surfacing_checks::sliver_share(as_triangle_mesh(mesh), 10);
    EXPECT_GT(slivers, 0.1);
    const size_t removed = remove_slivers(mesh, rings, contact, sheets, normal);
    EXPECT_EQ(surfacing_checks::defects_of(as_triangle_mesh(mesh)), surfacing_checks::Defects{});
    EXPECT_LT(surfacing_checks::sliver_share(as_triangle_mesh(mesh), 10), 0.2 * slivers);
    EXPECT_GT(least_facing(mesh, middle), 0);
    EXPECT_EQ(mesh.position.size() + removed, before.position.size());
    EXPECT_EQ(mesh.block[0].end, mesh.position.size());
    EXPECT_EQ(contact.side.size(), mesh.position.size());
    EXPECT_EQ(contact.extracted, mesh.position);
    EXPECT_EQ(normal.size(), mesh.position.size());
    EXPECT_TRUE(std::includes(
        before.position.begin(), before.position.end(), mesh.position.begin(), mesh.position.end(),
        [at = before.position](const V3f& a, const V3f& b) {
          return std::find(at.begin(), at.end(), a) < std::find(at.begin(), at.end(), b);
        }));
  }
}

// Of four corners none can go.
TEST(Slivers, LeaveTheSmallestPartWhole) {
  LatticeMesh mesh;
  mesh.position = {V3f(100, 100, 100), V3f(101, 100, 100), V3f(101, 100.1f, 100),
                   V3f(101, 100, 100.1f)};
  mesh.triangle = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const ClothSolids sheets = sheet_beside(mesh);
  VertexRings rings = rings_of(mesh);
  ClothContact contact;
  std::vector<V3f> normal = normals_of(mesh, rings);
  EXPECT_GT(surfacing_checks::sliver_share(as_triangle_mesh(mesh), 10), 0.5);
  EXPECT_EQ(remove_slivers(mesh, rings, contact, sheets, normal), 0u);
  EXPECT_EQ(mesh.triangle.size(), 4u);
}

}  // namespace
}  // namespace drench::surfacing
