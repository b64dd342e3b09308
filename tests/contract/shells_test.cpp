// What closed shells bound: nested, crossing, touching, either way round.

#include "pipeline/contract/geometry/shells.h"

#include <gtest/gtest.h>

#include <functional>

#include "pipeline/contract/files/mesh_file.h"
#include "pipeline/contract/geometry/level_set.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "tests/contract/shells_mesh.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using Imath::V3d, Imath::V3f;
using namespace test;

/// By the divergence theorem: of the solid, if the shells are turned away from it.
double volume_of(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangle)
    sum += V3d(mesh.position[t.x]).dot(V3d(mesh.position[t.y]).cross(V3d(mesh.position[t.z]))) / 6;
  return sum;
}

TriangleMesh oriented(TriangleMesh mesh) {
  orient_shells(mesh);
  return mesh;
}

/// At the voxel's corner that is nearest to a place; infinite, with its sign, beyond the band.
float value_at(const LevelSet& set, const V3d& place) {
  size_t b = 0, c = 0;
  for (int k = 2; k >= 0; --k) {
    const int voxel = int(std::lround(place[k] / double(set.voxel))) - 8 * set.low[k];
    if (voxel < 0 || voxel >= 8 * set.blocks[k]) return INFINITY;
    b = b * size_t(set.blocks[k]) + size_t(voxel / 8), c = c * 9 + size_t(voxel % 8);
  }
  if (set.block[b] < 0) return set.block[b] == LevelSet::inside ? -INFINITY : INFINITY;
  return set.value[size_t(set.block[b]) * LevelSet::corners + c];
}

using Holds = std::function<bool(const V3d&)>;

/// Corners of voxels over the mesh that are inside by the level set and not by `holds`, or the
/// other way round. Three quarters of a voxel to either side of a surface they may be either.
int wrong_places(const TriangleMesh& mesh, double voxel, const Holds& holds) {
  const LevelSet set = make_level_set(mesh, voxel, 4 * voxel);
  V3d low(1e30), high(-1e30);
  for (const V3f& p : mesh.position)
    for (int k = 0; k < 3; ++k)
      low[k] = std::min(low[k], double(p[k])), high[k] = std::max(high[k], double(p[k]));
  int first[3], last[3], wrong = 0;
  for (int k = 0; k < 3; ++k) {
    first[k] = int(std::floor(low[k] / voxel)) - 2;
    last[k] = int(std::ceil(high[k] / voxel)) + 2;
  }
  for (int z = first[2]; z <= last[2]; ++z) {
    for (int y = first[1]; y <= last[1]; ++y) {
      for (int x = first[0]; x <= last[0]; ++x) {
        const V3d p = V3d(x, y, z) * voxel;
        const bool expected = holds(p);
        bool near = false;
        for (int k = 0; k < 27; ++k)
          near |= holds(p + V3d(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1) * (0.75 * voxel)) != expected;
        wrong += !near && std::signbit(value_at(set, p)) != expected;
      }
    }
  }
  return wrong;
}

Holds in_box(const V3d& low, const V3d& high) {
  return [=](const V3d& p) {
    return p.x > low.x && p.y > low.y && p.z > low.z && p.x < high.x && p.y < high.y &&
           p.z < high.z;
  };
}

double ball_volume(double radius) { return volume_of(ball(float(radius))); }

// Ball in ball in ball: solid, cavity, solid, whichever way each was turned.
TEST(Shells, NestedOnesAreSolidAndCavityInTurn) {
  for (int turned = 0; turned < 8; ++turned) {
    TriangleMesh mesh;
    for (int k = 0; k < 3; ++k) {
      const TriangleMesh one = ball(0.9f - 0.3f * float(k), V3f(0.01f * float(k), 0, 0));
      mesh = joined(mesh, turned >> k & 1 ? reversed(one) : one);
    }
    const Shells shells = find_shells(mesh);
    EXPECT_EQ(shells.depth, (std::vector<int>{0, 1, 2}));
    EXPECT_NEAR(volume_of(oriented(mesh)), ball_volume(0.9) - ball_volume(0.6) + ball_volume(0.3),
                1e-5);
    EXPECT_EQ(wrong_places(mesh, 0.04,
                           [](const V3d& p) {
                             const double r = p.length();
                             return (r < 0.9 && (p - V3d(0.01, 0, 0)).length() > 0.6) ||
                                    (p - V3d(0.02, 0, 0)).length() < 0.3;
                           }),
              0)
        << turned;
  }
}

