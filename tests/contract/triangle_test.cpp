#include "pipeline/contract/geometry/triangle.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace drench {
namespace {

using Imath::V3f;

TEST(ClosestOnTriangle, IsTheFootWithinIt) {
  const V3f foot = closest_on_triangle({1, 1, 5}, {0, 0, 0}, {4, 0, 0}, {0, 4, 0});
  EXPECT_LT((foot - V3f(1, 1, 0)).length(), 1e-6f);
}

// Corners at one place, or three on a line: what is left is a segment, of any direction. The
// distance to it is known, and rounding is 1e-6 of lengths of a few metres.
TEST(ClosestOnTriangle, OfOneWithoutAreaIsThatOfASegment) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> within(-1, 1);
  const auto any = [&] { return V3f(within(random), within(random), within(random)); };
  for (int k = 0; k < 20000; ++k) {
    const V3f a = any(), along = any(), p = any() * 3.f;
    const float part = std::abs(within(random));
    for (const float middle : {0.f, part, 1.f}) {
      std::array<V3f, 3> corner{a, a + along * middle, a + along};
      std::shuffle(corner.begin(), corner.end(), random);
      const float distance = (closest_on_triangle(p, corner[0], corner[1], corner[2]) - p).length();
      EXPECT_NEAR(distance, (closest_on_segment(p, a, a + along) - p).length(), 1e-4f);
    }
  }
  EXPECT_EQ(closest_on_triangle({1, 2, 3}, V3f(1), V3f(1), V3f(1)), V3f(1));
  EXPECT_EQ(closest_on_segment({3, 1, 0}, {0, 0, 0}, {2, 0, 0}), V3f(2, 0, 0));
}

}  // namespace
}  // namespace drench
