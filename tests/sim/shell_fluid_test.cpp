// Shells that bear water, from shot files, against a closed form and a measurement
// (tests/validation/README.md).

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/support.h"
#include "tests/validation/shell_in_water.h"

namespace drench::sim_tests {
namespace {

using validation::opened_gate;
using validation::OpenedGate;
using validation::plate_under_water;

// Errors at 6, 10, 20 spacings across, %: 23, 8, 4.5 (to 0.4 s, and by rounding of the start, 2.5
// to 5.5); of plates as heavy without water, at 10, 20, 40 cells: 8, 2, 0.5. With steps of one
// length it is 1 at 20: the pressure comes and goes from step to step, and the steps with it.
TEST(ShellInWater, APlateUnderWaterSagsAsItsClosedForm) {
  EXPECT_NEAR(plate_under_water(6), 1, 0.3);
  EXPECT_NEAR(plate_under_water(10), 1, 0.12);
  EXPECT_NEAR(plate_under_water(20), 1, 0.05);
}

// At spacings of 8, 5 and 3.5 mm, RMS of x and y in %: 16 and 9, 11 and 6, 12 and 7; the most is 45
// mm at 0.13 s, measured 46.4 mm at 0.16 s. Spacings a thousandth apart differ by as much as 2 % of
// x. The measured gate stays open where this one follows the water as it sinks, as linear sheets
// without leaks at their sides do; of 10 MPa x is 18 % off.
TEST(ShellInWater, AGateOpensAsMeasured) {
  OpenedGate coarse;
  for (const double a : {7.97e-3, 7.99e-3, 8e-3, 8.01e-3, 8.03e-3}) {
    const OpenedGate one = opened_gate(a);
    EXPECT_FALSE(one.blew_up);
    coarse.x += one.x / 5, coarse.y += one.y / 5;
  }
  const OpenedGate fine = opened_gate(5e-3);
  EXPECT_FALSE(fine.blew_up);
  EXPECT_LT(coarse.x, 0.16);
  EXPECT_LT(coarse.y, 0.12);
  EXPECT_LT(fine.x, 0.12);
  EXPECT_LT(fine.y, 0.12);
  EXPECT_NEAR(fine.most, 0.0464, 0.003);
  EXPECT_NEAR(fine.most_time, 0.16, 0.04);
}

/// Water that falls on cotton that hangs by two sides, over which a wind blows, 0.05 s.
struct Caught {
  sim::HostState state;
  int sweeps = 0;
  explicit Caught(bool factors) {
    constexpr double a = 0.01;
    Shot shot = empty_shot();
    shot.domain.min = V3d(-0.2), shot.domain.max = V3d(0.2);
    shot.gravity = V3d(0, -9.81, 0);
    shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = a;
    shot.wind.present = true, shot.wind.velocity = Animated<V3d>(V3d(3, 0, 1));
    add_box(shot, V3d(-4 * a, 3 * a, -4 * a), {8, 4, 8});
    Cloth& c = shot.cloth.emplace_back();
    c.model = ClothModel::shell, c.corner = V3d(-0.1, 0, -0.1), c.u = V3d(0.2, 0.02, 0);
    c.v = V3d(0, 0, 0.2), c.cells = V2i(12, 12), c.thickness = 0.002, c.areal_density = 0.2;
    c.pin.emplace_back().box = {V3d(-0.11, -1, -1), V3d(-0.09, 1, 1)};
    c.pin.emplace_back().box = {V3d(0.09, -1, -1), V3d(0.11, 1, 1)};
    sim::Scene scene = sim::build_scene(shot);
    scene.parameters.factors_sheets = factors;
    Stepper run(std::move(scene));
    for (int k = 0; k < 50; ++k) run.step(1e-3), sweeps += run.limits.sheet_sweeps;
    state = run.solver->save();
  }
};

// One sweep an answer in place of up to sixteen; velocities differ by 1e-4 of what they are.
TEST(ShellInWater, AFactorAnswersAsSweepsDo) {
  const Caught swept(false), factored(true);
  double apart = 0, moved = 0;
  for (size_t v = 0; v < swept.state.cloth_velocity.size(); ++v) {
    const V3d u = at(swept.state.cloth_velocity, v);
    apart += (at(factored.state.cloth_velocity, v) - u).length2(), moved += u.length2();
  }
  EXPECT_GT(moved, 0);
  EXPECT_LT(std::sqrt(apart / moved), 1e-3);
  EXPECT_LT(10 * factored.sweeps, swept.sweeps);
}

}  // namespace
}  // namespace drench::sim_tests
