// Vectors in a register against the same, number by number.

#include "render/packed.h"

#include <gtest/gtest.h>

#include <random>

namespace drench::render::test {
namespace {

TEST(Packed, GivesTheBitsOfNumberByNumber) {
  std::mt19937 random(1);
  std::normal_distribution<float> number;
  const auto draw = [&] { return V3f(number(random), number(random), number(random)); };
  for (int k = 0; k < 1000; ++k) {
    const V3f a = draw(), b = draw();
    const float s = number(random);
    const Packed p(a), q = Packed::load(b);
    EXPECT_EQ((p + q * s - p * s).unpacked(), a + b * s - a * s);
    EXPECT_EQ(cross(p, q).unpacked(), cross(a, b));
    EXPECT_EQ(dot(p, q), dot(a, b));
    EXPECT_EQ(normalized(p).unpacked(), normalized(a));
    EXPECT_EQ(absolute(p).unpacked(), absolute(a));
    EXPECT_EQ(largest(p), largest(a));
    V3f stored[2] = {a, a};
    q.store(stored[0]);
    EXPECT_EQ(stored[0], b);
    EXPECT_EQ(stored[1], a);  // not one number more is written
  }
}

}  // namespace
}  // namespace drench::render::test
