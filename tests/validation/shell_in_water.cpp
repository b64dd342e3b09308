#include "tests/validation/shell_in_water.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "pipeline/contract/shot/shot_file.h"
#include "tests/sim/support.h"

namespace drench::validation {
namespace {

using sim_tests::at;
using sim_tests::read_validation;
using sim_tests::Stepper;

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

}  // namespace

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

OpenedGate opened_gate(double a) {
  const Measured x("elastic_gate_antoci_2007_experiment_x.csv"),
      y("elastic_gate_antoci_2007_experiment_y.csv");
  Stepper run(parse_shot(gate_text(a), "gate.toml"));
  OpenedGate found;
  while (run.time < 0.3) {
    run.step();
    if (run.limits.bad_particle + run.limits.bad_vertex > -2) {
      found.blew_up = true;
      return found;
    }
    const V3d tip = moved(run, 0);
    const double dt = run.limits.step / 0.3;
    found.x += dt * std::pow((tip.x - x.at(run.time)) / 0.0464, 2);
    found.y += dt * std::pow((tip.y - y.at(run.time)) / 0.0464, 2);
    if (tip.x > found.most) found.most = tip.x, found.most_time = run.time;
  }
  found.x = std::sqrt(found.x), found.y = std::sqrt(found.y);
  return found;
}

}  // namespace drench::validation
