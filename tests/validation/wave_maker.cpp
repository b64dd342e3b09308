#include "tests/validation/wave_maker.h"

#include <array>
#include <cmath>
#include <vector>

#include "tests/sim/support.h"

namespace drench::validation {

namespace {

using sim_tests::Stepper;

constexpr double pi = 3.14159265358979323846, gravity = 9.81;
constexpr double depth = 0.2, stroke = 0.2 * depth, tank = 16 * depth, k = 1 / depth;
constexpr int thick = 5;  // particles along z: just over two supports

/// Grows to the whole stroke within two periods, so that the front is no splash.
double piston_at(double t, double omega) {
  const double grown = std::min(1., omega * t / (4 * pi));
  return 0.5 * stroke * grown * grown * (3 - 2 * grown) * std::sin(omega * t);
}

Shot tank_shot(int layers, double tolerance, double omega, double seconds) {
  Shot shot;
  shot.name = shot.file = "validation";
  const double a = depth / layers;
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.spacing = a, shot.fluid.tolerance = tolerance;
  shot.fluid.xsph = 0, shot.fluid.kinematic_viscosity = 0;
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::periodic};
  shot.domain.min = V3d(-depth, 0, 0), shot.domain.max = V3d(tank, 3 * depth, thick * a);
  shot.fluid.box.push_back({V3d(0), V3d(tank, depth, thick * a), V3d(0)});
  Obstacle& piston = shot.obstacle.emplace_back();
  piston.type = ObstacleType::box, piston.name = "piston";
  piston.size = V3d(2 * depth, 8 * depth, thick * a);
  piston.position.keys.clear();
  constexpr double interval = 1. / 400;  // s
  for (double t = 0; t < seconds + interval; t += interval) {
    piston.position.keys.emplace_back(shot.timeline.first + t * shot.timeline.fps,
                                      V3d(-depth + piston_at(t, omega), depth, 0));
  }
  return shot;
}

/// Amplitude and phase of one frequency, by least squares over whole periods.
struct Harmonic {
  double sine = 0, cosine = 0;
  int count = 0;
  void add(double height, double angle) {
    sine += height * std::sin(angle), cosine += height * std::cos(angle), ++count;
  }
  double amplitude() const { return 2 * std::hypot(sine, cosine) / count; }
  double phase() const { return std::atan2(cosine, sine); }
};

/// Water above the floor in columns around x, m of height.
std::vector<double> heights(const Stepper& run, const std::vector<double>& x, double width) {
  const sim::HostState s = run.solver->save();
  std::vector<double> height(x.size(), 0.);
  const double a = run.scene.parameters.spacing;
  for (size_t i = 0; i < s.id.size(); ++i) {
    const double at = run.scene.frame.to_world(0, s.position.x[i]);
    for (size_t n = 0; n < x.size(); ++n)
      height[n] += std::abs(at - x[n]) < width / 2 ? a * a * a / (width * thick * a) : 0;
  }
  return height;
}

}  // namespace

WaveMaker wave_maker(int layers, double tolerance) {
  const double kd = k * depth, omega = std::sqrt(gravity * k * std::tanh(kd)),
               period = 2 * pi / omega, begin = 3.5 * period, end = 5.5 * period;
  Stepper run(tank_shot(layers, tolerance, omega, end));
  std::vector<double> gauge;
  for (int n = 0; n < 7; ++n) gauge.push_back((3 + 0.5 * n) * depth);
  std::vector<Harmonic> wave(gauge.size());
  while (run.time < begin) run.step();
  constexpr int samples = 200;
  for (int n = 0; n < samples; ++n) {
    const double until = begin + (end - begin) * (n + 1) / samples;
    run.advance(until);  // in equal parts: a small rest would be a step of its own
    const std::vector<double> height = heights(run, gauge, 0.4 * depth);
    for (size_t i = 0; i < gauge.size(); ++i) wave[i].add(height[i], omega * run.time);
  }
  WaveMaker result;
  result.expected = 2 * (std::cosh(2 * kd) - 1) / (std::sinh(2 * kd) + 2 * kd);
  const double mean = std::sin(0.2 * kd) / (0.2 * kd);  // of a crest over the width of a column
  double x = 0, log = 0, xx = 0, xlog = 0;
  const double n = double(gauge.size());
  for (size_t i = 0; i < gauge.size(); ++i) {
    const double ratio = 2 * wave[i].amplitude() / mean / stroke / result.expected;
    result.carried += ratio / n;
    x += gauge[i] / n, log += std::log(ratio) / n;
    xx += gauge[i] * gauge[i] / n, xlog += gauge[i] * std::log(ratio) / n;
  }
  const double slope = (xlog - x * log) / (xx - x * x), apart = gauge.back() - gauge.front();
  result.made = std::exp(log - slope * x), result.decay = -slope * 2 * pi / k;
  const double turned = std::remainder(wave.front().phase() - wave.back().phase(), 2 * pi);
  result.length = k * apart / std::abs(turned);
  result.thickness = sim_tests::energy_across(run.solver->save().velocity);
  result.particles = run.solver->particles(), result.steps = run.steps;
  return result;
}

}  // namespace drench::validation
