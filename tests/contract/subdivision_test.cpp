#include "pipeline/contract/geometry/subdivision.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "tests/contract/sphere_mesh.h"

namespace drench {
namespace {

using Imath::V2f;
using Imath::V3f;
using test::unit_sphere;

constexpr float unlimited = 1e6f;

V3f across(const TriangleMesh& mesh, const Imath::Vec3<uint32_t>& t) {
  const V3f& a = mesh.position[t.x];
  return (mesh.position[t.y] - a).cross(mesh.position[t.z] - a);
}

/// A grid of n x n squares, each of two triangles along the same diagonal; flat at y = 0.
TriangleMesh grid(uint32_t n) {
  TriangleMesh mesh;
  for (uint32_t j = 0; j <= n; ++j)
    for (uint32_t i = 0; i <= n; ++i) mesh.position.emplace_back(float(i), 0.f, float(j));
  for (uint32_t j = 0; j < n; ++j)
    for (uint32_t i = 0; i < n; ++i) {
      const uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.triangle.emplace_back(a, c, d), mesh.triangle.emplace_back(a, d, b);
    }
  return mesh;
}

// Loop's surface over such a grid is the three-direction quartic box spline, which over a bump of
// one vertex is 1/2 of it there and 1/12 at its six neighbours (Loop 1987, section 2.2).
TEST(Subdivision, IsTheBoxSplineOnARegularGrid) {
  TriangleMesh mesh = grid(8);
  const uint32_t middle = 4 * 9 + 4;
  mesh.position[middle].y = 1;
  for (const int levels : {1, 2, 3}) {
    std::map<std::pair<float, float>, float> height;
    for (const V3f& p : subdivided(mesh, levels, unlimited).position) height[{p.x, p.z}] = p.y;
    EXPECT_NEAR(height.at({4, 4}), 1. / 2, 1e-6);
    for (const auto& [x, z] : {std::pair(1, 0), {0, 1}, {1, 1}, {-1, 0}, {0, -1}, {-1, -1}})
      EXPECT_NEAR(height.at({4.f + float(x), 4.f + float(z)}), 1. / 12, 1e-6);
    EXPECT_NEAR(height.at({6, 4}), 0, 1e-6);
  }
}

// Corners stay, of one triangle or two, and edges are cubic B-splines: 2/3 and 1/6.
TEST(Subdivision, KeepsCornersAndSmoothsEdges) {
  TriangleMesh mesh = grid(6);
  mesh.position[3].y = 1;
  mesh.position[0].y = mesh.position[6].y = 5;
  std::map<std::pair<float, float>, float> height;
  for (const V3f& p : subdivided(mesh, 2, unlimited).position) height[{p.x, p.z}] = p.y;
  EXPECT_NEAR(height.at({3, 0}), 2. / 3, 1e-6);
  EXPECT_NEAR(height.at({2, 0}), 1. / 6, 1e-6);
  EXPECT_NEAR(height.at({0, 0}), 5, 1e-6);
  EXPECT_NEAR(height.at({6, 0}), 5, 1e-6);
}

// Two neighbours lean by less than half of what they did, at the poles too, where many meet.
TEST(Subdivision, TakesTheFacetsOff) {
  const auto widest = [](const TriangleMesh& mesh) {
    std::map<std::pair<uint32_t, uint32_t>, V3f> side;
    float lean = 0;
    for (const auto& t : mesh.triangle)
      for (const auto& [a, b] : {std::pair(t.x, t.y), {t.y, t.z}, {t.z, t.x}}) {
        const V3f normal = across(mesh, t).normalized();
        side[{a, b}] = normal;
        if (const auto other = side.find({b, a}); other != side.end())
          lean = std::max(lean, normal.cross(other->second).length());
      }
    return lean;
  };
  for (const uint32_t rings : {6u, 12u, 24u}) {
    const TriangleMesh mesh = unit_sphere(rings, 2 * rings);
    EXPECT_LT(widest(subdivided(mesh, 2, unlimited)), 0.5f * widest(mesh)) << rings;
  }
}

TEST(Subdivision, MovesNoPointAsFarAsItsLimit) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> within(-1, 1);
  TriangleMesh mesh = grid(12);
  for (V3f& p : mesh.position) p.y = within(random);
  mesh.velocity = mesh.position;  // linear, and so where points are before they move
  float before = 1e9f;
  for (const float limit : {1e6f, 0.1f, 0.01f, 0.001f}) {
    const TriangleMesh out = subdivided(mesh, 2, limit);
    float farthest = 0;
    for (size_t v = 0; v < out.position.size(); ++v)
      farthest = std::max(farthest, (out.position[v] - out.velocity[v]).length());
    EXPECT_LT(farthest, limit + 2e-6f);  // rounding of coordinates up to 12
    EXPECT_LT(farthest, before);
    EXPECT_GT(farthest, std::min(limit, 0.5f) / 2);
    before = farthest;
  }
}

using Edge = std::pair<uint32_t, uint32_t>;

TEST(Subdivision, OpensNothing) {
  const TriangleMesh mesh = unit_sphere(7, 14);
  for (const int levels : {1, 2, 3}) {
    const TriangleMesh out = subdivided(mesh, levels, 0.01f);
    EXPECT_EQ(out.triangle.size(), mesh.triangle.size() << (2 * levels));
    // Euler's formula; every edge once in either direction; outwards.
    EXPECT_EQ(out.position.size(), out.triangle.size() / 2 + 2);
    std::map<Edge, int> edges;
    for (const auto& t : out.triangle) {
      for (const Edge& e : {Edge(t.x, t.y), Edge(t.y, t.z), Edge(t.z, t.x)}) ++edges[e];
      EXPECT_GT(across(out, t).dot(out.position[t.x]), 0);
    }
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1);
      EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
    }
  }
}

