// Euler's belt: a strip of a shell over a fixed cylinder, its ends hanging
// (sim/passes/cloth/triangle_obstacles.h, cloth_obstacles.h).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/obstacle_scenes.h"

namespace drench::sim_tests {
namespace {

constexpr double g = 9.81, radius = 0.05, thickness = 0.001, spacing = 0.004;  // m
constexpr double friction = 0.2;

/// Of the strip's middle line, m.
constexpr double belt = radius + 0.25 * spacing + 0.5 * thickness;

/// The longer end that friction just holds against a hanging end of `length` m. With rho g R for
/// unit and phi from the top towards the longer end, the strip on the cylinder has
///   dT/dphi = mu (T + cos phi) - sin phi,
///   T = C e^(mu phi) + (1 - mu^2) / (1 + mu^2) cos phi + B sin phi,   B = 2 mu / (1 + mu^2),
/// so that L2 - B R = (L1 + B R) e^(mu pi): Euler's formula but for the weight on the cylinder.
double held_length(double length) {
  const double b = 2 * friction / (1 + friction * friction) * belt;
  return (length + b) * std::exp(friction * M_PI) + b;
}

/// How far a strip has slid after 0.4 s, m, towards its longer end.
/// @param cells  around the half of the cylinder. @param share  of held_length that its longer end
/// is nearest to, with whole cells, and not between it and 1
double slid(int cells, double share) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -g, 0);
  shot.fluid.spacing = spacing;
  const double turn = M_PI / cells;  // of a cell
  // Sides of coarse cells touch, vertices of fine ones.
  const double out = std::max(belt / std::cos(0.5 * turn), belt + 0.15 * spacing);
  const double cell = 2 * out * std::sin(0.5 * turn);
  const int before = int(std::round(0.1 / cell));
  const double shorter = before * cell, longer = share * held_length(shorter) / cell;
  const int after = int(share < 1 ? std::floor(longer) : std::ceil(longer));
  Cloth strip;
  strip.model = ClothModel::shell, strip.thickness = thickness, strip.damping = 0;
  strip.cells = V2i(before + cells + after, 2);
  strip.u = V3d(cell * strip.cells.x, 0, 0), strip.v = V3d(0, 0, 0.03);
  strip.corner = V3d(-shorter, 0.1, -0.015);
  shot.cloth.push_back(strip);
  Obstacle& post = add_obstacle(shot, ObstacleType::mesh, V3d(0));
  post.mesh_file = bounding_mesh(radius, 0.03), post.friction = friction;
  const LevelSetMaker maker = [](const TriangleMesh&, double voxel, double band,
                                 const LevelSetBounds&) { return cylinder(radius, voxel, band); };
  sim::Scene scene = sim::build_scene(shot, maker);
  sim::HostVec& x = scene.start.cloth_position;
  const auto place = [&](double k) {  // k in cells from the shorter end
    const double on = k - before;
    if (on < 0) return V3d(-out, on * cell, 0);
    if (on > cells) return V3d(out, (cells - on) * cell, 0);
    return V3d(-out * std::cos(on * turn), out * std::sin(on * turn), 0);
  };
  for (size_t v = 0; v < x.size(); ++v) {
    const double world = scene.frame.to_world(0, x.x[v]);
    const V3d p = place((world + shorter) / cell);
    x.x[v] = scene.frame.to_local(0, p.x), x.y[v] = scene.frame.to_local(1, p.y);
  }
  Stepper run(std::move(scene));
  const sim::HostState start = run.solver->save();
  run.advance(0.4);
  const sim::HostState end = run.solver->save();
  double sum = 0;
  int count = 0;
  for (size_t v = size_t(strip.cells.x); v < end.cloth_position.size();
       v += size_t(strip.cells.x + 1))
    sum += at(start.cloth_position, v).y - at(end.cloth_position, v).y, ++count;
  return sum / count;
}

class Belt : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Cells, Belt, testing::Values(5, 10, 20, 40));

TEST_P(Belt, SlipsWhereOneEndOutweighsTheOtherAsEulerSays) {
  EXPECT_LT(std::abs(slid(GetParam(), 0.95)), 1e-3);
  EXPECT_GT(slid(GetParam(), 1.05), 0.01);
}

}  // namespace
}  // namespace drench::sim_tests
