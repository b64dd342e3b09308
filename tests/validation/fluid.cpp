#include "tests/validation/fluid.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "sim/probe_query.h"
#include "tests/sim/support.h"

namespace drench::validation {

namespace {

using sim_tests::Stepper;

constexpr double g = 9.81;

Shot tank(double spacing, const V3d& size, double tolerance) {
  Shot shot;
  shot.name = shot.file = "validation";
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.spacing = spacing, shot.fluid.tolerance = tolerance;
  shot.domain.min = V3d(0), shot.domain.max = size;
  return shot;
}

struct Series {
  std::vector<double> time, value;

  double at(double t) const {
    const size_t k = size_t(std::lower_bound(time.begin(), time.end(), t) - time.begin());
    if (k == 0) return value.front();
    if (k == time.size()) return value.back();
    const double share = (t - time[k - 1]) / (time[k] - time[k - 1]);
    return value[k - 1] + share * (value[k] - value[k - 1]);
  }
  double slope_past(double least) const {
    size_t first = 0;
    while (first + 1 < value.size() && value[first] < least) ++first;
    return (value.back() - value[first]) / std::max(time.back() - time[first], 1e-9);
  }
};

Series read_series(const std::string& name) {
  Series series;
  const auto rows = sim_tests::read_validation(name);
  for (size_t k = 1; k < rows.size(); ++k) {
    series.time.push_back(std::stod(rows[k][0])), series.value.push_back(std::stod(rows[k][1]));
  }
  return series;
}

/// RMS of `error` of run and data where the run reaches the data, `run` being late by `shift`.
template <class Error>
double rms(const Series& run, const Series& data, double shift, const Error& error) {
  double sum = 0;
  int count = 0;
  for (size_t k = 0; k < data.time.size() && data.time[k] + shift <= run.time.back(); ++k, ++count)
    sum += std::pow(error(run.at(data.time[k] + shift), data.value[k]), 2);
  return std::sqrt(sum / count);
}

/// The least RMS of the relative error of a front, and the shift in time, at most 0.3, that has it.
struct Fit {
  double error = 1e30, shift = 0;
};
Fit fit_in_time(const Series& run, const Series& data) {
  Fit best;
  for (double shift = -0.3; shift <= 0.3001; shift += 0.01) {
    const double error = rms(run, data, shift, [](double z, double d) { return z / d - 1; });
    if (error < best.error) best = {error, shift};
  }
  return best;
}

/// Mean pressure, Pa, of the particles about a height over all of the tank.
double pressure_at(Stepper& run, double height) {
  const sim::Parameters& p = run.scene.parameters;
  sim::ProbeQuery q;
  q.kind = sim::ProbeKind::inner_pressure;
  q.place[0] = 0.5f * (p.low[0] + p.high[0]), q.place[1] = p.low[1] + float(height);
  q.place[2] = 0.5f * (p.low[2] + p.high[2]);
  q.radius = p.high[0] - p.low[0] + p.high[2] - p.low[2], q.rim = p.spacing;
  q.extent = (p.high[0] - p.low[0]) * (p.high[2] - p.low[2]) * p.spacing;
  return run.solver->probe({q}).front().front();
}

/// The k-th largest of what `of` gives for the particles that it gives anything for.
double nth_largest(const sim::HostState& state, size_t k, const std::function<double(size_t)>& of) {
  std::vector<double> values;
  for (size_t i = 0; i < state.id.size(); ++i) values.push_back(of(i));
  std::nth_element(values.begin(), values.begin() + long(k), values.end(), std::greater<>());
  return values[k];
}

}  // namespace

Collapse martin_moyce(int across, double tolerance) {
  constexpr double width = 0.05715;
  constexpr int thick = 5;  // particles along z, which is periodic: just over two supports
  const double a = width / across;
  Shot shot = tank(a, V3d(7 * width, 4 * width, thick * a), tolerance);
  shot.domain.axis[2] = Axis::periodic;
  sim_tests::add_box(shot, V3d(0), {across, 2 * across, thick});
  Stepper run(shot);
  Series front, height;
  while (run.time < 3.1 / std::sqrt(g / width)) {
    run.step();
    const sim::HostState state = run.solver->save();
    // As many particles as the sheet is thick make a front; fewer are drops.
    front.time.push_back(run.time * std::sqrt(2 * g / width));
    front.value.push_back(
        (nth_largest(state, thick, [&](size_t i) { return state.position.x[i]; }) + 0.5 * a) /
        width);
    height.time.push_back(run.time * std::sqrt(g / width));
    height.value.push_back((nth_largest(state, thick,
                                        [&](size_t i) {
                                          return state.position.x[i] < 1.5 * a
                                                     ? double(state.position.y[i])
                                                     : 0.;
                                        }) +
                            0.5 * a) /
                           (2 * width));
  }
  const Series heights = read_series("dambreak_martin_moyce_height_table6.csv");
  const Fit table = fit_in_time(front, read_series("dambreak_martin_moyce_front_table2.csv"));
  Collapse result;
  result.front = table.error, result.shift = table.shift;
  for (const char* figure :
       {"dambreak_martin_moyce_front_a225.csv", "dambreak_martin_moyce_front_a1125.csv"})
    result.figures = std::max(result.figures, fit_in_time(front, read_series(figure)).error);
  result.particles = run.solver->particles();
  result.slope = front.slope_past(2);
  result.height = rms(height, heights, 0, [](double h, double d) { return h - d; });
  result.thickness = sim_tests::energy_across(run.solver->save().velocity);
  return result;
}

Rest resting_column(int layers, double seconds, double until, double tolerance) {
  constexpr double depth = 0.2;
  const double a = depth / layers;
  const int side = std::max(12, layers / 2);
  Shot shot = tank(a, V3d(side * a, 2 * depth, side * a), tolerance);
  sim_tests::add_box(shot, V3d(0), {side, layers, side});
  Stepper run(shot);
  const double start = sim_tests::centre_of_mass(run.solver->save()).y;
  run.advance(0.9 * seconds);
  Rest rest;
  std::vector<double> error(size_t(layers) - 1, 0);
  sim::HostState state;
  const int samples = 20;
  for (int sample = 1; sample <= samples; ++sample) {
    run.advance(seconds * (0.9 + 0.1 * sample / samples));
    state = run.solver->save();
    const float top = *std::max_element(state.position.y.begin(), state.position.y.end());
    for (size_t k = 0; k < error.size(); ++k) {
      const double y = double(k + 1) * a;
      error[k] += (pressure_at(run, y) - 1000 * g * (top + 0.5 * a - y)) / samples;
    }
  }
  double squares = 0, speed2 = 0, density = 0;
  int below = 0;
  for (const double e : error) squares += e * e;
  run.solver->refresh();
  const std::vector<float> rho = run.solver->density();
  for (size_t i = 0; i < state.id.size(); ++i) {
    speed2 += sim_tests::at(state.velocity, i).length2();
    const double y = state.position.y[i];
    if (y < depth - 4 * a) density += std::abs(rho[i] / 1000 - 1), ++below;
  }
  rest.pressure = std::sqrt(squares / double(error.size())) / (1000 * g * depth);
  rest.density = density / below;
  rest.drift = std::sqrt(speed2 / double(state.id.size()) / (g * depth));
  run.advance(until);
  rest.volume = sim_tests::centre_of_mass(run.solver->save()).y / start - 1;
  rest.particles = run.solver->particles();
  return rest;
}

}  // namespace drench::validation
