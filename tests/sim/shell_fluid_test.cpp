// Shells that bear water, from shot files, against a closed form and a measurement
// (tests/validation/README.md).

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "pipeline/contract/shot/shot_file.h"
#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

/// m, of a vertex, since the start.
V3d moved(const Stepper& run, size_t vertex) {
  const sim::HostState state = run.solver->save();
  return at(state.cloth_position, vertex) + at(state.shell_rounding, vertex) -
         at(run.scene.start.cloth_position, vertex);
}

/// Keys of [[cloth]] of a plate of 5 mm. @param modulus  Pa
std::string elastic_keys(double modulus, double poisson) {
  const double thickness = 5e-3, membrane = modulus * thickness;
  return fmt::format(
      R"(thickness = {thickness}
young_warp = {membrane}
young_weft = {membrane}
shear_modulus = {shear}
poisson = {poisson}
bend_warp = {bend}
bend_weft = {bend}
bend_bias = {bend}
stretch_limit = 2
)",
      fmt::arg("thickness", thickness), fmt::arg("membrane", membrane),
      fmt::arg("shear", membrane / (2 * (1 + poisson))), fmt::arg("poisson", poisson),
      fmt::arg("bend", membrane * thickness * thickness / (12 * (1 - poisson * poisson))));
}

/// Fourey's plate at a tenth of its lengths and of its modulus, so that it bends by the same part
/// of its span: 0.1 m long, 5 mm thick, clamped at both ends by two rows of vertices, 0.2 m of
/// water on it. Nothing varies along z.
std::string plate_text(int across) {
  const double span = 0.1, a = span / across;
  return fmt::format(R"(
[shot]
frames = [1, 100]
[domain]
min = [{low}, -0.05, 0]
max = [{high}, 0.3, {depth}]
z = "periodic"
[fluid]
spacing = {a}
[[fluid.box]]
min = [{low}, 0.0025, 0]
max = [{high}, 0.2025, {depth}]
[[cloth]]
model = "shell"
corner = [{low}, 0, 0]
u = [{length}, 0, 0]
v = [0, 0, {depth}]
cells = [{cells}, 5]
areal_density = 13.5
{elastic}damping = 200
damping_time = 0
[[cloth.pin]]
box = {{min = [-1, -1, -1], max = [{left}, 1, 1]}}
[[cloth.pin]]
box = {{min = [{right}, -1, -1], max = [1, 1, 1]}}
)",
                     fmt::arg("low", -a), fmt::arg("high", span + a), fmt::arg("depth", 5 * a),
                     fmt::arg("a", a), fmt::arg("length", span + 2 * a),
                     fmt::arg("cells", across + 2), fmt::arg("elastic", elastic_keys(6.75e9, 0.34)),
                     fmt::arg("left", 1e-3 * a), fmt::arg("right", span - 1e-3 * a));
}

/// Deflection of the middle, mean over time of 0.2 to 0.6 s, over that of the table.
double plate_under_water(int across) {
  double exact = 0;
  for (const auto& row : read_validation("hydrostatic_plate.csv"))
    if (row[0] == "Fourey") exact = 0.1 * std::stod(row[9]);
  Stepper run(parse_shot(plate_text(across), "plate.toml"));
  const size_t middle = size_t(across) / 2 + 1;  // of the first row along u
  double sum = 0, time = 0;
  while (run.time < 0.6) {
    run.step();
    const double dt = run.limits.step;
    if (run.time > 0.2) sum -= moved(run, middle).y * dt, time += dt;
  }
  return sum / time / exact;
}

// Errors at 6, 10, 20 spacings across, %: 23, 8, 4.5 (to 0.4 s, and by rounding of the start, 2.5
// to 5.5); of plates as heavy without water, at 10, 20, 40 cells: 8, 2, 0.5. With steps of one
// length it is 1 at 20: the pressure comes and goes from step to step, and the steps with it.
TEST(ShellInWater, APlateUnderWaterSagsAsItsClosedForm) {
  EXPECT_NEAR(plate_under_water(6), 1, 0.3);
  EXPECT_NEAR(plate_under_water(10), 1, 0.12);
  EXPECT_NEAR(plate_under_water(20), 1, 0.05);
}

