#include "tests/sim/shell_closed_forms.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace drench::sim_tests {

namespace {

bool near(double a, double b) { return std::abs(a - b) < 1e-9; }

/// Of the row of a file that begins with `key`.
double validated(const std::string& file, const std::string& key, size_t column) {
  for (const auto& row : read_validation(file))
    if (row[0] == key) return std::stod(row[column]);
  throw std::runtime_error(file + " has no row " + key);
}

/// u/L of a sheet that hangs by its edge, load = w L / (E h): the tension w (L - s) is
/// E h lambda (lambda^2 - 1) / 2.
double hanging_elongation(double load) {
  const int n = 1000;
  double sum = 0;
  for (int k = 0; k < n; ++k) {
    const double pull = load * (k + 0.5) / n;
    double stretch = 1;
    for (int i = 0; i < 20; ++i)
      stretch -= (stretch * (stretch * stretch - 1) / 2 - pull) / ((3 * stretch * stretch - 1) / 2);
    sum += (stretch - 1) / n;
  }
  return sum;
}

/// Times, s, at which a number that the run's state has passes through zero.
template <class Value>
std::vector<double> zeros(ShellRun& run, double dt, size_t count, const Value& value) {
  std::vector<double> times;
  double before = value(run), start = run.time;
  while (times.size() < count && run.time < 10) {
    dt > 0 ? run.step(dt) : run.step();
    const double now = value(run);
    if (before * now < 0) times.push_back(start + (run.time - start) * before / (before - now));
    before = now, start = run.time;
  }
  return times;
}

}  // namespace

double hanging_error(SheetMesh mesh, int cells, double load) {
  const double length = 0.5;
  ShellSheet sheet;
  sheet.mesh = mesh, sheet.size = {length, 0.25, cells};
  sheet.along = V3d(0, -1, 0), sheet.across = V3d(1, 0, 0);
  sheet.young = sheet.weight() * length / load, sheet.bend = 1e-6;
  sheet.damping = 40;
  sheet.held = [](V3d x) { return near(x.x, 0); };
  ShellRun run(sheet);
  run.advance(0.7);
  const double low = -run.mean([&](V3d x) { return near(x.x, length); }).y;
  return (low / length - 1) / hanging_elongation(load) - 1;
}

// E h = 1e4 w L; it falls from two straight halves.
double catenary_error(SheetMesh mesh, int cells) {
  const double arc = 1.2, span = 0.5, length = arc * span;
  ShellSheet sheet;
  sheet.mesh = mesh, sheet.size = {length, 0.1 * span, cells};
  sheet.young = 1e4 * sheet.weight() * span, sheet.bend = 1e-6 * sheet.weight() * std::pow(span, 3);
  sheet.damping = 20;
  sheet.held = [=](V3d x) { return near(x.x, 0) || near(x.x, length); };
  ShellRun run(sheet);
  std::vector<V3d> x = run.places();
  for (size_t v = 0; v < run.size(); ++v) {
    const double s = run.flat(v).x / length;
    x[v].x = s * span, x[v].y = -std::min(s, 1 - s) * std::sqrt(arc * arc - 1) * span;
  }
  run.start_from(x, std::vector<V3d>(run.size(), V3d(0)));
  run.advance(1);
  double lowest = 0;
  for (const V3d& p : run.places()) lowest = std::min(lowest, p.y);
  return -lowest / span / validated("catenary.csv", "1.2", 2) - 1;
}

double cantilever_error(SheetMesh mesh, int cells, double gamma, double slenderness) {
  const double length = 0.2;
  ShellSheet sheet;
  sheet.mesh = mesh, sheet.size = {length, 0.1 * length, cells, 1};
  sheet.bend = sheet.weight() * std::pow(length, 3) / gamma;
  sheet.young = 12 * sheet.bend * std::pow(slenderness / length, 2);
  // rad/s, about: of bending, and of hanging as a pendulum
  const double slowest = (3.5 / std::sqrt(gamma) + 0.5) * std::sqrt(shell_gravity / length);
  sheet.damping = 1.5 * slowest;
  sheet.held = [](V3d x) { return x.x < 1e-9; };
  ShellRun run(sheet);
  run.advance(12 / slowest);
  const V3d tip = run.mean([&](V3d x) { return near(x.x, length); });
  const double exact = validated("cantilever_heavy_elastica.csv", std::to_string(int(gamma)), 3);
  return -tip.y / tip.x / exact - 1;
}

