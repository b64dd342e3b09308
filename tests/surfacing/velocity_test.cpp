// Velocities on the vertices against motions whose value is known everywhere.

#include <gtest/gtest.h>

#include "surfacing/surface.h"
#include "tests/surfacing/scenes.h"

namespace drench {
namespace {

using namespace surfacing_scenes;
using Imath::V3f;

constexpr double spacing = 0.01;  // m

TEST(SurfaceVelocity, IsExactInATranslation) {
  ParticleFrame frame = splash(20000, spacing, 1);
  const V3f velocity(3.7f, -12.1f, 0.03f);
  for (V3f& v : frame.velocity) v = velocity;
  for (const V3f& v : surface_frame(frame, {}).velocity) EXPECT_EQ(v, velocity);
}

// The mean of the particles' velocities would lag by the 0.6 spacings between the vertex and their
// middle. The fit leans to no gradient by a thousandth of the spread: 0.02 spacings per radian is
// left.
TEST(SurfaceVelocity, FollowsARotation) {
  const ParticleFrame frame = relaxed_ball(8000, spacing, 20, 1);  // turns at 1 rad/s about Y
  const TriangleMesh mesh = surface_frame(frame, {});
  for (size_t k = 0; k < mesh.position.size(); ++k) {
    const V3f p = mesh.position[k];
    EXPECT_LT((mesh.velocity[k] - V3f(p.z, 0, -p.x)).length(), 0.02 * spacing);
  }
}

// Drops of one particle have no gradient: their vertices move with them.
TEST(SurfaceVelocity, OfALoneParticleIsItsOwn) {
  ParticleFrame frame = lone_particles(27, spacing, 1);
  for (size_t i = 0; i < frame.velocity.size(); ++i) frame.velocity[i] = V3f(float(i), 1, 0);
  const TriangleMesh mesh = surface_frame(frame, {});
  for (size_t k = 0; k < mesh.position.size(); ++k) {
    size_t nearest = 0;
    for (size_t i = 0; i < frame.position.size(); ++i)
      if ((frame.position[i] - mesh.position[k]).length2() <
          (frame.position[nearest] - mesh.position[k]).length2())
        nearest = i;
    EXPECT_NEAR((mesh.velocity[k] - frame.velocity[nearest]).length(), 0, 1e-4);
  }
}

// Noise must not be blown up: no vertex is faster than three times the fastest particle. (The step
// from the mean is bound by twice the spread, and neither exceeds the fastest.)
TEST(SurfaceVelocity, StaysBoundedInARandomCloud) {
  const ParticleFrame frame = random_cloud(5000, 0.5, spacing, 1);
  float fastest = 0;
  for (const V3f& v : frame.velocity) fastest = std::max(fastest, v.length());
  for (const V3f& v : surface_frame(frame, {}).velocity) EXPECT_LE(v.length(), 3 * fastest);
}

}  // namespace
}  // namespace drench
