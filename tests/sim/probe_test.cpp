// Probes against statics, momentum and energy.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/probed.h"
#include "tests/sim/support.h"
#include "tests/temporary_folder.h"

namespace drench::sim_tests {
namespace {

constexpr double g = 9.81;

struct Pool {
  double depth;  // m
  int layers;
};
class RestingPool : public testing::TestWithParam<Pool> {};

std::string pool_text(const Pool& pool) {
  const double a = pool.depth / pool.layers, side = 12 * a, half = side / 2;
  return fmt::format(R"(
[shot]
frames = [1, 51]
fps = 20
[domain]
min = [0, 0, 0]
max = [{1}, {2}, {1}]
[fluid]
spacing = {0}
tolerance = 1e-5
[[fluid.box]]
min = [0, 0, 0]
max = [{1}, {3}, {1}]
[[probe]]
type = "pressure"
name = "floor"
position = [{4}, 0, {4}]
radius = {4}
[[probe]]
type = "pressure"
name = "side"
position = [0, {5}, {4}]
normal = [1, 0, 0]
radius = {6}
[[probe]]
type = "pressure"
name = "inside"
position = [{4}, {7}, {4}]
normal = [1, 1, 0]
radius = {6}
[[probe]]
type = "force"
name = "weight"
[[probe]]
type = "height"
name = "gauge"
position = [{4}, 0, {4}]
[[probe]]
type = "height"
name = "edge"
position = [0, 0, {4}]
[[probe]]
type = "volume"
name = "volume"
)",
                     a, side, 2 * pool.depth, pool.depth, half, pool.depth / 2, 3 * a,
                     0.6 * pool.depth);
}

// p = rho g (H - y), and the floor bears the weight of the water.
TEST_P(RestingPool, HasTheLinearPressureItsWeightAndItsHeight) {
  const Pool pool = GetParam();
  Probed run(pool_text(pool));
  run.run_to(51);
  const double a = pool.depth / pool.layers, since = 1.25, whole = 1000 * g * pool.depth;
  const double floor = run.mean("floor", "pressure [Pa]", since) / whole,
               side = run.mean("side", "pressure [Pa]", since) / whole,
               inside = run.mean("inside", "pressure [Pa]", since) / whole,
               weight = run.mean("weight", "force y [N]", since) / (whole * 144 * a * a),
               height = run.mean("gauge", "height [m]", since),
               edge = run.mean("edge", "height [m]", since),
               centre = run.mean("volume", "centre of mass y [m]", since);
  RecordProperty("figures", fmt::format("floor {:.4f} side {:.4f} inside {:.4f} weight {:.5f} "
                                        "height {:.5f} edge {:.5f} centre {:.5f}",
                                        floor, side, inside, weight, height / pool.depth,
                                        edge / pool.depth, 2 * centre / pool.depth));
  EXPECT_NEAR(floor, 1, 0.03);
  EXPECT_NEAR(side, 0.5, 0.02);
  EXPECT_NEAR(inside, 0.4, 0.02);
  EXPECT_NEAR(weight, -1, 0.005);
  // The column is twice as high as its centre of mass.
  EXPECT_NEAR(height, 2 * centre, 0.1 * a);
  EXPECT_NEAR(edge, 2 * centre, 0.35 * a);
  EXPECT_NEAR(run.columns("volume").at("volume [m^3]").back(), 144 * a * a * pool.depth, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Depths, RestingPool,
                         testing::Values(Pool{0.1, 10}, Pool{0.2, 10}, Pool{0.2, 14}, Pool{0.2, 20},
                                         Pool{0.3, 15}),
                         [](const auto& p) {
                           return fmt::format("{:.0f}cm{}layers", 100 * p.param.depth,
                                              p.param.layers);
                         });

/// Queries for the force on all six walls.
std::vector<sim::ProbeQuery> six_walls() {
  std::vector<sim::ProbeQuery> walls(6);
  for (int k = 0; k < 6; ++k) {
    walls[size_t(k)].kind = sim::ProbeKind::wall_force;
    walls[size_t(k)].axis = k / 2, walls[size_t(k)].side = k % 2;
  }
  return walls;
}

V3d sum_of(const std::vector<std::vector<double>>& forces) {
  V3d sum(0);
  for (const auto& force : forces) sum += V3d(force[0], force[1], force[2]);
  return sum;
}

class WallForces : public testing::TestWithParam<FluidSolver> {};

// A viscous block falls into a narrow tank and sloshes: what its momentum lacks of gravity's
// impulse the walls got, step by step. When it hits the floor and walls, some particles are stopped
// by the last tenth of a spacing (collision_rounds.h), which is no force of the solver's: of the
// incompressible solver's impulse that is 0.5 %.
TEST_P(WallForces, AreWhatTheMomentumOfTheFluidLacks) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -g, 0);
  shot.domain.min = V3d(0), shot.domain.max = V3d(0.2, 0.4, 0.06);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  shot.fluid.solver = GetParam();
  shot.fluid.kinematic_viscosity = 1e-3;
  shot.domain.slip = Slip::free;  // what holds the fluid along a wall is not in the probe
  add_box(shot, V3d(0, 0.01, 0), {10, 12, 6}, V3d(0.5, 0, 0));
  Stepper run(shot);
  const bool incompressible = run.scene.parameters.incompressible;
  const double mass = run.scene.parameters.particle_mass * run.solver->particles();
  const std::vector<sim::ProbeQuery> walls = six_walls();
  double worst = 0, largest = 0;
  V3d before = total_momentum(run.scene, run.scene.start), missing(0), impulse(0);
  while (run.time < (incompressible ? 0.4 : 0.05)) {
    const double time = run.time;
    run.step();
    const double dt = run.time - time;
    const V3d force = sum_of(run.solver->probe(walls));
    const V3d after = total_momentum(run.scene, run.solver->save());
    const V3d lack = before + V3d(0, -g, 0) * (mass * dt) - after - force * dt;
    missing += lack, impulse += force * dt, before = after;
    if (run.time < 0.05) worst = std::max(worst, lack.length() / (mass * g * dt));
    largest = std::max(largest, force.length() / (mass * g));
  }
  EXPECT_GT(largest, 1);  // an impact was among them
  EXPECT_LT(worst, 1e-5);
  EXPECT_LT(missing.length(), (incompressible ? 0.01 : 1e-5) * impulse.length());
}

