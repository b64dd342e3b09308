// Water between closing sheets, and in a bag.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/contract/sphere_mesh.h"
#include "tests/stress/report.h"
#include "tests/stress/scenes.h"

namespace drench::stress_tests {
namespace {

class Squeeze : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Speeds, Squeeze, testing::Values(0.1, 1., 10.),
                         [](const auto& p) { return std::to_string(int(10 * p.param)) + "dm"; });

/// Mean x of the vertices of a sheet.
double height_of(const Watch& watch, size_t sheet) {
  const int first = watch.run.scene.first_vertex[sheet],
            end = watch.run.scene.first_vertex[sheet + 1];
  double sum = 0;
  for (int v = first; v < end; ++v) sum += watch.state().cloth_position.y[v] / (end - first);
  return sum;
}

// Two heavy sheets fly at each other with a block between them, in free space.
TEST_P(Squeeze, LetsTheWaterOutSidewaysOnly) {
  const double a = 0.02, speed = GetParam(), thickness = 1e-3, size = 16 * a;
  Shot shot = water(a);
  shot.gravity = V3d(0), shot.domain.min = V3d(-4), shot.domain.max = V3d(4);
  add_box(shot, V3d(-5 * a, -2 * a, -5 * a), {10, 4, 10});
  for (const double side : {-1., 1.}) {
    Cloth& sheet = add_sheet(shot, size, side * (2 * a + thickness / 2), 16);
    cotton(sheet);
    sheet.name = side < 0 ? "low" : "high";
    sheet.areal_density = 200, sheet.damping = 0, sheet.velocity.y = -side * speed / 2;
  }
  Watch watch(shot, 1);
  const double reach = 0.5 * (a + thickness);  // epsilon
  double gap = 1;
  while (watch.run.time < 6 * a / speed && watch.step()) {
    gap = std::min(gap, height_of(watch, 1) - height_of(watch, 0) - thickness);
    if (gap < 0.5 * reach) break;
  }
  EXPECT_LT(gap, 3 * reach);
  // Twice what an even outflow has at the rim of a disc that closes: speed R / (2 gap). The sheets
  // bend: their rims meet, and go through each other, while their middles are 50 mm apart.
  EXPECT_LT(watch.figures().max_speed, speed * (size / 2) / (3 * reach));
  int out = 0;
  const sim::HostState& state = watch.state();
  for (size_t i = 0; i < state.id.size(); ++i) {
    out +=
        std::max(std::abs(state.position.x[i] - 4), std::abs(state.position.z[i] - 4)) > size / 2;
  }
  Gates gates = squeezed();
  gates.speed = not_gated;  // what is pressed out is as fast as the gap is wide over high
  gates.drift = 1e-6;
  report("squeezed fluid", fmt::format("{} m/s", speed), watch, gates,
         fmt::format("gap {:.2f} epsilon, {} of {} out", gap / reach, out, state.id.size()));
}

struct Bag {
  double volume = 0;  // m^3, of the mesh
  int outside = 0;    // particles, by the solid angle of the mesh
};

Bag measure_bag(const Watch& watch) {
  const sim::ClothTopology& cloth = watch.run.scene.cloth;
  const sim::HostState& state = watch.state();
  Bag bag;
  const auto corner = [&](int t, int k) {
    return at(state.cloth_position, cloth.corner[3 * t + k]);
  };
  const V3d origin = corner(0, 0);
  for (int t = 0; t < cloth.triangles(); ++t) {
    const V3d a = corner(t, 0) - origin, b = corner(t, 1) - origin, c = corner(t, 2) - origin;
    bag.volume += a.dot(b.cross(c)) / 6;
  }
  for (size_t i = 0; i < state.id.size(); ++i) {
    double angle = 0;
    for (int t = 0; t < cloth.triangles(); ++t) {
      const V3d p = at(state.position, i), a = corner(t, 0) - p, b = corner(t, 1) - p,
                c = corner(t, 2) - p;
      const double la = a.length(), lb = b.length(), lc = c.length();
      angle += 2 * std::atan2(a.dot(b.cross(c)),
                              la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    bag.outside += std::abs(angle) < 2 * M_PI;
  }
  return bag;
}

/// A ball of cotton of 0.1 m with as much water in it as fits half a spacing away.
Shot pouch(const test::TemporaryFolder& folder, V3d velocity) {
  const double radius = 0.1;
  Shot shot = water(long_form() ? radius / 16 : radius / 8);
  shot.domain.axis[1] = Axis::walls;
  TriangleMesh mesh = test::unit_sphere(16, 24);
  for (V3f& x : mesh.position) x *= float(radius);
  Cloth& bag = add_mesh(shot, mesh, folder);
  bag.velocity = velocity;
  shot.fluid.sphere.push_back(
      {V3d(0), radius - 0.55 * shot.fluid.spacing - 0.5 * bag.thickness - 0.02 * radius, velocity});
  return shot;
}

void report_pouch(const std::string& setting, const Shot& shot, double seconds,
                  const Gates& gates = {}) {
  Watch watch(shot);
  const double water = watch.figures().particles * std::pow(shot.fluid.spacing, 3);
  const double before = measure_bag(watch).volume;
  watch.until(seconds);
  const Bag bag = measure_bag(watch);
  EXPECT_EQ(bag.outside, 0) << setting;
  // Nothing holds the layers of folds apart, so that a limp bag has more room in it than water.
  EXPECT_GT(bag.volume, 0.99 * water) << setting;
  report("pouch", setting, watch, gates,
         fmt::format("{} outside; water {:.3f}, bag {:.3f} to {:.3f} l", bag.outside, 1e3 * water,
                     1e3 * before, 1e3 * bag.volume));
}

// Water at 1 m/s in a bag that is free, without gravity: all that one loses the other gets.
TEST(Momentum, OfWaterAndItsBagIsKept) {
  const test::TemporaryFolder folder;
  Shot shot = pouch(folder, V3d(0));
  shot.gravity = V3d(0), shot.domain.axis[1] = Axis::open;
  shot.domain.min = V3d(-100), shot.domain.max = V3d(100);
  shot.cloth[0].damping = 0, shot.fluid.sphere[0].velocity = V3d(1, 0.5, -0.3);
  Watch watch(shot);
  Gates gates;
  gates.speed = 1.25;  // without a fall the bound is the fastest at the start
  for (const int steps : long_form() ? std::vector{1000, 3000, 10000} : std::vector{1000}) {
    watch.steps(steps - watch.figures().steps);
    gates.drift = 1e-5 * steps / 1000;
    report("momentum", fmt::format("water at 1.2 m/s in a free bag, {} steps", steps), watch,
           gates);
  }
}

TEST(Pouch, HungHoldsItsWater) {
  const test::TemporaryFolder folder;
  Shot shot = pouch(folder, V3d(0));
  shot.cloth[0].pin.push_back({{}, {{V3d(-0.05, 0.085, -0.05), V3d(0.05, 0.2, 0.05)}}});
  report_pouch("hung", shot, long_form() ? 3 : 0.3);
}

TEST(Pouch, SwungHoldsItsWater) {
  const test::TemporaryFolder folder;
  Shot shot = pouch(folder, V3d(2, 0, 0));
  shot.cloth[0].pin.push_back({{}, {{V3d(-0.05, 0.085, -0.05), V3d(0.05, 0.2, 0.05)}}});
  report_pouch("swung at 2 m/s", shot, long_form() ? 3 : 0.3);
}

TEST(Pouch, DroppedFromTwoMetresHoldsItsWater) {
  const test::TemporaryFolder folder;
  Shot shot = pouch(folder, V3d(0, -std::sqrt(2 * 9.81 * 2), 0));
  shot.domain.min.y = -0.13;
  report_pouch("dropped from 2 m", shot, long_form() ? 1 : 0.08);
}

}  // namespace
}  // namespace drench::stress_tests
