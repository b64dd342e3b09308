// Water on sheets: apart where a sheet is between, on it without a gap, through it nowhere.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <functional>

#include "surfacing/surface.h"
#include "tests/same_bits.h"
#include "tests/surfacing/mesh_checks.h"
#include "tests/surfacing/scenes.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using namespace surfacing_scenes;
using namespace surfacing_checks;
using Imath::V3d;
using Imath::V3f;
using Imath::V3i;

constexpr float spacing = 0.01f;  // m

using Place = std::function<V3f(float u, float v)>;  // in spacings, of u and v in [-1, 1]

TriangleMesh sheet_of(int cells, const Place& place) {
  TriangleMesh mesh;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i)
      mesh.position.push_back(
          spacing * place(2.f * float(i) / float(cells) - 1, 2.f * float(j) / float(cells) - 1));
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      const auto at = [&](int x, int y) { return uint32_t((j + y) * (cells + 1) + i + x); };
      mesh.triangle.push_back({at(0, 0), at(0, 1), at(1, 1)});
      mesh.triangle.push_back({at(0, 0), at(1, 1), at(1, 0)});
    }
  mesh.velocity.assign(mesh.position.size(), V3f(1, 2, 3));
  return mesh;
}

/// A cube of water of 16 spacings about the origin without what is nearer to the sheet than
/// particles come, half a spacing.
ParticleFrame around(const TriangleMesh& sheet, uint32_t seed, double shake = 0.25) {
  ParticleFrame frame = shaken_box(V3f(-8 * spacing), V3i(16), spacing, shake, seed);
  std::erase_if(frame.position,
                [&](const V3f& p) { return distance_to(sheet, p) < 0.5 * spacing; });
  frame.velocity.resize(frame.position.size());
  return frame;
}

TriangleMesh turned(TriangleMesh mesh, double angle) {
  const float c = float(std::cos(angle)), s = float(std::sin(angle));
  for (V3f& p : mesh.position) {
    p = V3f(c * p.x - s * p.y, s * p.x + c * p.y, p.z);
    p = V3f(p.x, c * p.y - s * p.z, s * p.y + c * p.z);
  }
  return mesh;
}

struct Scene {
  const char* name;
  Place place;
};
const std::vector<Scene>& scenes() {
  static const std::vector<Scene> all{
      {"flat, through all of it", [](float u, float v) { return V3f(12 * u, 0.3f, 12 * v); }},
      {"ends within", [](float u, float v) { return V3f(4 * u, 0.3f, 5 * v); }},
      {"strip", [](float u, float v) { return V3f(1.5f * u, 0, 7 * v); }},
      {"waves", [](float u, float v) { return V3f(12 * u, 2 * std::sin(6 * u + v), 12 * v); }},
      {"sharp fold", [](float u, float v) { return V3f(6 * u, 9 * std::abs(u), 12 * v); }},
      {"crumpled", [](float u, float v) {
         return V3f(7 * u, 1.5f * std::sin(11 * u + 3 * v) + 1.2f * std::cos(9 * v - 4 * u), 7 * v);
       }}};
  return all;
}

class Contact : public testing::TestWithParam<size_t> {};
INSTANTIATE_TEST_SUITE_P(Sheets, Contact, testing::Range<size_t>(0, 6));

// No triangle through a sheet, counted in double outside the mesher; closed whatever the sheet
// does.
TEST_P(Contact, NothingCrossesASheet) {
  const Scene& scene = scenes()[GetParam()];
  for (uint32_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(fmt::format("{}, seed {}", scene.name, seed));
    const std::vector<TriangleMesh> sheet{turned(sheet_of(12, scene.place), 0.4 * seed)};
    SurfaceStats stats;
    const TriangleMesh mesh =
        surface_frame(around(sheet[0], seed), {}, {sheet}, InteriorBlocks::skip, &stats);
    EXPECT_EQ(defects_of(mesh), Defects{});
    EXPECT_EQ(crossings_of(mesh, sheet[0]), 0u);
    EXPECT_EQ(stats.crossing, 0u);
    EXPECT_GT(stats.contact, 100u);
    EXPECT_LT(sliver_share(mesh, 10), 5e-4);
    // without sheets the same water goes through this one
    EXPECT_GT(crossings_of(surface_frame(around(sheet[0], seed), {}), sheet[0]), 0u);
  }
}