INSTANTIATE_TEST_SUITE_P(Solvers, WallForces,
                         testing::Values(FluidSolver::incompressible,
                                         FluidSolver::weakly_compressible),
                         [](const auto& p) {
                           return p.param == FluidSolver::incompressible ? "Incompressible"
                                                                         : "WeaklyCompressible";
                         });

// A ball held in a pool at rest: what its probe reads is the weight that it displaces.
TEST(ObstacleForce, OfASubmergedBallIsTheWeightItDisplaces) {
  Probed run(R"(
[shot]
frames = [1, 25]
fps = 50
[domain]
min = [0, 0, 0]
max = [0.2, 0.4, 0.2]
[fluid]
spacing = 0.01
[[fluid.box]]
min = [0, 0, 0]
max = [0.2, 0.24, 0.2]
[[obstacle]]
type = "sphere"
name = "ball"
position = [0.1, 0.11, 0.1]
radius = 0.05
[[probe]]
type = "force"
name = "lift"
target = "ball"
)");
  run.run_to(25);
  const double weight = 1000 * g * 4 / 3 * M_PI * 0.05 * 0.05 * 0.05;
  EXPECT_NEAR(run.mean("lift", "force y [N]", 0.25) / weight, 1, 0.08);
  EXPECT_NEAR(run.mean("lift", "force x [N]", 0.25) / weight, 0, 0.08);
}

