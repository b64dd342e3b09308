// Water in solids: no film of air between, and never seen on a wall's other side.

#include <gtest/gtest.h>

#include <algorithm>

#include "surfacing/surface.h"
#include "tests/contract/box_mesh.h"
#include "tests/contract/sphere_mesh.h"
#include "tests/surfacing/mesh_checks.h"
#include "tests/surfacing/scenes.h"

namespace drench {
namespace {

using namespace surfacing_checks;
using namespace surfacing_scenes;
using Imath::V3f;
using Imath::V3i;
using test::box_mesh;

constexpr float spacing = 0.01f;        // m
constexpr float inner = 8.f * spacing;  // half the cavity's edge

/// A closed box about the origin with a cavity.
TriangleMesh tank(float wall) {
  TriangleMesh mesh = box_mesh(V3f(-inner - wall), V3f(inner + wall));
  const TriangleMesh cavity = box_mesh(V3f(-inner), V3f(inner));
  for (const auto& t : cavity.triangle) mesh.triangle.emplace_back(t.x + 8, t.z + 8, t.y + 8);
  mesh.position.insert(mesh.position.end(), cavity.position.begin(), cavity.position.end());
  return mesh;
}

/// Water in the lower half of the tank.
ParticleFrame half_full(uint32_t seed) {
  return shaken_box(V3f(-inner), V3i(16, 8, 16), spacing, 0.1, seed);
}

float largest(const V3f& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }

TEST(Overlap, GoesIntoWallsAndNotThroughThem) {
  for (const float wall : {3.f, 1.f, 0.3f, 0.05f}) {
    const std::vector<TriangleMesh> solid{tank(wall * spacing)};
    const ParticleFrame water = half_full(uint32_t(wall * 100));
    const TriangleMesh mesh = surface_frame(water, {}, {.obstacles = solid}),
                       alone = surface_frame(water, {});
    EXPECT_EQ(defects_of(mesh), Defects{});
    size_t before = 0;
    for (size_t v = 0; v < mesh.position.size(); ++v) {
      const V3f &p = mesh.position[v], &was = alone.position[v];
      EXPECT_LE(largest(p), inner + wall * spacing) << wall;
      // What was as near to a wall as water at rest is, and is no free surface, is in it.
      const bool near = largest(was) > inner - 0.3f * spacing;
      if (near) {
        EXPECT_GT(largest(p), inner) << wall;
      } else if (largest(was) < inner - 0.61f * spacing) {
        EXPECT_EQ(p, was);
      }
      before += largest(was) <= inner && near;
    }
    EXPECT_GT(before, 500u);  // without overlap there is a film of air
    EXPECT_EQ(mesh.normal, alone.normal);
  }
}

TEST(Overlap, HoldsAtASmoothBody) {
  TriangleMesh ball = test::unit_sphere(40, 80);
  const float radius = 5 * spacing;
  for (V3f& p : ball.position) p *= radius;
  ParticleFrame water = shaken_box(V3f(-12 * spacing), V3i(24), spacing, 0.1, 3);
  std::erase_if(water.position, [&](const V3f& p) { return p.length() < radius + 0.5f * spacing; });
  water.velocity.resize(water.position.size());
  const std::vector<TriangleMesh> solid{ball};
  const TriangleMesh mesh = surface_frame(water, {}, {.obstacles = solid}),
                     alone = surface_frame(water, {});
  EXPECT_EQ(defects_of(mesh), Defects{});
  size_t around = 0;
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    const float was = alone.position[v].length(), is = mesh.position[v].length();
    if (was > radius + 0.3f * spacing) continue;
    EXPECT_LT(is, radius * (1 - 1e-4f));  // facets lie within
    EXPECT_GT(is, radius - 1.2f * spacing);
    ++around;
  }
  EXPECT_GT(around, 500u);
}

TEST(Overlap, GoesASpacingUnderTheGround) {
  const ParticleFrame water = half_full(5);
  const TriangleMesh mesh = surface_frame(water, {}, {.ground = -inner});
  EXPECT_EQ(defects_of(mesh), Defects{});
  EXPECT_LT(sliver_share(mesh, 10), 1e-3);
  float low = 1e9f, high = -1e9f;
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    low = std::min(low, mesh.position[v].y), high = std::max(high, mesh.position[v].y);
    if (mesh.normal[v].y < -0.9f) {
      EXPECT_LT(mesh.position[v].y, -inner - 0.4f * spacing);
    }
  }
  EXPECT_NEAR(low, -inner - spacing, 0.4f * spacing);
  EXPECT_NEAR(high, 0, 0.3f * spacing);
}

// A cloth lies on a box under water: the water stays on the cloth.
TEST(Overlap, DoesNotPullWaterThroughCloth) {
  const std::vector<TriangleMesh> solid{box_mesh(V3f(-1, -1, -1), V3f(1, -inner, 1))};
  TriangleMesh cloth;
  const float half = 5 * spacing, height = -inner + 0.4f * spacing;
  cloth.position = {
      {-half, height, -half}, {half, height, -half}, {half, height, half}, {-half, height, half}};
  cloth.triangle.emplace_back(0, 2, 1), cloth.triangle.emplace_back(0, 3, 2);
  cloth.velocity.resize(4, V3f(0));
  ParticleFrame water = half_full(9);
  std::erase_if(water.position,
                [&](const V3f& p) { return distance_to(cloth, p) < 0.5 * spacing; });
  water.velocity.resize(water.position.size());
  SurfaceStats stats;
  const std::vector<TriangleMesh> sheet{cloth};
  const TriangleMesh mesh =
      surface_frame(water, {}, {.cloth = sheet, .obstacles = solid}, InteriorBlocks::skip, &stats);
  EXPECT_EQ(defects_of(mesh), Defects{});
  EXPECT_EQ(stats.crossing, 0u);
  EXPECT_EQ(crossings_of(mesh, cloth), 0u);
  EXPECT_GT(stats.contact, 100u);
}

}  // namespace
}  // namespace drench