/// Two unequal triangles of the plane y = 2 + x / 2, split along their common edge, and a vertex of
/// none.
TriangleMesh two_halves() {
  TriangleMesh mesh;
  for (const V2f& at :
       {V2f(0, 0), V2f(3, 1), V2f(1, 2), V2f(1, 2), V2f(3, 1), V2f(4, 5), V2f(9, 9)}) {
    mesh.position.emplace_back(at.x, 2 + at.x / 2, at.y);
    mesh.velocity.emplace_back(at.y, 1, at.x);
    mesh.uv.push_back(at);
    mesh.wetness.push_back(at.x / 4);
  }
  mesh.triangle = {{0, 1, 2}, {4, 5, 3}};
  mesh.point = {0, 1, 2, 2, 1, 5, 6};
  return mesh;
}

TEST(Subdivision, OfAPlaneStaysInItAndColumnsAreLinear) {
  TriangleMesh mesh = two_halves();
  const TriangleMesh out = subdivided(mesh, 2, 1e-6f);  // hardly moved along the plane
  for (size_t v = 0; v < out.position.size(); ++v) {
    const V3f& p = out.position[v];
    EXPECT_NEAR(p.y, 2 + p.x / 2, 2e-6);
    EXPECT_LT((out.uv[v] - V2f(p.x, p.z)).length(), 3e-6);
    EXPECT_LT((out.velocity[v] - V3f(p.z, 1, p.x)).length(), 3e-6);
    EXPECT_NEAR(out.wetness[v], p.x / 4, 2e-6);
  }
}

// Where a sheet is split along a seam both sides have the same places, to the bit, and one point.
TEST(Subdivision, KeepsSeamsClosed) {
  TriangleMesh mesh = two_halves();
  for (size_t v = 0; v < mesh.position.size(); ++v)
    mesh.position[v].y = std::sin(7 * float(mesh.point[v]));
  const TriangleMesh out = subdivided(mesh, 2, 0.5f);
  ASSERT_EQ(out.point.size(), out.position.size());
  size_t shared = 0;
  for (size_t v = 0; v < out.point.size(); ++v) {
    if (out.point[v] == v) continue;
    ++shared;
    EXPECT_EQ(out.position[v], out.position[out.point[v]]);
  }
  EXPECT_EQ(shared, 5u);
}

// Three triangles on an edge, two the other way round, two that meet in a point, one with a corner
// twice: what meshes of others hold. Every triangle becomes sixteen, at finite places near by.
TEST(Subdivision, TakesMeshesThatAreNoManifolds) {
  TriangleMesh mesh = grid(2);
  mesh.position.emplace_back(1.f, 1.f, 1.f), mesh.position.emplace_back(-1.f, 0.f, -1.f);
  mesh.position.emplace_back(-1.f, 0.f, 0.f);
  mesh.triangle.emplace_back(0, 4, 9);    // a third on a diagonal
  mesh.triangle.emplace_back(0, 10, 11);  // meets the grid in a corner
  std::swap(mesh.triangle[2].x, mesh.triangle[2].y);
  mesh.triangle.emplace_back(5, 5, 8);
  const TriangleMesh out = subdivided(mesh, 2, 0.1f);
  EXPECT_EQ(out.triangle.size(), 16 * mesh.triangle.size());
  for (const V3f& p : out.position) {
    EXPECT_TRUE(std::isfinite(p.x + p.y + p.z));
    EXPECT_LT(p.length(), 4);
  }
}

TEST(Subdivision, OfNoLevelIsTheMesh) {
  const TriangleMesh mesh = two_halves(), same = subdivided(mesh, 0, 1);
  EXPECT_EQ(same.position, mesh.position);
  EXPECT_EQ(same.triangle, mesh.triangle);
}

TEST(Subdivision, IsBoundedBySize) {
  EXPECT_EQ(automatic_levels(0), 2);
  EXPECT_EQ(automatic_levels(16384), 2);
  EXPECT_EQ(automatic_levels(16385), 1);
  EXPECT_EQ(automatic_levels(65537), 0);
}

}  // namespace
}  // namespace drench
