// Columns of the particles on the vertices.

#include <gtest/gtest.h>

#include <algorithm>

#include "surfacing/surface.h"
#include "tests/surfacing/scenes.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using namespace surfacing_scenes;
using Imath::V3f;

constexpr double spacing = 0.01;  // m

TEST(SurfaceAttributes, AreThereOnlyIfParticlesHaveThem) {
  ParticleFrame frame = splash(5000, spacing, 1);
  TriangleMesh mesh = surface_frame(frame, {});
  EXPECT_TRUE(mesh.source.empty() && mesh.age.empty() && mesh.wetness.empty());
  frame.age.assign(frame.position.size(), 2.5f);
  mesh = surface_frame(frame, {});
  EXPECT_TRUE(mesh.source.empty() && mesh.wetness.empty());
  ASSERT_EQ(mesh.age.size(), mesh.position.size());
  for (const float age : mesh.age) EXPECT_NEAR(age, 2.5, 1e-6 * 2.5);
}

// Age rises along X by 1 a spacing, wetness falls along Z. A vertex stands at most a spacing beyond
// the particles, and their weighted mean lies inside: 1.2 spacings is the most by which it lags.
TEST(SurfaceAttributes, FollowTheParticlesWithinASpacing) {
  ParticleFrame frame = relaxed_ball(20000, spacing, 20, 1);
  for (const V3f& p : frame.position) {
    frame.age.push_back(float(p.x / spacing) + 50);
    frame.wetness.push_back(0.5f - p.z);
  }
  const auto [least, most] = std::minmax_element(frame.age.begin(), frame.age.end());
  const TriangleMesh mesh = surface_frame(frame, {});
  double mean = 0;
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    const V3f& p = mesh.position[v];
    EXPECT_NEAR(mesh.age[v], p.x / spacing + 50, 1.2);
    EXPECT_NEAR(mesh.wetness[v], 0.5 - p.z, 1.2 * spacing);
    EXPECT_GE(mesh.age[v], *least);
    EXPECT_LE(mesh.age[v], *most);
    mean += mesh.age[v] - (p.x / spacing + 50);
  }
  EXPECT_NEAR(mean / double(mesh.position.size()), 0, 0.02);  // outside by as much on both sides
}

// Two balls that touch: whatever the mean may be there, a source is one of the two.
TEST(SurfaceAttributes, TakeTheSourceOfTheNearestParticle) {
  ParticleFrame frame = two_balls(2000, spacing, 20, 0.2);
  for (size_t i = 0; i < frame.position.size(); ++i) frame.source.push_back(i < 2000 ? 3 : 250);
  const TriangleMesh mesh = surface_frame(frame, {});
  size_t of_first = 0;
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    const auto nearest = std::min_element(
        frame.position.begin(), frame.position.end(), [&](const V3f& a, const V3f& b) {
          return (a - mesh.position[v]).length2() < (b - mesh.position[v]).length2();
        });
    const float least = (*nearest - mesh.position[v]).length();
    bool right = false;  // ties to rounding
    for (size_t i = 0; i < frame.position.size(); ++i)
      right |= (frame.position[i] - mesh.position[v]).length() < least * (1 + 1e-4f) &&
               mesh.source[v] == float(frame.source[i]);
    EXPECT_TRUE(right) << v;
    of_first += mesh.source[v] == 3;
  }
  EXPECT_NEAR(double(of_first) / double(mesh.position.size()), 0.5, 0.05);
}

TEST(SurfaceAttributes, NamesAColumnThatIsTooShort) {
  ParticleFrame frame = splash(1000, spacing, 1);
  frame.age.assign(10, 0.f);
  EXPECT_NE(test::error_of([&] { surface_frame(frame, {}); }).find("a column of 10"),
            std::string::npos);
}

}  // namespace
}  // namespace drench