// Held by two rings of vertices: 0.00126532 w a^4 / D (nu = 0.3; Timoshenko and Woinowsky-Krieger).
// It is a twentieth of the thickness: linear.
double plate_error(SheetMesh mesh, int cells) {
  const double edge = 0.4, ring = edge / cells, all = edge + 2 * ring, deflection = 1e-3,
               thickness = 0.02, nu = 0.3;
  ShellSheet sheet;
  sheet.mesh = mesh, sheet.size = {all, all, cells + 2}, sheet.size.still = 1;
  sheet.bend = 0.00126532 * sheet.weight() * std::pow(edge, 4) / deflection;
  sheet.young = 12 * (1 - nu * nu) * sheet.bend / (thickness * thickness), sheet.poisson = nu;
  sheet.damping = 150;
  sheet.held = [=](V3d x) { return std::min({x.x, x.y, all - x.x, all - x.y}) < ring + 1e-9; };
  ShellRun run(sheet);
  run.advance(0.15);
  double most = 0;
  for (const V3d& x : run.places()) most = std::max(most, -x.y);
  return most / deflection - 1;
}

namespace {

constexpr double mode_period = 0.4;  // s

/// A cantilever that is let go in its first mode, omega = 3.516 sqrt(D / (sigma L^4)).
ShellRun cantilever_in_first_mode(SheetMesh mesh, int cells, double damping_time,
                                  double amplitude) {
  const double length = 0.2;
  ShellSheet sheet;
  sheet.mesh = mesh, sheet.size = {length, 0.1 * length, cells, 1};
  sheet.gravity = V3d(0), sheet.damping_time = damping_time;
  const double speed = 2 * M_PI / mode_period * length * length / 3.5160152685;
  sheet.bend = sheet.areal_density * speed * speed;
  sheet.young = 12 * sheet.bend * std::pow(100 / length, 2);
  sheet.held = [](V3d x) { return x.x < 1e-9; };
  ShellRun run(sheet);
  const double k = 1.87510406871 / length, at_end = k * length;
  const double ratio =
      (std::cosh(at_end) + std::cos(at_end)) / (std::sinh(at_end) + std::sin(at_end));
  std::vector<V3d> x = run.places();
  for (size_t v = 0; v < run.size(); ++v) {
    const double s = k * std::max(run.flat(v).x, 0.);
    x[v].y +=
        amplitude * length * (std::cosh(s) - std::cos(s) - ratio * (std::sinh(s) - std::sin(s)));
  }
  run.start_from(x, std::vector<V3d>(run.size(), V3d(0)));
  return run;
}

}  // namespace

double mode_error(SheetMesh mesh, int cells, double dt) {
  ShellRun run = cantilever_in_first_mode(mesh, cells, 0, 1e-3);
  const auto tip = [&](const ShellRun& r) {
    return r.mean([&](V3d p) { return near(p.x, 0.2); }).y;
  };
  const std::vector<double> t = zeros(run, dt, 7, tip);
  return (t.at(6) - t.at(0)) / 3 / mode_period - 1;
}

// The amplitude's square goes as exp(-2 zeta omega t), zeta = tau omega / 2: over two damped
// periods by 8 pi zeta / sqrt(1 - zeta^2). That of the tip, since energy has what places are
// rounded by.
double mode_loss_error(SheetMesh mesh, int cells, double ratio, int steps) {
  const double omega = 2 * M_PI / mode_period, damped = std::sqrt(1 - ratio * ratio);
  ShellRun run = cantilever_in_first_mode(mesh, cells, 2 * ratio / omega, 0.01);
  const auto amplitude2_after_a_period = [&] {
    for (int k = 0; k < steps; ++k) run.step(mode_period / damped / steps);
    const std::vector<V3d> x = run.places(), u = run.velocities();
    V3d place(0), speed(0);
    int ends = 0;
    for (size_t v = 0; v < run.size(); ++v)
      if (near(run.flat(v).x, 0.2)) place += x[v], speed += u[v], ++ends;
    return (std::pow(place.y * omega, 2) + std::pow(speed.y, 2)) / (ends * ends);
  };
  const double start = amplitude2_after_a_period();
  amplitude2_after_a_period();
  const double end = amplitude2_after_a_period();
  return std::log(start / end) / (8 * M_PI * ratio / damped) - 1;
}

// That of a bar, T0 = 2 pi sqrt(2 L / (3 g)), times (2 / pi) K.
double pendulum_error(SheetMesh mesh, int cells) {
  const double length = 0.5, factor = validated("pendulum_period.csv", "90", 1);
  ShellSheet sheet;
  sheet.mesh = mesh, sheet.size = {length, 0.1, cells};
  sheet.bend = 1, sheet.young = 1e5;
  sheet.held = [](V3d x) { return near(x.x, 0); };
  ShellRun run(sheet);
  const auto tip = [&](const ShellRun& r) {
    return r.mean([&](V3d p) { return near(p.x, length); }).x;
  };
  const std::vector<double> t = zeros(run, 0, 3, tip);
  return (t.at(2) - t.at(0)) / (2 * M_PI * std::sqrt(2 * length / (3 * shell_gravity))) / factor -
         1;
}

}  // namespace drench::sim_tests