// Next to each other every one is outward by itself, though the sum of volumes may be less than 0.
TEST(Shells, ApartEachIsTurnedOutwardByItself) {
  const TriangleMesh mesh =
      joined(ball(0.3f), joined(reversed(ball(0.5f, V3f(1, 0, 0))), ball(0.2f, V3f(0, 0.8f, 0))));
  EXPECT_LT(volume_of(mesh), 0);
  EXPECT_EQ(find_shells(mesh).depth, (std::vector<int>{0, 0, 0}));
  EXPECT_NEAR(volume_of(oriented(mesh)), ball_volume(0.3) + ball_volume(0.5) + ball_volume(0.2),
              1e-5);
}

// A box in a box that sticks out of one of its sides, by a thousandth of its own volume or more, is
// one body with it; by less it is a cavity. Which side makes no difference.
TEST(Shells, StickOutAlongAnyAxisAlike) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool low : {false, true}) {
      for (const float out : {0.0002f, 0.001f, 0.004f}) {
        V3f from(-0.19f), to(0.19f);
        (low ? from : to)[axis] = (0.2f + out) * (low ? -1.f : 1.f);
        const Shells shells =
            find_shells(joined(box_mesh(V3f(-0.2f), V3f(0.2f)), box_mesh(from, to)));
        EXPECT_EQ(shells.bodies(), out / 0.39f > 1e-3f ? 1 : 2) << axis << " " << out;
      }
    }
  }
}

// Two boxes that cross are their union, turned either way, also with faces in common planes, where
// no edge crosses the inside of a face, and where they share a small corner of two long bars.
TEST(Shells, CrossingOnesAreUnited) {
  const TriangleMesh one = box_mesh(V3f(0), V3f(0.8f, 0.4f, 0.4f));
  const struct {
    V3f low, high;
  } others[] = {{V3f(0.5f, 0.13f, -0.21f), V3f(1.1f, 0.9f, 0.22f)},
                {V3f(0.4f, 0, 0), V3f(1.2f, 0.4f, 0.4f)},
                {V3f(0.2f, -1, 0), V3f(0.6f, 1, 0.4f)},
                {V3f(0.72f, 0.32f, 0.32f), V3f(0.8f, 4, 0.4f)}};
  for (const auto& other : others) {
    for (const bool turned : {false, true}) {
      const TriangleMesh two = box_mesh(other.low, other.high);
      const TriangleMesh mesh = joined(one, turned ? reversed(two) : two);
      EXPECT_EQ(find_shells(mesh).bodies(), 1);
      const Holds a = in_box(V3d(0), V3d(0.8, 0.4, 0.4)),
                  b = in_box(V3d(other.low), V3d(other.high));
      EXPECT_EQ(wrong_places(mesh, 0.03, [&](const V3d& p) { return a(p) || b(p); }), 0)
          << other.low;
      EXPECT_NEAR(volume_of(oriented(mesh)), volume_of(one) + volume_of(two), 1e-5);
    }
  }
}

TEST(Shells, HoldTwiceWhatIsDoubled) {
  const TriangleMesh one = box_mesh(V3f(0), V3f(1));
  TriangleMesh doubled = one;
  doubled.triangle.insert(doubled.triangle.end(), one.triangle.begin(), one.triangle.end());
  EXPECT_TRUE(holds_twice(doubled));
  EXPECT_TRUE(holds_twice(joined(one, one)));
  EXPECT_TRUE(holds_twice(joined(one, box_mesh(V3f(0.5f), V3f(1.5f)))));
  EXPECT_FALSE(holds_twice(one));
  EXPECT_FALSE(holds_twice(joined(one, box_mesh(V3f(0.2f), V3f(0.8f)))));
}

