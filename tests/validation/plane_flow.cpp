#include "tests/validation/plane_flow.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/sim/support.h"

namespace drench::validation {

namespace {

using sim_tests::Stepper;

constexpr int thick = 5;  // particles along z: just over two supports
constexpr double pi = 3.14159265358979323846;

Shot plane_shot(double spacing, double tolerance) {
  Shot shot;
  shot.name = shot.file = "validation";
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.spacing = spacing, shot.fluid.tolerance = tolerance;
  shot.fluid.xsph = 0, shot.fluid.kinematic_viscosity = 0;
  shot.domain.axis[2] = Axis::periodic;
  shot.domain.min = V3d(0), shot.domain.max = V3d(1, 1, thick * spacing);
  return shot;
}

/// Gives every particle the velocity of the field at its place, world coordinates.
void set_velocities(sim::Scene& scene, const std::function<V3d(const V3d&)>& field) {
  sim::HostState& s = scene.start;
  for (size_t i = 0; i < s.id.size(); ++i) {
    const V3d u = field(V3d(scene.frame.to_world(0, s.position.x[i]),
                            scene.frame.to_world(1, s.position.y[i]),
                            scene.frame.to_world(2, s.position.z[i])));
    s.velocity.x[i] = float(u.x), s.velocity.y[i] = float(u.y), s.velocity.z[i] = float(u.z);
  }
}

/// Breaks the lattice, which resists shear, into a packing of even density without order: particles
/// shaken by up to half a spacing, and steps that forget all speed.
void settle(sim::Scene& scene) {
  sim_tests::Random random(5);
  const double a = scene.parameters.spacing;
  sim::HostVec& x = scene.start.position;
  for (size_t i = 0; i < x.size(); ++i) {
    const auto shaken = [&](int axis, float place) {
      return scene.place(axis, scene.frame.to_world(axis, place) + a * (random() - 0.5));
    };
    x.x[i] = shaken(0, x.x[i]), x.y[i] = shaken(1, x.y[i]), x.z[i] = shaken(2, x.z[i]);
  }
  Stepper run(scene);
  for (int k = 0; k < 100; ++k) {
    run.step(0.08 * std::sqrt(a / 9.81));
    sim::HostState state = run.solver->save();
    state.velocity = sim::HostVec{};
    state.velocity.resize(state.id.size());
    run.solver->load(state);
  }
  scene.start = run.solver->save();
}

/// m^2/s^2, summed over the particles
double energy_of(const sim::HostState& s) {
  double sum = 0;
  for (size_t i = 0; i < s.id.size(); ++i) sum += 0.5 * sim_tests::at(s.velocity, i).length2();
  return sum;
}

/// Slope of a straight line through points of equal weight.
double slope_of(const std::vector<double>& x, const std::vector<double>& y) {
  double mx = 0, my = 0, xy = 0, xx = 0;
  for (size_t k = 0; k < x.size(); ++k)
    mx += x[k] / double(x.size()), my += y[k] / double(x.size());
  for (size_t k = 0; k < x.size(); ++k)
    xy += (x[k] - mx) * (y[k] - my), xx += (x[k] - mx) * (x[k] - mx);
  return xy / xx;
}

/// Energy that the friction of all pairs takes from a fluid of nu = 1 in a second over twice its
/// kinetic energy, 1/s, in double: half the sum of c (x . v)^2 (viscosity_rows.h), all axes
/// periodic, the third less than three supports.
double pair_friction(const sim::Scene& scene, const sim::HostState& s) {
  const double h = scene.parameters.support_radius;
  const double volume = scene.parameters.particle_mass / scene.parameters.rest_density;
  double low[3], length[3];
  for (int k = 0; k < 3; ++k)
    low[k] = scene.parameters.low[k], length[k] = scene.parameters.high[k] - low[k];
  const int cells = int(length[0] / h);
  const auto cell_of = [&](double x, int k) {
    const double share = (x - low[k]) / length[k];
    return std::min(int((share - std::floor(share)) * cells), cells - 1);
  };
  std::vector<std::vector<size_t>> cell(size_t(cells * cells));
  const auto at = [&](int x, int y) -> std::vector<size_t>& {
    return cell[size_t((y + cells) % cells * cells + (x + cells) % cells)];
  };
  for (size_t i = 0; i < s.id.size(); ++i)
    at(cell_of(s.position.x[i], 0), cell_of(s.position.y[i], 1)).push_back(i);
  double taken = 0, squares = 0;
  const auto add = [&](size_t i, size_t j) {
    V3d d = sim_tests::at(s.position, i) - sim_tests::at(s.position, j);
    for (int k = 0; k < 3; ++k) d[k] -= length[k] * std::round(d[k] / length[k]);
    const double u = 1 - d.length() / h,
                 along = d.dot(sim_tests::at(s.velocity, i) - sim_tests::at(s.velocity, j));
    if (u > 0) taken += 0.5 * u * u * u * along * along;
  };
  for (size_t i = 0; i < s.id.size(); ++i) {
    const int x = cell_of(s.position.x[i], 0), y = cell_of(s.position.y[i], 1);
    for (int v = y - 1; v <= y + 1; ++v)
      for (int u = x - 1; u <= x + 1; ++u)
        for (const size_t j : at(u, v)) add(i, j);
    squares += sim_tests::at(s.velocity, i).length2();
  }
  return taken * 6300 / pi * volume / std::pow(h, 7) / squares;
}

double column_at(const std::vector<std::vector<std::string>>& rows, size_t column, double t) {
  for (size_t k = 2; k < rows.size(); ++k) {
    const double before = std::stod(rows[k - 1][0]), after = std::stod(rows[k][0]);
    if (t > after) continue;
    const double share = (t - before) / (after - before);
    return (1 - share) * std::stod(rows[k - 1][column]) + share * std::stod(rows[k][column]);
  }
  return std::stod(rows.back()[column]);
}

/// The period of standing_wave.csv in 1 m for a depth and a mode.
double period_of(double depth, int mode) {
  for (const auto& row : sim_tests::read_validation("standing_wave.csv")) {
    if (row[1] == std::to_string(mode) && std::stod(row[0]) == depth) return std::stod(row[4]);
  }
  throw std::runtime_error("standing_wave.csv has no such row");
}

}  // namespace

StandingWave standing_wave(int layers, double tolerance, double periods) {
  constexpr double depth = 0.5, k = 2 * pi, height = 0.02 * depth;
  const double period = period_of(depth, 2), omega = 2 * pi / period, a = depth / layers;
  Shot shot = plane_shot(a, tolerance);
  shot.domain.axis[0] = Axis::periodic;
  sim_tests::add_box(shot, V3d(0), {2 * layers, layers, thick});
  sim::Scene scene = sim::build_scene(shot);
  settle(scene);
  set_velocities(scene, [&](const V3d& p) {
    const double speed = height * omega / std::sinh(k * depth);
    return V3d(-speed * std::cosh(k * p.y) * std::sin(k * p.x),
               speed * std::sinh(k * p.y) * std::cos(k * p.x), 0);
  });
  Stepper run(scene);
  // The surface's first mode is that of the fluid below it: int eta cos kx = int int cos kx.
  const auto elevation = [&] {
    const sim::HostState s = run.solver->save();
    double sum = 0;
    for (const float x : s.position.x) sum += std::cos(k * x);
    return 2 * a * a * sum / thick;
  };
  std::vector<double> number{0}, crossing{0}, peak{0};
  double before = 0, time = 0;
  while (run.time < (periods + 0.1) * period) {
    run.step();
    const double now = elevation();
    if (before * now < 0) {
      crossing.push_back(time + (run.time - time) * before / (before - now));
      number.push_back(double(number.size())), peak.push_back(0);
    }
    peak.back() = std::max(peak.back(), std::abs(now));
    before = now, time = run.time;
  }
  StandingWave wave;
  wave.period = slope_of(number, crossing) * 2 / period - 1;
  const size_t halves = size_t(2 * periods);
  wave.amplitude = (peak[halves - 2] + peak[halves - 1]) / (peak[0] + peak[1]);
  wave.thickness = sim_tests::energy_across(run.solver->save().velocity),
  wave.particles = run.solver->particles();
  return wave;
}

EllipticalDrop elliptical_drop(int across, double tolerance, double seconds) {
  const double a = 1.0 / across;
  Shot shot = plane_shot(a, tolerance);
  shot.gravity = V3d(0);
  shot.domain.axis[0] = shot.domain.axis[1] = Axis::open;
  shot.domain.min = V3d(-4, -4, 0), shot.domain.max = V3d(4, 4, thick * a);
  sim_tests::add_box(shot, V3d(-1, -1, 0), {2 * across, 2 * across, thick});
  sim::Scene scene = sim::build_scene(shot);
  sim::HostState disc;
  for (size_t i = 0; i < scene.start.id.size(); ++i) {
    const sim::HostVec& p = scene.start.position;
    const double x = scene.frame.to_world(0, p.x[i]), y = scene.frame.to_world(1, p.y[i]);
    if (x * x + y * y > 1) continue;
    disc.position.push(p.x[i], p.y[i], p.z[i]);
    disc.velocity.push(0, 0, 0);
    disc.id.push_back(int(disc.id.size()));
  }
  scene.start = disc;
  settle(scene);
  set_velocities(scene, [](const V3d& p) { return V3d(-p.x, p.y, 0); });
  Stepper run(scene);
  const auto half_axes = [&] {
    const sim::HostState s = run.solver->save();
    const V3d centre = sim_tests::centre_of_mass(s);
    V3d sum(0);
    for (size_t i = 0; i < s.id.size(); ++i) {
      const V3d d = sim_tests::at(s.position, i) - centre;
      sum += V3d(d.x * d.x, d.y * d.y, 0);
    }
    return V3d(2 * std::sqrt(sum.x / double(s.id.size())),
               2 * std::sqrt(sum.y / double(s.id.size())), 0);
  };
  const auto data = sim_tests::read_validation("elliptical_drop.csv");
  const V3d start = half_axes();
  const double energy = energy_of(run.solver->save());
  EllipticalDrop drop;
  for (int sample = 1; sample <= 20; ++sample) {
    run.advance(seconds * sample / 20);
    const V3d now = half_axes();
    for (int k = 0; k < 2; ++k) {  // the data's drop is a hundred times as fast
      const double expected = column_at(data, size_t(2 + k), run.time / 100);
      drop.axis = std::max(drop.axis, std::abs(now[k] / start[k] / expected - 1));
    }
    const sim::HostState s = run.solver->save();
    drop.energy = std::max(drop.energy, std::abs(energy_of(s) / energy - 1));
    drop.thickness = sim_tests::energy_across(s.velocity);
  }
  drop.particles = run.solver->particles();
  return drop;
}

TaylorGreen taylor_green(int across, double tolerance, double times) {
  const double a = 1.0 / across, nu = 0.01, rate = 8 * pi * pi * nu;
  Shot shot = plane_shot(a, tolerance);
  shot.gravity = V3d(0);
  shot.fluid.kinematic_viscosity = nu;
  shot.domain.axis[0] = shot.domain.axis[1] = Axis::periodic;
  sim_tests::add_box(shot, V3d(0), {across, across, thick});
  sim::Scene scene = sim::build_scene(shot);
  const auto vortices = [](const V3d& p) {
    const double x = 2 * pi * p.x, y = 2 * pi * p.y;
    return V3d(-std::cos(x) * std::sin(y), std::sin(x) * std::cos(y), 0);
  };
  settle(scene);
  set_velocities(scene, vortices);
  Stepper run(scene);
  const double start = energy_of(run.solver->save());
  std::vector<double> time, speed, mode;
  TaylorGreen flow;
  constexpr int kSamples = 40;
  for (int sample = 1; sample <= kSamples; ++sample) {
    const double end = times * sample / kSamples;
    while (run.time < end - 1e-12) {
      run.step((end - run.time) / std::ceil((end - run.time) / run.stable_dt() - 1e-9));
      flow.iterations += run.limits.iterations;
    }
    const sim::HostState s = run.solver->save();
    double along = 0, own = 0;
    for (size_t i = 0; i < s.id.size(); ++i) {
      const V3d u = vortices(sim_tests::at(s.position, i));
      along += u.dot(sim_tests::at(s.velocity, i)), own += u.length2();
    }
    time.push_back(run.time);
    speed.push_back(0.5 * std::log(energy_of(s) / start)), mode.push_back(std::log(along / own));
    flow.speed = std::max(flow.speed, std::abs(std::exp(speed.back() + rate * run.time) - 1));
    flow.thickness = sim_tests::energy_across(s.velocity);
    flow.friction += (pair_friction(scene, s) * nu / rate - 1) / kSamples;
  }
  flow.rate = -slope_of(time, speed) / rate - 1, flow.mode = -slope_of(time, mode) / rate - 1;
  run.solver->refresh();
  double mean = 0, square = 0;
  const std::vector<float> density = run.solver->density();
  for (const float rho : density) mean += rho / double(density.size());
  for (const float rho : density) square += std::pow(rho - mean, 2) / double(density.size());
  flow.density = std::sqrt(square) / 1000;
  flow.particles = run.solver->particles(), flow.steps = run.steps;
  return flow;
}

}  // namespace drench::validation