// Without gravity and walls the only force on a block is the sheet's, but for what vertices that
// had to be stopped (continuous_collision.h) give to the particles themselves.
TEST(ClothForce, IsWhatTheMomentumOfTheFluidLacks) {
  Shot shot = empty_shot();
  add_box(shot, V3d(-0.04, 0.02, -0.04), {8, 8, 8}, V3d(0.3, -1, 0));
  pin_edges(add_sheet(shot, 0.3, 0, 20));
  Stepper run(shot);
  sim::ProbeQuery query;
  query.kind = sim::ProbeKind::cloth_force, query.end = run.scene.cloth.vertices();
  const double mass = run.scene.parameters.particle_mass * run.solver->particles();
  V3d impulse(0);
  while (run.time < 0.1) {
    const double time = run.time;
    run.step();
    impulse += sum_of(run.solver->probe({query})) * (run.time - time);
  }
  const sim::HostState state = run.solver->save();
  V3d momentum(0);
  for (size_t i = 0; i < state.id.size(); ++i) {
    momentum += at(state.velocity, i) * double(run.scene.parameters.particle_mass);
    momentum -= at(state.owed, i);  // the sheet's, from the next step on
  }
  const V3d lost = V3d(0.3, -1, 0) * mass - momentum;
  EXPECT_GT(lost.length(), 0.3 * mass);
  RecordProperty("figures", fmt::format("{:.2e}", (lost - impulse).length() / lost.length()));
  EXPECT_LT((lost - impulse).length(), 0.01 * lost.length());
}

// Symplectic Euler falls a little too far: m g^2 dt^2 / 2 a step are missing.
TEST(EnergyProbe, OfFreeFallIsKept) {
  Probed run(R"(
[shot]
frames = [1, 11]
fps = 50
[domain]
min = [-1, 0.5, -1]
max = [1, 4, 1]
[fluid]
spacing = 0.02
[[fluid.sphere]]
center = [0, 3, 0]
radius = 0.1
[[probe]]
type = "energy"
[[probe]]
type = "volume"
)");
  run.run_to(11);
  const Columns energy = run.columns("probe");
  const std::vector<double>&time = energy.at("time [s]"), &total = energy.at("total [J]");
  const double mass = 1000 * run.columns("probe2").at("volume [m^3]").front();
  EXPECT_NEAR(total.front(), mass * g * 2.5, 1e-4 * total.front());  // above the floor at 0.5 m
  double lost = 0;
  for (size_t k = 1; k < time.size(); ++k) {
    lost += 0.5 * mass * g * g * std::pow(time[k] - time[k - 1], 2);
    EXPECT_NEAR(total[k], total.front() - lost, 1e-5 * total.front());
  }
  EXPECT_NEAR(energy.at("kinetic [J]").back(), 0.5 * mass * std::pow(0.2 * g, 2), 1e-3 * mass);
}

constexpr const char* hanging = R"(
[shot]
frames = [1, {0}]
fps = 50
[domain]
min = [-1, 0, -1]
max = [1, 2, 1]
[[cloth]]
name = "sheet"
corner = [-0.2, 1.5, 0]
u = [0.4, 0, 0]
v = [0, -0.5, 0]
cells = [8, 10]
pins = "edge_v0"
areal_density = 2
adjacent_stiffness = 2000
diagonal_stiffness = 0
damping = {1}
spring_damping = {2}
[[probe]]
type = "tip"
name = "tip"
cloth = "sheet"
position = [0.01, 1, 0]
[[probe]]
type = "tip"
name = "pin"
cloth = "sheet"
vertex = 0
[[probe]]
type = "energy"
name = "energy"
)";

// A chain of springs hangs w L / (2 k) longer; where it is pinned it stays.
TEST(TipProbe, OfAHangingSheetFindsItsStretch) {
  Probed run(fmt::format(hanging, 101, 20, 0.1));
  run.run_to(101);
  const Columns tip = run.columns("tip"), pin = run.columns("pin");
  const double stretch = 2 * g * 0.5 * 0.5 / (2 * 2000);
  EXPECT_NEAR(tip.at("displacement y [m]").back(), -stretch, 0.005 * stretch);
  EXPECT_EQ(tip.at("displacement y [m]").front(), 0);
  for (const auto& [name, values] : pin) {
    for (const double value : values) EXPECT_EQ(value == 0 || name == "time [s]", true) << name;
  }
}

// Undamped, weight and springs exchange energy; none is lost but for the order of the step.
TEST(EnergyProbe, OfAnUndampedSheetIsKept) {
  Probed run(fmt::format(hanging, 21, 0, 0));
  run.run_to(21);
  const Columns energy = run.columns("energy");
  const std::vector<double>&total = energy.at("total [J]"), &elastic = energy.at("elastic [J]");
  const double stored = *std::max_element(elastic.begin(), elastic.end());
  const auto [least, most] = std::minmax_element(total.begin(), total.end());
  RecordProperty("figures",
                 fmt::format("stored {:.4e} J, spread {:.3f}", stored, (*most - *least) / stored));
  EXPECT_LT(elastic.front(), 1e-6 * stored);  // the grid, rounded
  EXPECT_LT(*most - *least, 0.05 * stored);
}