TEST(Shells, MeetWhereTheyCrossOrTouch) {
  const TriangleMesh one = box_mesh(V3f(0), V3f(1));
  EXPECT_FALSE(shells_meet(one));
  EXPECT_FALSE(shells_meet(joined(one, box_mesh(V3f(0.2f), V3f(0.8f)))));  // a cavity
  EXPECT_FALSE(shells_meet(joined(one, box_mesh(V3f(1.001f), V3f(2)))));   // apart
  EXPECT_TRUE(shells_meet(joined(one, box_mesh(V3f(0.5f), V3f(1.5f)))));   // crossing
  for (int axis = 0; axis < 3; ++axis) {
    V3f beside(0), within(0.2f);
    beside[axis] = 1, within[axis] = 0;
    EXPECT_TRUE(shells_meet(joined(one, box_mesh(beside, beside + V3f(1)))));
    EXPECT_TRUE(shells_meet(joined(one, box_mesh(within, V3f(0.8f)))));  // a flush cavity
  }
}

// What the solid hides of a shell is no surface: distances within are to what can be seen.
TEST(Shells, HiddenFacesAreAtNoDistance) {
  const TriangleMesh mesh =
      joined(box_mesh(V3f(-1, -0.4f, -0.4f), V3f(0.3f, 0.4f, 0.4f)),
             reversed(box_mesh(V3f(-0.3f, -0.4f, -0.4f), V3f(1, 0.4f, 0.4f))));
  constexpr double voxel = 0.05;
  const LevelSet set = make_level_set(mesh, voxel, 4 * voxel);
  for (int x = -18; x <= 18; ++x) {
    for (int y = -7; y <= 7; ++y) {
      for (int z = -7; z <= 7; ++z) {
        const double depth = voxel * std::min({20 - std::abs(x), 8 - std::abs(y), 8 - std::abs(z)});
        // What is left of hidden faces ends within a voxel and a half of the surface.
        const V3d p = V3d(x, y, z) * voxel;
        const double value = std::max(value_at(set, p), -set.band);
        EXPECT_GT(value, -depth - 1e-4) << p;
        EXPECT_LT(value, std::max(-depth + 1.5 * voxel, -4 * voxel) + 1e-4) << p;
      }
    }
  }
}

// Two cavities that cross are one: no wall is left between them. A plate in it that is thinner than
// a voxel stays.
TEST(Shells, CavitiesThatCrossAreOneWithoutAWall) {
  const TriangleMesh outer = box_mesh(V3f(-1.2f, -0.6f, -0.6f), V3f(1.2f, 0.6f, 0.6f));
  const TriangleMesh mesh =
      joined(outer, joined(box_mesh(V3f(-1, -0.4f, -0.4f), V3f(0.3f, 0.4f, 0.4f)),
                           box_mesh(V3f(-0.3f, -0.4f, -0.4f), V3f(1, 0.4f, 0.4f))));
  constexpr double voxel = 0.05;
  const LevelSet set = make_level_set(mesh, voxel, 4 * voxel);
  for (int x = -18; x <= 18; ++x) {
    for (int y = -7; y <= 7; ++y) {
      for (int z = -7; z <= 7; ++z) {
        const double depth = voxel * std::min({20 - std::abs(x), 8 - std::abs(y), 8 - std::abs(z)});
        const V3d p = V3d(x, y, z) * voxel;
        EXPECT_GT(value_at(set, p), std::min(depth - 1.5 * voxel, 4 * voxel) - 1e-4) << p;
      }
    }
  }
  const TriangleMesh plate = box_mesh(V3f(-0.01f, -0.3f, -0.3f), V3f(0.01f, 0.3f, 0.3f));
  EXPECT_LT(std::abs(value_at(make_level_set(joined(mesh, plate), voxel, 4 * voxel), V3d(0))),
            0.011);
}

