#include "tests/validation/viscous.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/sim/support.h"

namespace drench::validation {

namespace {

using sim_tests::Stepper;

constexpr double g = 9.81;

double l2_error(Flow flow, double time, double width, double largest, const sim::HostState& state) {
  double sum = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    const double u = start_up_velocity(flow, time, state.position.y[i] / width);
    sum += std::pow(state.velocity.x[i] / largest - u, 2);
  }
  return std::sqrt(sum / double(state.id.size()));
}

sim::Scene channel(Flow flow, int across, double by) {
  constexpr double width = 0.1, viscosity = 1e-3, largest = viscosity / width;  // Re = 1
  constexpr int period = 6;  // particles along the walls: nearly three supports
  const double a = width / across;
  Shot shot;
  shot.name = shot.file = "channel";
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.spacing = a, shot.fluid.xsph = 0, shot.fluid.tolerance = 1e-5;
  shot.fluid.kinematic_viscosity = viscosity;
  shot.domain.min = V3d(0), shot.domain.max = V3d(period * a, width, period * a);
  shot.domain.axis = {Axis::periodic, Axis::walls, Axis::periodic};
  shot.domain.slip = Slip::none;
  shot.gravity = V3d(0);
  if (flow == Flow::couette)
    shot.domain.wall_velocity.y_high = V3d(largest, 0, 0);
  else
    shot.gravity = V3d(8 * viscosity * largest / (width * width), 0, 0);
  sim_tests::add_box(shot, V3d(0), {period, across, period});
  return shaken(shot, by);
}

}  // namespace

sim::Scene shaken(const Shot& shot, double by) {
  sim::Scene scene = sim::build_scene(shot);
  constexpr float room = 1.01f;
  sim_tests::Random random(13);
  sim::HostVec& x = scene.start.position;
  scene.parameters.high[0] *= room;
  for (float& value : x.x) value *= room;
  for (std::vector<float>* c : {&x.x, &x.y, &x.z}) {
    for (float& value : *c) value += float(2 * by * shot.fluid.spacing * (random() - 0.5));
  }
  return scene;
}

double start_up_velocity(Flow flow, double time, double y) {
  double u = flow == Flow::couette ? y : 4 * y * (1 - y);
  for (int n = 1; n <= 400; ++n) {
    const double decay = std::exp(-n * n * M_PI * M_PI * time), wave = std::sin(n * M_PI * y);
    if (flow == Flow::couette) u += 2 / (n * M_PI) * (n % 2 ? -1 : 1) * wave * decay;
    if (flow == Flow::poiseuille && n % 2) u -= 32 / std::pow(n * M_PI, 3) * wave * decay;
  }
  return u;
}

Channel start_up(Flow flow, int across, double shaken) {
  constexpr double width = 0.1, viscosity = 1e-3, unit = width * width / viscosity;  // m, m^2/s, s
  Stepper run(channel(flow, across, shaken));
  Channel result;
  result.steps = 100 * across, result.particles = run.solver->particles();
  const double dt = unit / result.steps, h = run.scene.parameters.support_radius;
  result.strength = dt * viscosity / (h * h);
  const double times[3] = {0.05, 0.2, 1};
  for (int k = 0; k < 3; ++k) {
    while (run.steps < std::lround(times[k] * result.steps)) {
      run.step(dt);
      result.iterations += double(run.limits.viscous_iterations) / result.steps;
    }
    const sim::HostState state = run.solver->save();
    result.error[k] = l2_error(flow, times[k], width, viscosity / width, state);
    result.thickness = sim_tests::energy_across(state.velocity);
  }
  return result;
}

Spreading huppert(int high) {
  constexpr double height = 0.1, viscosity = 0.01;  // m, m^2/s
  const double a = height / high, area = height * height;
  Shot shot;
  shot.name = shot.file = "huppert";
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.spacing = a, shot.fluid.kinematic_viscosity = viscosity;
  shot.domain.min = V3d(-1, 0, 0), shot.domain.max = V3d(1, 0.2, 6 * a);
  shot.domain.axis = {Axis::open, Axis::walls, Axis::periodic};
  shot.domain.slip = Slip::none;
  sim_tests::add_box(shot, V3d(-height, 0, 0), {2 * high, high, 6});
  Stepper run(shot);
  const auto front_of = [&](const sim::HostState& s) {
    const auto [low, up] = std::minmax_element(s.position.x.begin(), s.position.x.end());
    return 0.5 * (*up - *low + a);
  };
  const auto energy_of = [&](const sim::HostState& s) {
    double sum = 0;
    for (size_t i = 0; i < s.id.size(); ++i)
      sum += 0.5 * sim_tests::at(s.velocity, i).length2() + g * s.position.y[i];
    return sum;
  };
  const double rate = 1.411 * std::pow(g * std::pow(area, 3) / (3 * viscosity), 0.2);
  const double start = energy_of(run.solver->save());
  double before = start, sums[4] = {}, squares = 0;
  int count = 0;
  Spreading result;
  while (run.time < 30) {
    run.step();
    const sim::HostState state = run.solver->save();
    const double now = energy_of(state), front = front_of(state) / height;
    result.energy_gain = std::max(result.energy_gain, (now - before) / start);
    before = now;
    result.thickness = std::max(result.thickness, sim_tests::energy_across(state.velocity));
    if (front > 4.5) break;
    if (front < 2.5) continue;
    squares += std::pow(front * height / (rate * std::pow(run.time, 0.2)) - 1, 2), ++count;
    const double x = std::log(run.time), y = std::log(front);
    sums[0] += x, sums[1] += y, sums[2] += x * x, sums[3] += x * y;
  }
  result.front = std::sqrt(squares / count);
  result.exponent = (count * sums[3] - sums[0] * sums[1]) / (count * sums[2] - sums[0] * sums[0]);
  result.particles = run.solver->particles(), result.steps = run.steps;
  return result;
}

}  // namespace drench::validation
