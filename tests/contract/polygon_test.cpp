#include "pipeline/contract/geometry/polygon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace drench {
namespace {

using Imath::V3f;

/// Sum of the triangles' areas, each of which must turn as the polygon does along +z. A polygon
/// that is covered once and nowhere else has the area of the shoelace formula.
double area_of(const std::vector<V3f>& p) {
  const auto triangles = triangulate(p);
  if (!triangles) return -1;
  EXPECT_EQ(triangles->size(), p.size() - 2);
  double area = 0;
  for (const auto& t : *triangles) {
    const double z = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).z / 2;
    EXPECT_GE(z, -1e-7);
    area += std::abs(z);
  }
  return area;
}

bool covers(const std::vector<V3f>& p, float x, float y) {
  const auto triangles = triangulate(p).value();
  for (const auto& t : triangles) {
    int inside = 0;
    for (size_t k = 0; k < 3; ++k) {
      const V3f &a = p[t[k]], &b = p[t[(k + 1) % 3]];
      inside += (b - a).cross(V3f(x, y, a.z) - a).z > 0;
    }
    if (inside == 3) return true;
  }
  return false;
}

/// From each of its corners on in turn.
std::vector<std::vector<V3f>> rotations_of(const std::vector<V3f>& p) {
  std::vector<std::vector<V3f>> all;
  for (size_t start = 0; start < p.size(); ++start) {
    all.emplace_back(p.begin() + long(start), p.end());
    all.back().insert(all.back().end(), p.begin(), p.begin() + long(start));
  }
  return all;
}

// A U of 3 x 3 with a mouth of 1 x 2: area 7, and the mouth stays open, whichever corner is first.
TEST(Polygon, AConcaveOneIsCoveredOnce) {
  const std::vector<V3f> u{{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {2, 3, 0},
                           {2, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};
  for (const auto& turned : rotations_of(u)) {
    EXPECT_NEAR(area_of(turned), 7, 1e-6);
    EXPECT_FALSE(covers(turned, 1.5f, 2.f));
    EXPECT_TRUE(covers(turned, 0.5f, 2.5f));
  }
}

TEST(Polygon, AConcaveQuadIsCutAtItsInnerCorner) {
  const std::vector<V3f> arrow{{0, 0, 0}, {2, 1, 0}, {0, 2, 0}, {1, 1, 0}};
  EXPECT_NEAR(area_of(arrow), 1, 1e-6);
  EXPECT_FALSE(covers(arrow, 0.3f, 1.f));
}

// A comb of 200 teeth, each 1 x 1 with a gap of 1, on a bar of 399 x 1.
TEST(Polygon, ACombOfManyTeethIsCoveredOnce) {
  std::vector<V3f> comb{{0, 0, 0}, {399, 0, 0}};
  for (int k = 199; k >= 0; --k) {
    for (const auto& [x, y] : {std::pair{2 * k + 1, 1}, {2 * k + 1, 2}, {2 * k, 2}, {2 * k, 1}})
      comb.emplace_back(float(x), float(y), 0.f);
  }
  EXPECT_NEAR(area_of(comb), 399 + 200, 1e-3);
}

// A slit joins a hole of 1 x 1 to the rim of a square of 3 x 3: its ends are passed twice.
TEST(Polygon, AHoleJoinedByASlitStaysOpen) {
  const std::vector<V3f> plate{{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {0, 3, 0}, {0, 0, 0},
                               {1, 1, 0}, {1, 2, 0}, {2, 2, 0}, {2, 1, 0}, {1, 1, 0}};
  EXPECT_NEAR(area_of(plate), 8, 1e-6);
  EXPECT_FALSE(covers(plate, 1.4f, 1.6f));
}

// The rim of a saddle z = 0.1 x y, concave as seen along z: the projected area is that of the L.
TEST(Polygon, CornersOffThePlaneAreProjected) {
  std::vector<V3f> l{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}};
  for (V3f& p : l) p.z = 0.1f * (p.x - 1) * (p.y - 1);
  EXPECT_NEAR(area_of(l), 3, 1e-6);
}

TEST(Polygon, ManyCornersOfACircleBecomeAFan) {
  std::vector<V3f> circle;
  for (int k = 0; k < 20000; ++k) {
    const double angle = 2 * std::numbers::pi * k / 20000;
    circle.emplace_back(float(std::cos(angle)), float(std::sin(angle)), 0.f);
  }
  // Rounding makes some of its corners concave; that is no reason to refuse it.
  const auto triangles = triangulate(circle);
  ASSERT_TRUE(triangles.has_value());
  EXPECT_NEAR(area_of(circle), std::numbers::pi, 1e-4);
}

TEST(Polygon, CornersOnALineAreNoTrouble) {
  EXPECT_NEAR(
      area_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 2, 0}, {1, 1, 0}, {0, 1, 0}}), 3,
      1e-6);
  // Nothing but a line: a fan of triangles without area, so that a closed mesh stays closed.
  EXPECT_NEAR(area_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 0, 0}}), 0, 1e-9);
}

// A square of 1 whose lower side has corners in it, on the line or off it by rounding; a triangle
// with all sides split. No triangle needs to be without area.
TEST(Polygon, CornersOnASideMakeNoSlivers) {
  for (const float off : {0.f, -1e-9f, 1e-9f, -1e-7f, 1e-7f}) {
    const std::vector<V3f> square{{0, 0, 0}, {0.25f, off, 0}, {0.5f, off, 0}, {0.8f, off, 0},
                                  {1, 0, 0}, {1, 1, 0},       {0, 1, 0}};
    const std::vector<V3f> triangle{{0, 0, 0}, {1, off, 0}, {2, off, 0}, {3, 0, 0},  {2, 1, 0},
                                    {1, 2, 0}, {0, 3, 0},   {off, 2, 0}, {off, 1, 0}};
    for (const auto& [whole, area] : {std::pair{square, 1.}, {triangle, 4.5}}) {
      for (const auto& p : rotations_of(whole)) {
        EXPECT_NEAR(area_of(p), area, 1e-5);
        const auto triangles = triangulate(p).value();
        for (const auto& t : triangles)
          EXPECT_GT((p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).length(), 0.01f) << off;
      }
    }
  }
}

// An L of 2 x 2 with its inner corner, or all of them, twice at one place: area 3, and its notch
// stays open.
TEST(Polygon, ADoubledCornerOfAConcaveOneIsNoTrouble) {
  const std::vector<V3f> l{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}};
  for (size_t doubled = 0; doubled <= l.size(); ++doubled) {
    std::vector<V3f> twice;
    for (size_t k = 0; k < l.size(); ++k)
      twice.insert(twice.end(), doubled == k || doubled == l.size() ? 2 : 1, l[k]);
    for (const auto& p : rotations_of(twice)) {
      EXPECT_NEAR(area_of(p), 3, 1e-6);
      EXPECT_FALSE(covers(p, 1.4f, 1.6f));
    }
  }
}

TEST(Polygon, OneThatCrossesItselfIsRefused) {
  EXPECT_FALSE(triangulate(std::vector<V3f>{{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 1, 0}}));
  // Of two equal loops turning against each other the normal is 0.
  EXPECT_FALSE(triangulate(std::vector<V3f>{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}));
  // A star of five points turns left everywhere, but twice around.
  std::vector<V3f> star;
  for (int k = 0; k < 5; ++k) {
    const double angle = 4 * std::numbers::pi * k / 5;
    star.emplace_back(float(std::cos(angle)), float(std::sin(angle)), 0.f);
  }
  EXPECT_FALSE(triangulate(star));
}

}  // namespace
}  // namespace drench
