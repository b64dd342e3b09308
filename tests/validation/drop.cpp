#include "tests/validation/drop.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/kernels.h"
#include "tests/sim/support.h"

namespace drench::validation {

namespace {

using sim_tests::Stepper;

constexpr double sigma = 0.072, rho = 1000, R = 0.01;  // N/m, kg/m^3, m
constexpr double pi = 3.14159265358979323846;

Shot weightless(double spacing) {
  Shot shot = sim_tests::empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.spacing = spacing, shot.fluid.surface_tension = sigma;
  shot.domain.min = V3d(-10 * R), shot.domain.max = V3d(10 * R);
  return shot;
}

/// Radius of a ball of the particles' volume, m.
double radius_of(const sim::Scene& scene) {
  const double volume =
      double(scene.start.id.size()) * std::pow(double(scene.parameters.spacing), 3);
  return std::cbrt(3 * volume / (4 * pi));
}

double rayleigh(double radius) { return std::sqrt(8 * sigma / (rho * std::pow(radius, 3))); }

/// Speeds scaled by `share` after every step: a lattice settles.
void settle(Stepper& run, double seconds, double share) {
  for (const double end = run.time + seconds; run.time < end;) {
    run.step();
    sim::HostState state = run.solver->save();
    for (auto* v : {&state.velocity.x, &state.velocity.y, &state.velocity.z})
      for (float& f : *v) f *= float(share);
    run.solver->load(state);
  }
}

/// Particles more than 1.5 supports below the surface.
std::vector<size_t> inner(const Stepper& run, const sim::HostState& state, double radius) {
  std::vector<size_t> inside;
  const V3d centre = sim_tests::centre_of_mass(state);
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d off = sim_tests::at(state.position, i) - centre;
    if (off.length() < radius - 1.5 * run.scene.parameters.support_radius) inside.push_back(i);
  }
  return inside;
}

/// What q does to a volume over rho^2 q (docs/design.md): a third of the sums' answer to dilation.
double response(const Stepper& run, const sim::HostState& state,
                const std::vector<size_t>& inside) {
  const sim::Parameters& p = run.scene.parameters;
  const double h = p.support_radius, scale = p.particle_mass / p.lattice_sum / std::pow(h, 5) / rho;
  double sum = 0;
  for (const size_t i : inside) {
    for (size_t j = 0; j < state.id.size(); ++j) {
      const double r2 =
          (sim_tests::at(state.position, j) - sim_tests::at(state.position, i)).length2();
      if (r2 < h * h)
        sum += scale * sim::cpu::WendlandC2::slope(float(1 - std::sqrt(r2) / h)) * r2 / 3;
    }
  }
  return sum / double(inside.size());
}

void measure_rest(Stepper& run, double radius, double omega, Drop& drop) {
  double pressure = 0, square = 0;
  int count = 0;
  sim::HostState state = run.solver->save();
  for (const double end = run.time + 2 * pi / omega; run.time < end; ++count) {
    run.step();
    state = run.solver->save();
    const std::vector<size_t> inside = inner(run, state, radius);
    double q = 0;
    for (const size_t i : inside) q += state.pressure_term[i];
    pressure += rho * rho * q / double(inside.size());
    V3d sum(0);
    double speed2 = 0;
    for (size_t i = 0; i < state.id.size(); ++i) {
      const V3d v = sim_tests::at(state.velocity, i);
      sum += v, speed2 += v.length2();
    }
    const double n = double(state.id.size());
    square += speed2 / n;
    drop.momentum = std::max(drop.momentum, sum.length() / (n * radius * omega));
  }
  pressure *= response(run, state, inner(run, state, radius)) / count;
  drop.jump = pressure / (2 * sigma / radius);
  drop.current = std::sqrt(square / count) / (radius * omega);
}

/// Second moment along z less the mean of the others, over that of a ball.
double elongation(const sim::HostState& state, double radius) {
  const V3d centre = sim_tests::centre_of_mass(state);
  V3d moment(0);
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d x = sim_tests::at(state.position, i) - centre;
    moment += V3d(x.x * x.x, x.y * x.y, x.z * x.z);
  }
  return (moment.z - 0.5 * (moment.x + moment.y)) / double(state.id.size()) /
         (0.2 * radius * radius);
}

/// Set going by the velocity of mode 2, (-x, -y, 2 z); the period is that between the first and the
/// third time that it passes through the sphere.
void measure_period(Stepper& run, double radius, double omega, Drop& drop) {
  sim::HostState state = run.solver->save();
  const V3d centre = sim_tests::centre_of_mass(state);
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d v = (sim_tests::at(state.position, i) - centre) * (0.1 * omega);
    state.velocity.x[i] = float(-0.5 * v.x), state.velocity.y[i] = float(-0.5 * v.y);
    state.velocity.z[i] = float(v.z);
  }
  run.solver->load(state);
  const double start = run.time, limit = start + 5 * pi / omega;
  std::vector<double> crossing, extreme(1, 0.);
  double last = 0, before = run.time;
  while (crossing.size() < 3 && run.time < limit) {
    before = run.time;
    run.step();
    const double now = elongation(run.solver->save(), radius);
    extreme.back() = std::max(extreme.back(), std::abs(now));
    if (run.time > start + 0.3 / omega && last * now < 0) {
      crossing.push_back(before + (run.time - before) * last / (last - now));
      extreme.push_back(0);
    }
    last = now;
  }
  drop.period = crossing.size() < 3 ? 1e30 : (crossing[2] - crossing[0]) * omega / (2 * pi);
  drop.kept = extreme.size() < 3 ? 0 : extreme[2] / extreme[0];
}

}  // namespace

Drop oscillating_drop(double radius_in_spacings) {
  Shot shot = weightless(R / radius_in_spacings);
  FluidSphere ball;
  ball.center = V3d(0.00013, 0.0001, 0.00007), ball.radius = R;  // no symmetry with the lattice
  shot.fluid.sphere = {ball};
  Stepper run(shot);
  const double radius = radius_of(run.scene), omega = rayleigh(radius);
  Drop drop;
  drop.particles = int(run.scene.start.id.size());
  settle(run, 0.8 * 2 * pi / omega, 0.95);
  measure_rest(run, radius, omega, drop);
  measure_period(run, radius, omega, drop);
  return drop;
}

Rounding cube_to_sphere(int side) {
  const double a = R / side;
  Shot shot = weightless(a);
  sim_tests::add_box(shot, V3d(0), {side, side, side});
  Stepper run(shot);
  const double radius = radius_of(run.scene);
  const auto farthest = [&](const sim::HostState& state) {
    double most = 0;
    const V3d middle = sim_tests::centre_of_mass(state);
    for (size_t i = 0; i < state.id.size(); ++i) {
      most = std::max(most, (sim_tests::at(state.position, i) - middle).length());
    }
    return (most + 0.5 * a) / radius;
  };
  Rounding result;
  result.start = farthest(run.scene.start);
  run.advance(4 * 2 * pi / rayleigh(radius));
  const sim::HostState state = run.solver->save();
  result.farthest = farthest(state);
  const V3d centre = sim_tests::centre_of_mass(state);
  V3d extent(0);
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d x = sim_tests::at(state.position, i) - centre;
    extent += V3d(x.x * x.x, x.y * x.y, x.z * x.z);
  }
  double low = 1e30, high = 0, mean = 0;
  for (int k = 0; k < 3; ++k) {
    const double e = std::sqrt(extent[k]);
    low = std::min(low, e), high = std::max(high, e), mean += e / 3;
  }
  result.spread = (high - low) / mean;
  return result;
}

}  // namespace drench::validation