// For 20,000 steps a sheet that was dropped from level swings, its energy passing to ever shorter
// waves: the sum drifts by less than 0.2 % of the swing in 1,000 steps.
TEST(EnergyProbe, OfASwingingSheetDriftsLittle) {
  constexpr int seconds = 20;
  Probed run(fmt::format(R"(
[shot]
frames = [1, {}]
fps = 50
[domain]
min = [-1, 0, -1]
max = [1, 2, 1]
[[cloth]]
name = "sheet"
corner = [-0.2, 1.5, 0]
u = [0.4, 0, 0]
v = [0, 0, 0.5]
cells = [8, 10]
pins = "edge_v0"
areal_density = 2
adjacent_stiffness = 2000
diagonal_stiffness = 200
damping = 0
spring_damping = 0
[[probe]]
type = "energy"
)",
                         50 * seconds + 1));
  run.run_to(50 * seconds + 1);
  const Columns energy = run.columns("probe");
  const std::vector<double>&total = energy.at("total [J]"), &kinetic = energy.at("kinetic [J]");
  const double swing = *std::max_element(kinetic.begin(), kinetic.end());
  const double drift = (run.mean("probe", "total [J]", seconds - 2) - total.front()) / swing;
  const double thousands = double(total.size() - 1) / 1000;
  RecordProperty("figures", fmt::format("{:.5f} of the swing, {:.3f} J, in 1000 of {} steps",
                                        drift / thousands, swing, total.size() - 1));
  EXPECT_GT(thousands, 10);
  EXPECT_LT(std::abs(drift) / thousands, 2e-3);
}

std::string splash(const char* solver, double window) {
  return fmt::format(R"(
[shot]
frames = [1, 9]
fps = 100
preroll = 0.013
[domain]
min = [0, 0, 0]
max = [0.1, 0.3, 0.1]
[fluid]
spacing = 0.01
solver = "{}"
sound_speed = 40
[[fluid.box]]
min = [0, 0.01, 0]
max = [0.1, 0.08, 0.1]
[[probe]]
type = "pressure"
name = "floor"
position = [0.05, 0, 0.05]
radius = 0.02
window = {}
[[probe]]
type = "force"
name = "wall"
target = "x_high"
window = {}
)",
                     solver, window, window);
}

/// Integral of a step function, linear between its rows.
double integral_to(const std::vector<double>& time, const std::vector<double>& value, double t) {
  double sum = 0;
  for (size_t k = 1; k < time.size() && time[k - 1] < t; ++k)
    sum += value[k] * (std::min(time[k], t) - time[k - 1]);
  return sum;
}

// (I(t) - I(t - w)) / w with I the integral of the values over time, and over what there is at
// first.
TEST(ProbeWindow, MeansAreOverExactlyTheWindow) {
  for (const double window : {1e-3, 3.3e-3}) {
    Probed run(splash("weakly_compressible", window));
    run.run_to(9);
    const Columns floor = run.columns("floor");
    const std::vector<double>&time = floor.at("time [s]"), &value = floor.at("pressure [Pa]"),
          &mean = floor.at("mean pressure [Pa]");
    ASSERT_LT(time[20] - time[19], window / 2);
    EXPECT_TRUE(std::isnan(value[0]));
    double worst = 0, changed = 0;
    for (size_t k = 1; k < time.size(); ++k) {
      const double from = std::max(time[k] - window, time[0]);
      const double expected =
          (integral_to(time, value, time[k]) - integral_to(time, value, from)) / (time[k] - from);
      worst = std::max(worst, std::abs(mean[k] - expected));
      changed = std::max(changed, std::abs(mean[k] - value[k]));
    }
    EXPECT_LT(worst, 1e-3);  // Pa: nine digits of 1e5 Pa and of the times
    EXPECT_GT(changed, 100);
  }
}

