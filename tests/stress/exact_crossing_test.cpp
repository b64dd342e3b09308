// Signs of determinants that rounding in double would get wrong, and edges that just touch.

#include "tests/stress/exact_crossing.h"

#include <gtest/gtest.h>

#include <cmath>

namespace drench::stress_tests {
namespace {

// d lies in the plane x + y + z = 3/2 by numbers of single precision, or one bit off it.
TEST(ExactCrossing, OrientationIsExactToTheLastBit) {
  const Point a{1.5F, 0, 0}, b{0, 1.5F, 0}, c{0, 0, 1.5F};
  const float third = 0.3F;
  const float rest = float(1.5 - 2 * double(third));  // exact: 0.3F has 24 bits, 0.6F as well
  ASSERT_EQ(double(third) + double(third) + double(rest), 1.5);
  EXPECT_EQ(orientation(a, b, c, {third, third, rest}), 0);
  EXPECT_EQ(orientation(a, b, c, {third, third, std::nextafter(rest, 2.F)}), 1);
  EXPECT_EQ(orientation(a, b, c, {third, third, std::nextafter(rest, 0.F)}), -1);
  EXPECT_EQ(orientation(a, c, b, {third, third, std::nextafter(rest, 0.F)}), 1);
}

// Products of tiny and of large numbers, of which double keeps none of what decides.
TEST(ExactCrossing, OrientationIsExactOverAllMagnitudes) {
  const float big = 1e6F, small = 1e-20F;
  const Point a{big, big, 0}, b{-big, -big, 0}, c{big, -big, 0};
  EXPECT_EQ(orientation(a, b, c, {1, 1, 0}), 0);
  EXPECT_EQ(orientation(a, b, c, {1, 1, small}), -orientation(a, b, c, {1, 1, -small}));
  EXPECT_NE(orientation(a, b, c, {1, 1, small}), 0);
}

TEST(ExactCrossing, EdgesMeetTrianglesEndsAndSidesIncluded) {
  const std::array<Point, 3> t{Point{0, 0, 0}, Point{1, 0, 0}, Point{0, 1, 0}};
  EXPECT_TRUE(meet({0.2F, 0.2F, -1}, {0.2F, 0.2F, 1}, t));
  EXPECT_TRUE(meet({0.2F, 0.2F, 0}, {0.2F, 0.2F, 1}, t));   // an end on it
  EXPECT_TRUE(meet({0.5F, 0.5F, -1}, {0.5F, 0.5F, 1}, t));  // through a side
  EXPECT_TRUE(meet({-1, 0.5F, 0}, {1, 0.5F, 0}, t));        // in its plane
  EXPECT_FALSE(meet({0.6F, 0.6F, 0}, {1, 1, 0}, t));        // in its plane, beside it
  EXPECT_FALSE(meet({0.2F, 0.2F, 1e-30F}, {0.2F, 0.2F, 1}, t));
  EXPECT_FALSE(
      meet({0.5F, std::nextafter(0.5F, 1.F), -1}, {0.5F, std::nextafter(0.5F, 1.F), 1}, t));
}

}  // namespace
}  // namespace drench::stress_tests