// A pool on a sheet, or under and on it: the faces of contact lie 0.02 spacings before it, cover
// the pool's footprint, and the volume is that of the particles, since their half spacing reaches
// the sheet.
TEST(ContactOfPools, LieOnTheSheetAndStayApart) {
  const std::vector<TriangleMesh> sheet{
      sheet_of(24, [](float u, float v) { return V3f(16 * u, 0, 16 * v); })};
  for (const bool both : {false, true}) {
    ParticleFrame frame =
        shaken_box(V3f(-10 * spacing, 0, -10 * spacing), V3i(20, 6, 20), spacing, 0.05, 1);
    if (both)
      append(frame, shaken_box(V3f(-10, -6, -10) * spacing, V3i(20, 6, 20), spacing, 0.05, 2));
    SurfaceStats stats;
    const TriangleMesh mesh = surface_frame(frame, {}, {sheet}, InteriorBlocks::skip, &stats);
    EXPECT_EQ(topology_of(mesh).components, both ? 2u : 1u);
    EXPECT_EQ(crossings_of(mesh, sheet[0]), 0u);
    double area = 0, deepest = 0, highest = 0;
    for (size_t t = 0; t < mesh.triangle.size(); ++t) {
      if (!mesh.contact[t]) continue;
      const V3f &a = mesh.position[mesh.triangle[t].x], &b = mesh.position[mesh.triangle[t].y],
                &c = mesh.position[mesh.triangle[t].z];
      area += 0.5 * (b - a).cross(c - a).length() / (spacing * spacing);
      for (const V3f& p : {a, b, c}) {
        deepest = std::max(deepest, std::abs(std::abs(p.y) / spacing - 0.02));
        highest = std::max(highest, double(std::abs(p.y) / spacing));
      }
    }
    EXPECT_LT(deepest, 1e-3);
    EXPECT_NEAR(area / (both ? 2 : 1), 400, 0.1 * 400);  // edges are round: half a spacing of 10
    const double volume = volume_of(mesh) / std::pow(spacing, 3) / double(frame.position.size());
    EXPECT_NEAR(volume, 1, 0.02);
  }
}

// Where water lies on a sheet it moves as the sheet does, so that motion blur tears nothing.
TEST(ContactOfPools, MovesWithTheSheet) {
  const std::vector<TriangleMesh> sheet{
      sheet_of(24, [](float u, float v) { return V3f(16 * u, 0, 16 * v); })};
  const ParticleFrame frame = shaken_box(V3f(-0.1f, 0, -0.1f), V3i(20, 6, 20), spacing, 0.05, 1);
  const TriangleMesh mesh = surface_frame(frame, {}, {sheet});
  size_t seen = 0;
  for (size_t t = 0; t < mesh.triangle.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      if (!mesh.contact[t]) continue;
      EXPECT_LT((mesh.velocity[mesh.triangle[t][k]] - V3f(1, 2, 3)).length(), 1e-5f);
      ++seen;
    }
  EXPECT_GT(seen, 1000u);
}

TEST(ContactOfPools, HasTheSameBitsForAnyThreadCount) {
  const std::vector<TriangleMesh> sheet{turned(sheet_of(12, scenes()[5].place), 0.4)};
  const ParticleFrame frame = around(sheet[0], 1);
  const auto with_threads = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, size_t(threads));
    tbb::task_arena arena(threads);
    return arena.execute([&] { return surface_frame(frame, {}, {sheet}); });
  };
  const TriangleMesh one = with_threads(1);
  test::expect_same_bits(one, with_threads(2));
  test::expect_same_bits(one, with_threads(16));
}

// A damaged sheet is named, with the vertex or triangle.
TEST(ContactOfPools, SaysWhatIsWrongWithASheet) {
  const ParticleFrame frame = shaken_box(V3f(0), V3i(4), spacing, 0.1, 1);
  const TriangleMesh good = sheet_of(2, [](float u, float v) { return V3f(u, 0, v); });
  const auto complaint = [&](TriangleMesh bad) {
    return test::error_of([&] { surface_frame(frame, {}, {std::vector{good, bad}}); });
  };
  TriangleMesh bad = good;
  bad.position[3].y = std::nanf("");
  EXPECT_NE(complaint(bad).find("sheet 1: vertex 3 is not finite"), std::string::npos);
  bad = good, bad.triangle[2].x = 99;
  EXPECT_NE(complaint(bad).find("sheet 1: triangle 2 names a vertex"), std::string::npos);
  bad = good, bad.velocity.pop_back();
  EXPECT_NE(complaint(bad).find("sheet 1: 8 velocities for 9 vertices"), std::string::npos);
}

// A sheet that no water is near changes no bit.
TEST(ContactOfPools, FarSheetsChangeNothing) {
  const std::vector<TriangleMesh> sheet{
      sheet_of(4, [](float u, float v) { return V3f(16 * u, 40, 1e4f * v); })};
  const ParticleFrame frame = shaken_box(V3f(0), V3i(12), spacing, 0.2, 1);
  const TriangleMesh with = surface_frame(frame, {}, {sheet}), without = surface_frame(frame, {});
  EXPECT_EQ(with.position, without.position);
  EXPECT_EQ(with.triangle, without.triangle);
  EXPECT_EQ(with.normal, without.normal);
}

}  // namespace
}  // namespace drench
