// Coarse levels of the pressure solve: transfers between them, and deep water, which needs them.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/listed.h"

namespace drench::sim_tests {
namespace {

using sim::cpu::Hierarchy;
using sim::cpu::NodeLevel;

/// Particles at random in cubes whose sides have odd and even numbers of cells, between walls and
/// around seams.
class Levels : public testing::TestWithParam<std::tuple<double, Axis>> {
 protected:
  Levels() {
    const auto [side, axis] = GetParam();
    Random random(7);
    std::vector<V3d> places;
    for (int i = 0; i < 900; ++i) {
      const double x = side * random(), y = side * random(), z = side * random();
      places.push_back(V3d(x, y, z));
    }
    listed = std::make_unique<Listed>(places, side, std::array{axis, Axis::open, axis});
    sim::cpu::shape_levels(listed->state);
  }
  Hierarchy& levels() const { return listed->state.pressure.hierarchy; }
  float* fill(const NodeLevel& level, unsigned seed) const {
    Random random(seed);
    float* nodes = levels().answer.data() + level.first;
    for (int n = 0; n < level.count(); ++n) nodes[n] = float(random() - 0.5);
    return nodes;
  }
  std::unique_ptr<Listed> listed;
};
INSTANTIATE_TEST_SUITE_P(Cubes, Levels,
                         testing::Combine(testing::Values(0.08, 0.11, 0.13, 0.3),
                                          testing::Values(Axis::walls, Axis::periodic)));

struct One {
  float operator()(int) const { return 1.f; }
};

// Functions of a level add up to one: their sums over the particles to the number of particles.
TEST_P(Levels, CountEveryParticleOnce) {
  float* nodes = levels().answer.data();
  sim::cpu::restrict_particles(listed->state, nodes, One{});
  for (int l = 0; l < levels().levels; ++l) {
    if (l > 0) sim::cpu::restrict_nodes(listed->state, l, nodes);
    const NodeLevel& level = levels().level[l];
    double sum = 0;
    for (int n = 0; n < level.count(); ++n) sum += nodes[level.first + n];
    EXPECT_NEAR(sum, 900, 1e-2) << l;
  }
  EXPECT_EQ(levels().level[levels().levels - 1].count(), 1);
}

// The preconditioner is symmetric: sums from level to level are the transpose of interpolation.
TEST_P(Levels, RestrictAsTheTransposeOfInterpolation) {
  for (int l = 1; l < levels().levels; ++l) {
    const NodeLevel fine = levels().level[l - 1], coarse = levels().level[l];
    float *u = fill(fine, 3), *v = fill(coarse, 5);
    const std::vector<float> on_fine(u, u + fine.count()), on_coarse(v, v + coarse.count());
    double down = 0, up = 0, scale = 0;
    sim::cpu::restrict_nodes(listed->state, l, levels().answer.data());
    for (int n = 0; n < coarse.count(); ++n) down += double(on_coarse[size_t(n)]) * v[n];
    std::copy(on_coarse.begin(), on_coarse.end(), v);
    std::fill(u, u + fine.count(), 0.f);
    sim::cpu::prolong_nodes(listed->state, l, levels().answer.data());
    for (int n = 0; n < fine.count(); ++n) {
      up += double(on_fine[size_t(n)]) * u[n];
      scale += std::abs(double(on_fine[size_t(n)]) * u[n]);
    }
    EXPECT_NEAR(down, up, 1e-6 * scale) << l;
  }
}

// Interpolation to particles and sums over them are transposes too.
TEST_P(Levels, InterpolateAsParticlesAreSummed) {
  sim::cpu::State& state = listed->state;
  const NodeLevel level = levels().level[0];
  float* nodes = fill(level, 9);
  const sim::cpu::FinestNodes finest{state.fluid.grid, level, levels().shift};
  double up = 0, down = 0, scale = 0;
  for (int i = 0; i < listed->count(); ++i) {
    const double v = finest.interpolate(state.pressure.place.data()[i], nodes);
    up += v, scale += std::abs(v);
  }
  const std::vector<float> values(nodes, nodes + level.count());
  sim::cpu::restrict_particles(state, nodes, One{});
  for (int n = 0; n < level.count(); ++n) down += double(values[size_t(n)]) * nodes[n];
  EXPECT_NEAR(down, up, 1e-5 * scale);
}

// 80 layers threw themselves up at 1.8 sqrt(g H) when steps did not know the pressure and solves
// left smooth errors; the 50 iterations a step that short steps alone took are 14 to 16 now.
TEST(DeepWater, StaysAtRest) {
  Shot shot = water();
  shot.gravity = V3d(0, -9.81, 0);
  const double a = shot.fluid.spacing, depth = 80 * a;
  shot.fluid.tolerance = 1e-5;
  shot.domain.min = V3d(0), shot.domain.max = V3d(8 * a, 1.5 * depth, 8 * a);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  add_box(shot, V3d(0), {8, 80, 8});
  Stepper run(shot);
  int iterations = 0, start = 0;
  double fastest = 0;
  while (run.time < 0.15) {
    run.step();
    fastest = std::max(fastest, double(run.limits.max_speed));
    if (run.time > 0.05) iterations += run.limits.iterations;  // a cold start takes more
    if (run.time <= 0.05) start = run.steps;
  }
  EXPECT_LT(fastest, 0.2 * std::sqrt(9.81 * depth));
  EXPECT_LT(iterations, 30 * (run.steps - start));
  EXPECT_NEAR(centre_of_mass(run.solver->save()).y, 0.5 * depth, 0.005 * depth);
}

}  // namespace
}  // namespace drench::sim_tests