struct Measured {
  std::vector<double> time, value;  // s, m
  explicit Measured(const char* file) : time{0}, value{0} {
    for (const auto& row : read_validation(file)) {
      if (row[0] == "t_s" || std::stod(row[0]) <= 0) continue;
      time.push_back(std::stod(row[0])), value.push_back(std::stod(row[1]));
    }
  }
  double at(double t) const {
    const size_t k = size_t(std::upper_bound(time.begin(), time.end(), t) - time.begin());
    const double part = (t - time[k - 1]) / (time[k] - time[k - 1]);
    return value[k - 1] + part * (value[k] - value[k - 1]);
  }
};

/// The elastic gate of Antoci, Gallati and Sibilla 2007: rubber of 79 by 5 mm, clamped at its top,
/// 0.1 by 0.14 m of water behind it. The modulus is the one that simulations with linear rubber
/// use, 7.8 MPa; nominally it is 10 to 12.
std::string gate_text(double a) {
  return fmt::format(R"(
[shot]
frames = [1, 100]
[domain]
min = [0, 0, 0]
max = [0.45, 0.3, {depth}]
z = "periodic"
[fluid]
spacing = {a}
[[fluid.box]]
min = [0, 0, 0]
max = [0.1, 0.14, {depth}]
[[cloth]]
model = "shell"
corner = [0.1025, 0.001, 0]
u = [0, 0.16, 0]
v = [0, 0, {depth}]
cells = [{cells}, 6]
areal_density = 5.5
{elastic}damping = 0
damping_time = 0
[[cloth.pin]]
box = {{min = [0.1, 0.0799, -0.1], max = [0.11, 0.3, 1]}}
)",
                     fmt::arg("depth", 6 * a), fmt::arg("a", a),
                     fmt::arg("cells", int(std::lround(0.16 / a))),
                     fmt::arg("elastic", elastic_keys(7.8e6, 0.4)));
}

struct Opened {
  double x = 0, y = 0;             // RMS error of the tip over 0.3 s / 46.4 mm
  double most = 0, most_time = 0;  // m, s: of x
};
Opened opened_gate(double a) {
  const Measured x("elastic_gate_antoci_2007_experiment_x.csv"),
      y("elastic_gate_antoci_2007_experiment_y.csv");
  Stepper run(parse_shot(gate_text(a), "gate.toml"));
  Opened found;
  while (run.time < 0.3) {
    run.step();
    if (run.limits.bad_particle + run.limits.bad_vertex > -2) return {1e9, 1e9, 0, 0};
    const V3d tip = moved(run, 0);
    const double dt = run.limits.step / 0.3;
    found.x += dt * std::pow((tip.x - x.at(run.time)) / 0.0464, 2);
    found.y += dt * std::pow((tip.y - y.at(run.time)) / 0.0464, 2);
    if (tip.x > found.most) found.most = tip.x, found.most_time = run.time;
  }
  found.x = std::sqrt(found.x), found.y = std::sqrt(found.y);
  return found;
}

// At spacings of 8, 5 and 3.5 mm, RMS of x and y in %: 16 and 9, 11 and 6, 12 and 7; the most is 45
// mm at 0.13 s, measured 46.4 mm at 0.16 s. Spacings a thousandth apart differ by as much as 2 % of
// x. The measured gate stays open where this one follows the water as it sinks, as linear sheets
// without leaks at their sides do; of 10 MPa x is 18 % off.
TEST(ShellInWater, AGateOpensAsMeasured) {
  Opened coarse;
  for (const double a : {7.97e-3, 7.99e-3, 8e-3, 8.01e-3, 8.03e-3}) {
    const Opened one = opened_gate(a);
    coarse.x += one.x / 5, coarse.y += one.y / 5;
  }
  const Opened fine = opened_gate(5e-3);
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