// A step longer than the window is its own mean.
TEST(ProbeWindow, OfLongStepsIsTheStep) {
  Probed run(splash("incompressible", 1e-4));
  run.run_to(9);
  const Columns wall = run.columns("wall");
  const std::vector<double>&value = wall.at("force x [N]"), &mean = wall.at("mean force x [N]");
  for (size_t k = 1; k < value.size(); ++k) EXPECT_EQ(value[k], mean[k]);
  EXPECT_GT(*std::max_element(value.begin() + 1, value.end()), 0);
}

// The rows are part of the state: those of a run that was resumed are the same bytes.
TEST(ProbeSeries, ContinuesFromACheckpoint) {
  for (const char* solver : {"incompressible", "weakly_compressible"}) {
    const test::TemporaryFolder folder;
    Probed whole(splash(solver, 5e-3)), first(splash(solver, 5e-3)), second(splash(solver, 5e-3));
    first.run_to(5).simulator.write_checkpoint(folder / "a.ckpt");
    second.simulator.read_checkpoint(folder / "a.ckpt");
    whole.run_to(9), second.run_to(9);
    EXPECT_EQ(whole.csv("floor"), second.csv("floor"));
    EXPECT_EQ(whole.csv("wall"), second.csv("wall"));
    EXPECT_EQ(whole.columns("wall").at("time [s]").front(), -0.013);  // the pre-roll is in it
  }
}

// A dry line has no height; a second surface under the first is not seen.
TEST(HeightProbe, IsEmptyWhereItIsDryAndFindsTheTopmostSurface) {
  Probed run(R"(
[shot]
gravity = [0, 0, 0]
[domain]
min = [0, 0, 0]
max = [1, 1, 1]
[fluid]
spacing = 0.02
[[fluid.box]]
min = [0, 0, 0]
max = [0.4, 0.1, 0.4]
[[fluid.box]]
min = [0.2, 0.6, 0.2]
max = [0.4, 0.7, 0.4]
[[fluid.box]]
min = [0.28, 0.9, 0.28]
max = [0.3, 0.92, 0.3]
[[probe]]
type = "height"
name = "dry"
position = [0.8, 0, 0.8]
[[probe]]
type = "height"
name = "low"
position = [0.1, 0, 0.1]
[[probe]]
type = "height"
name = "corner"
[[probe]]
type = "height"
name = "high"
position = [0.3, 0, 0.3]
)");
  EXPECT_TRUE(std::isnan(run.columns("dry").at("height [m]").front()));
  EXPECT_NEAR(run.columns("low").at("height [m]").front(), 0.1, 1e-3);
  EXPECT_NEAR(run.columns("corner").at("height [m]").front(), 0.1, 2e-3);
  // The single particle at 0.91 m is spray.
  EXPECT_NEAR(run.columns("high").at("height [m]").front(), 0.7, 1e-3);
}

// Moved by whole spacings, the fluid gives the same forces and the height moves with it.
TEST(Probes, AreInWorldCoordinates) {
  const auto run_at = [](double x, double y) {
    Probed run(fmt::format(R"(
[shot]
frames = [1, 3]
fps = 50
[domain]
min = [{0}, {1}, 0]
max = [{2}, {3}, 0.125]
[fluid]
spacing = 0.015625
[[fluid.box]]
min = [{0}, {1}, 0]
max = [{4}, {5}, 0.125]
[[probe]]
type = "height"
name = "gauge"
position = [{6}, 0, 0.0625]
[[probe]]
type = "force"
name = "floor"
)",
                           x, y, x + 0.25, y + 0.5, x + 0.125, y + 0.125, x + 0.0625));
    run.run_to(3);
    return std::pair(run.columns("gauge").at("height [m]"), run.columns("floor").at("force y [N]"));
  };
  const auto here = run_at(0, 0), there = run_at(5, -2);
  ASSERT_EQ(here.first.size(), there.first.size());
  for (size_t k = 0; k < here.first.size(); ++k) {
    EXPECT_NEAR(here.first[k] - 2, there.first[k], 1e-8);
    if (k > 0) {
      EXPECT_EQ(here.second[k], there.second[k]);
    }
  }
}

}  // namespace
}  // namespace drench::sim_tests