// Two chambers, with a wall of 0.02 between them, that a third below joins.
TEST(Shells, AThinWallBetweenCavitiesThatCrossStays) {
  TriangleMesh mesh = box_mesh(V3f(-0.7f), V3f(0.7f));
  for (const auto& [low, high] : {std::pair{V3f(-0.5f, -0.2f, -0.3f), V3f(-0.01f, 0.5f, 0.3f)},
                                  {V3f(0.01f, -0.2f, -0.3f), V3f(0.5f, 0.5f, 0.3f)},
                                  {V3f(-0.5f, -0.5f, -0.3f), V3f(0.5f, -0.1f, 0.3f)}})
    mesh = joined(mesh, box_mesh(low, high));
  EXPECT_EQ(find_shells(mesh).depth, (std::vector<int>{0, 1}));
  constexpr double voxel = 0.05;
  const LevelSet set = make_level_set(mesh, voxel, 4 * voxel);
  EXPECT_NEAR(value_at(set, V3d(0, 0.2, 0)), -0.01, 1e-4);
  EXPECT_NEAR(value_at(set, V3d(0.1, 0.2, 0)), 0.09, 1e-4);
  EXPECT_GT(value_at(set, V3d(0, -0.3, 0)), 0.2 - 1.5 * voxel);
}

// A cavity in a body of two crossing boxes, and a ball in it; the cavity is wholly in both boxes,
// or in one.
TEST(Shells, LieInWhatCrossingOnesUnite) {
  const TriangleMesh body =
      joined(box_mesh(V3f(-1, -0.5f, -0.5f), V3f(0.5f)), box_mesh(V3f(-0.5f), V3f(1, 0.5f, 0.5f)));
  for (const float x : {0.f, -0.75f}) {
    const TriangleMesh mesh =
        joined(body, joined(ball(0.2f, V3f(x, 0, 0)), ball(0.1f, V3f(x, 0, 0))));
    EXPECT_EQ(find_shells(mesh).depth, (std::vector<int>{0, 1, 2}));
    EXPECT_EQ(wrong_places(mesh, 0.03,
                           [&](const V3d& p) {
                             const double r = (p - V3d(double(x), 0, 0)).length();
                             return in_box(V3d(-1, -0.5, -0.5), V3d(1, 0.5, 0.5))(p) &&
                                    (r > 0.2 || r < 0.1);
                           }),
              0);
  }
}

TEST(Shells, OfATorusWithACavityKeepItsHole) {
  const TriangleMesh mesh = joined(torus(0.7f, 0.25f, 64, 32), torus(0.7f, 0.12f, 64, 32));
  const auto from_ring = [](const V3d& p) { return std::hypot(std::hypot(p.x, p.z) - 0.7, p.y); };
  EXPECT_EQ(find_shells(mesh).depth, (std::vector<int>{0, 1}));
  EXPECT_EQ(wrong_places(mesh, 0.03,
                         [&](const V3d& p) { return from_ring(p) < 0.25 && from_ring(p) > 0.12; }),
            0);
}

// At a vertex, along an edge, with a face: apart they stay, and a cavity that ends flush with the
// outside is open there.
TEST(Shells, ThatTouchAreNotOne) {
  const TriangleMesh one = box_mesh(V3f(0), V3f(0.4f));
  for (const V3f& low : {V3f(0.4f), V3f(0.4f, 0.4f, 0), V3f(0.4f, 0, 0)}) {
    const TriangleMesh mesh = joined(one, reversed(box_mesh(low, low + V3f(0.4f))));
    EXPECT_EQ(find_shells(mesh).bodies(), 2) << low;
    EXPECT_NEAR(volume_of(oriented(mesh)), 2 * 0.064, 1e-6) << low;
    EXPECT_EQ(wrong_places(mesh, 0.02,
                           [&](const V3d& p) {
                             return in_box(V3d(0), V3d(0.4))(p) ||
                                    in_box(V3d(low), V3d(low) + V3d(0.4))(p);
                           }),
              0)
        << low;
  }
  const TriangleMesh cup = joined(one, box_mesh(V3f(0.1f), V3f(0.3f, 0.4f, 0.3f)));
  EXPECT_EQ(find_shells(cup).depth, (std::vector<int>{0, 1}));
  EXPECT_EQ(wrong_places(cup, 0.02,
                         [&](const V3d& p) {
                           return in_box(V3d(0), V3d(0.4))(p) &&
                                  !in_box(V3d(0.1), V3d(0.3, 0.4, 0.3))(p);
                         }),
            0);
}

