// Closest points of pieces of sheets and the safe part of their paths
// (sim/passes/cloth/self_contact_ccd.h).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "sim/passes/cloth/self_contact_ccd.h"

namespace drench::sim_tests {
namespace {

using namespace sim::cpu;
using V = Vec3<double>;

struct Edge {
  V from, to;
};

double to_edge(V p, const Edge& e) {
  const V way = e.to - e.from;
  const double u = std::clamp(dot(p - e.from, way) / dot(way, way), 0., 1.);
  return length(p - e.from - way * u);
}

/// Where each line passes the other inside of both, by the triple products with their common
/// normal, and ends to edges otherwise: without the determinant that nearly parallel edges lose.
double distance_by_normal(const Edge& a, const Edge& b) {
  const double ends =
      std::min({to_edge(a.from, b), to_edge(a.to, b), to_edge(b.from, a), to_edge(b.to, a)});
  const V d = a.to - a.from, e = b.to - b.from, r = b.from - a.from, n = cross(d, e);
  const double size2 = dot(n, n);
  if (size2 == 0) return ends;
  const double s = dot(cross(r, e), n) / size2, u = dot(cross(r, d), n) / size2;
  if (s < 0 || s > 1 || u < 0 || u > 1) return ends;
  return std::min(ends, std::abs(dot(r, n)) / std::sqrt(size2));
}

double distance_of(const V (&p)[4]) { return length(distance_of_pieces(true, p).apart); }

/// Edges of 10 mm, the second turned by `angle` about the middle of the first and `height` above.
struct Crossed {
  V p[4];
  Crossed(double angle, double height) {
    const double c = 0.005 * std::cos(angle), s = 0.005 * std::sin(angle);
    p[0] = {-0.005, 0, 0}, p[1] = {0.005, 0, 0}, p[2] = {-c, height, -s}, p[3] = {c, height, s};
  }
};

TEST(SheetPieces, NearlyParallelEdgesAreAsFarApartAsTheyAre) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int exponent = 0; exponent <= 9; ++exponent) {
    for (int k = 0; k < 200; ++k) {
      const double angle = std::pow(10., -exponent) * unit(random), shift = 0.01 * unit(random);
      Crossed of(angle, 1e-5 * unit(random));
      for (int c = 2; c < 4; ++c) of.p[c] = of.p[c] + V{shift, 0, 1e-5 * unit(random)};
      EXPECT_NEAR(distance_of(of.p), distance_by_normal({of.p[0], of.p[1]}, {of.p[2], of.p[3]}),
                  1e-8)
          << angle << ' ' << shift;
    }
  }
}

TEST(SheetPieces, NearlyParallelEdgesDoNotPassThroughEachOther) {
  constexpr double height = 1e-6, clearance = 5e-6;
  for (const double angle : {1e-1, 1e-2, 1e-3, 5e-4, 1e-4, 1e-5}) {
    const Crossed at(angle, height);
    const V through{0, -10 * height, 0}, none{0, 0, 0}, way[4] = {none, none, through, through};
    const double part = safe_part(true, at.p, way, clearance);
    EXPECT_GT(part, 0) << angle;
    EXPECT_LT(part, 0.1) << angle;  // they meet after a tenth of it
    V end[4];
    for (int c = 0; c < 4; ++c) end[c] = at.p[c] + way[c] * part;
    EXPECT_GT(distance_of(end), 0.5 * height) << angle;
  }
}

TEST(SheetPieces, WhatIsPressedStepByStepKeepsAShareOfItsClearance) {
  constexpr double clearance = 5e-6;
  Crossed at(1, 4 * clearance);
  const V down{0, -1e-3, 0}, none{0, 0, 0}, way[4] = {none, none, down, down};
  double before = distance_of(at.p);
  constexpr int steps = 1000;
  for (int k = 0; k < steps; ++k) {
    const double part = safe_part(true, at.p, way, clearance);
    ASSERT_LT(part, 1);
    for (int c = 0; c < 4; ++c) at.p[c] = at.p[c] + way[c] * part;
    const double now = distance_of(at.p);
    ASSERT_LT(now, before);  // it does not stand off what it could reach
    before = now;
  }
  EXPECT_NEAR(before, 2 * clearance / steps, 0.1 * 2 * clearance / steps);
}

TEST(SheetPieces, PathsThatKeepApartAreNotStopped) {
  const Crossed at(1, 1e-4);
  const V along{3e-3, 0, 0}, away{0, 1e-3, 0}, near{0, -0.8e-4, 0};
  for (const V& way : {along, away, near}) {
    const V none{0, 0, 0}, d[4] = {none, none, way, way};
    EXPECT_EQ(safe_part(true, at.p, d, 5e-6), 1);
    const V together[4] = {way, way, way, way};
    EXPECT_EQ(safe_part(true, at.p, together, 5e-6), 1);
  }
}

}  // namespace
}  // namespace drench::sim_tests
