#include "tests/validation/lobovsky.h"

#include <algorithm>
#include <cmath>

#include "tests/sim/probed.h"
#include "tests/sim/support.h"

namespace drench::validation {

namespace {

constexpr double depth = 0.3, g = 9.81;  // m, m/s^2

struct Signal {
  std::vector<double> time, pressure;  // T, P

  double first_past(double level) const {
    size_t k = 1;
    while (k + 1 < time.size() && !(pressure[k] > level)) ++k;
    const double share = (level - pressure[k - 1]) / (pressure[k] - pressure[k - 1]);
    return time[k - 1] + share * (time[k] - time[k - 1]);
  }
  double peak() const { return *std::max_element(pressure.begin(), pressure.end()); }
  double mean(double from, double to) const {
    double sum = 0, length = 0;
    for (size_t k = 1; k < time.size(); ++k) {
      if (time[k - 1] < from || time[k] > to) continue;
      sum += 0.5 * (pressure[k] + pressure[k - 1]) * (time[k] - time[k - 1]);
      length += time[k] - time[k - 1];
    }
    return sum / length;
  }
};

Signal measured() {
  Signal signal;
  const auto rows = sim_tests::read_validation("dambreak_lobovsky_H300_pressure_p1.csv");
  for (size_t k = 1; k < rows.size(); ++k) {
    signal.time.push_back(std::stod(rows[k][0]));
    signal.pressure.push_back(std::stod(rows[k][1]));
  }
  return signal;
}

/// Of Ritter's wave (1892) where the wall stands: depth and speed head, (2 + (x / T)^2) / 3 in
/// units of H, which is what the foot of the wall feels of a stream without friction. The
/// reservoir's end tells on it from T = 6 on.
double mean_head_at_wall(double from, double to) {
  constexpr double x = (1.61 - 0.6) / depth;  // from the gate
  return (2 + x * x / (from * to)) / 3;
}

std::string shot_text(int across, double tolerance) {
  const double a = depth / across;
  return fmt::format(R"(
[shot]
frames = [1, 123]
fps = 100
[domain]
min = [0, 0, 0]
max = [1.61, 0.9, {1}]
z = "periodic"
[fluid]
spacing = {0}
tolerance = {2}
rest_density = 997
[[fluid.box]]
min = [0, 0, 0]
max = [0.6, {3}, {1}]
[[probe]]
type = "pressure"
name = "p1"
position = [1.61, 0.003, {4}]
normal = [1, 0, 0]
radius = 0.0021
)",
                     a, 5 * a, tolerance, depth, 2.5 * a);
}

}  // namespace

Impact lobovsky(int across, double tolerance) {
  sim_tests::Probed run(shot_text(across, tolerance));
  run.run_to(run.shot.timeline.last);
  const sim_tests::Columns p1 = run.columns("p1");
  Signal signal;
  for (const double t : p1.at("time [s]")) signal.time.push_back(t * std::sqrt(g / depth));
  for (const double p : p1.at("mean pressure [Pa]"))
    signal.pressure.push_back(std::isnan(p) ? 0 : p / (997 * g * depth));
  const Signal data = measured();
  Impact impact;
  const double hit = signal.first_past(0.5), expected = data.first_past(0.5);
  impact.time = hit / expected - 1;
  impact.impulse = signal.mean(hit, hit + 0.5) / data.mean(expected, expected + 0.5) - 1;
  impact.peak = signal.peak() / data.peak() - 1;
  impact.wall = signal.mean(3.5, 5.5);
  impact.plateau = impact.wall / data.mean(3.5, 5.5) - 1;
  impact.frictionless = impact.wall / mean_head_at_wall(3.5, 5.5) - 1;
  double all = 0, across_plane = 0;
  for (const V3f& u : run.simulator.particles().velocity)
    all += u.length2(), across_plane += u.z * u.z;
  impact.thickness = across_plane / all;
  impact.particles = int(run.simulator.particles().position.size());
  return impact;
}

}  // namespace drench::validation