// Six plates that cross at a box's edges close in a room, which no shell holds.
TEST(Shells, RoomsBetweenPlatesAreOpen) {
  TriangleMesh mesh;
  const V3d low(-0.5), high(0.5);
  for (int k = 0; k < 3; ++k) {
    for (const float side : {-0.5f, 0.4f}) {
      V3f a(-0.5f), b(0.5f);
      a[k] = side, b[k] = side + 0.1f;
      mesh = joined(mesh, box_mesh(a, b));
    }
  }
  EXPECT_EQ(find_shells(mesh).bodies(), 1);
  EXPECT_EQ(wrong_places(mesh, 0.02,
                         [&](const V3d& p) {
                           return in_box(low, high)(p) && !in_box(V3d(-0.4), V3d(0.4))(p);
                         }),
            0);
}

// A mesh of one shell, and one whose shells are apart, is what it was to the last bit.
TEST(Shells, OfPlainMeshesChangeNothing) {
  const TriangleMesh mesh = joined(ball(0.3f), ball(0.2f, V3f(1, 0, 0)));
  EXPECT_EQ(oriented(mesh).triangle, mesh.triangle);
  EXPECT_EQ(oriented(reversed(mesh)).triangle, mesh.triangle);
}

// What is drawn faces away from the solid, normals included: out of the can and into its cavity.
TEST(Shells, NormalsOfACanFaceItsAir) {
  const TemporaryFolder folder;
  TriangleMesh can = joined(ball(0.5f), ball(0.4f));
  for (const V3f& p : can.position) can.normal.push_back(p.normalized());
  write_mesh(folder / "can.ply", can);
  const TriangleMesh read = read_closed_mesh(folder / "can.ply", 1);
  ASSERT_EQ(read.normal.size(), can.position.size());
  for (size_t v = 0; v < read.position.size(); ++v) {
    const float out = read.position[v].length() > 0.45f ? 1.f : -1.f;
    EXPECT_GT(out * read.normal[v].dot(read.position[v]), 0) << v;
  }
  EXPECT_NEAR(volume_of(read), ball_volume(0.5) - ball_volume(0.4), 1e-5);
}

// A block of 100 m in voxels of 5 mm, of which 0.6 m are asked for beside a face, an edge and deep
// within: 2.4 billion voxels of surface, and a second.
TEST(LevelSetBounds, TakeOnlyWhatIsAskedOfAHugeMesh) {
  const TriangleMesh block = box_mesh(V3f(-50), V3f(50));
  const double voxel = 0.005;
  const struct {
    V3d middle;
    bool inside;  // at it
    int near;     // faces that are near
  } looks[] = {{V3d(50.1, 3, 7), false, 1},
               {V3d(49.9, 49.9, 7), true, 2},
               {V3d(1, 2, 3), true, 0},
               {V3d(51.2, 0, 0), false, 0}};
  for (const auto& look : looks) {
    LevelSetBounds bounds;
    for (int k = 0; k < 3; ++k)
      bounds.low[k] = look.middle[k] - 0.3, bounds.high[k] = look.middle[k] + 0.3;
    bounds.most_bytes = 1 << 29;
    const LevelSet set = make_level_set(block, voxel, 4 * voxel, bounds);
    EXPECT_EQ(value_at(set, look.middle) < 0, look.inside) << look.middle;
    EXPECT_EQ(set.value.empty(), look.near == 0) << look.middle;
    EXPECT_LT(set.value.size(), 12'000'000u) << look.middle;
    for (int k = 0; k < 50 && look.near > 0; ++k) {
      V3d p = look.middle;  // across the face, within the band
      p.x = 50 + voxel * (k % 7 - 3), p.z += 0.005 * (k - 25);
      if (look.near == 2) p.y -= 0.1;
      EXPECT_NEAR(value_at(set, p), voxel * (k % 7 - 3), 0.02 * voxel) << p;
    }
  }
}

TEST(LevelSetBounds, RefuseWhatTakesMoreMemoryThanGiven) {
  LevelSetBounds bounds;
  bounds.most_bytes = 1 << 29;
  const std::string message =
      error_of([&] { make_level_set(box_mesh(V3f(-50), V3f(50)), 0.005, 0.02, bounds); });
  EXPECT_NE(message.find("more than the 0.5 GiB"), std::string::npos) << message;
  EXPECT_NE(message.find("scale"), std::string::npos) << message;
}

}  // namespace
}  // namespace drench
