#include "tests/stress/shell_watch.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "sim/passes/cloth/shell_membrane.h"
#include "tests/sim/crossings.h"
#include "tests/stress/exact_crossing.h"

namespace drench::stress_tests {

namespace {

constexpr double far_apart = 2;  // in place of a distance, of what pieces keep

bool is_finite(const sim::HostVec& v) {
  for (const auto* c : {&v.x, &v.y, &v.z}) {
    for (const float value : *c)
      if (!std::isfinite(value)) return false;
  }
  return true;
}

bool is_finite(const sim::HostState& s) {
  return is_finite(s.position) && is_finite(s.velocity) && is_finite(s.cloth_position) &&
         is_finite(s.cloth_velocity);
}

double fastest(const sim::HostState& s) {
  double most = 0;
  for (const auto* v : {&s.velocity, &s.cloth_velocity})
    for (size_t i = 0; i < v->size(); ++i) most = std::max(most, at(*v, i).length());
  return most;
}

std::pair<double, double> heights(const sim::HostState& s) {
  double low = 1e300, high = -1e300;
  for (const auto* v : {&s.position.y, &s.cloth_position.y})
    for (const float y : *v) low = std::min(low, double(y)), high = std::max(high, double(y));
  return {low, high};
}

/// m, of the vertices, with what single precision rounded off.
std::vector<V3d> places(const sim::HostState& s) {
  std::vector<V3d> x;
  for (size_t v = 0; v < s.cloth_position.size(); ++v)
    x.push_back(at(s.cloth_position, v) + at(s.shell_rounding, v));
  return x;
}

/// J, of stretching one triangle. The law and Green's strain are the passes', in double.
double stretching_energy(const sim::ClothTopology& cloth, const std::vector<V3d>& x, size_t t) {
  const sim::ShellTopology& shell = cloth.shell;
  if (shell.area[t] == 0) return 0;
  const auto corner = [&](size_t c) {
    const V3d& p = x[size_t(cloth.corner[3 * t + c])];
    return sim::cpu::Vec3<double>{p.x, p.y, p.z};
  };
  const auto gradient = [&](size_t k) { return double(shell.gradient[k][t]); };
  const sim::cpu::RestTriangle<double> rest{
      double(shell.area[t]), {gradient(0), gradient(1)}, {gradient(2), gradient(3)}};
  const sim::ShellLaw& l = shell.law[size_t(cloth.sheet[t])];
  const sim::cpu::MembraneLaw<double> law{
      {l.c11, l.c22, l.c12, l.c66, 0, 0}, {l.limit_start, l.limit_stiffness}, 0};
  const auto strain = green_strain(surface_gradient(rest, corner(0), corner(1), corner(2)));
  return rest.area * law.at(strain, {0, 0, 0}, 1).energy;
}

/// J. Of sheets that are flat at rest: what curved ones add is not in it.
double elastic_energy(const sim::ClothTopology& cloth, const sim::HostState& s) {
  const std::vector<V3d> x = places(s);
  double sum = 0;
  for (size_t t = 0; t < size_t(cloth.triangles()); ++t) sum += stretching_energy(cloth, x, t);
  const sim::ShellTopology& shell = cloth.shell;
  for (size_t v = 0; v < cloth.mass.size(); ++v) {
    for (int k = shell.row_start[v]; k < shell.row_start[v + 1]; ++k) {  // a pair stands twice
      const size_t w = size_t(shell.column[size_t(k)]);
      sum += 0.25 * double(shell.bend[size_t(k)]) * (x[w] - x[v]).length2();
    }
  }
  for (const sim::SeamSpring& spring : cloth.seam) {
    const double longer =
        (x[size_t(spring.b)] - x[size_t(spring.a)]).length() - double(spring.rest_length);
    sum += 0.5 * double(spring.stiffness) * longer * longer;
  }
  return sum;
}

/// The gates that do not hold, by name.
std::string broken(const ShellFigures& f, const ShellGates& g) {
  std::string list;
  const auto need = [&](bool holds, const char* name) {
    if (!holds) list += (list.empty() ? "" : ", ") + std::string(name);
  };
  need(f.finite || g.blow_ups > 0, "blow-up"), need(f.whole, "mass"), need(f.leaks == 0, "leaks");
  need(f.meetings <= g.meetings, "crossings"), need(f.nearest >= g.nearest, "distance");
  need(f.max_speed <= g.speed * f.speed_bound, "speed"), need(f.energy <= g.energy, "energy");
  return list;
}

/// At once, so that what a long run has measured is there when it is stopped.
void print(const std::string& row) {
  static bool first = true;
  if (first) {
    std::cout << "| stress of shells | setting | vertices | particles | steps | CPU ms | speed, of "
                 "bound % | energy % | crossings | nearest | capped | measured | verdict |\n"
                 "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- "
                 "|\n";
  }
  first = false;
  std::cout << row << std::endl;
}

}  // namespace

ShellWatch::ShellWatch(const Shot& shot, const ShellRunOptions& how,
                       const LevelSetMaker& make_level_set)
    : ShellWatch(sim::build_scene(shot, make_level_set), how) {}

ShellWatch::ShellWatch(sim::Scene scene, const ShellRunOptions& how)
    : run(std::move(scene)), how_(how) {
  last_ = run.solver->save();
  figures_.vertices = int(last_.cloth_position.size());
  figures_.particles = int(last_.id.size());
  figures_.nearest = far_apart;
  const auto [low, high] = heights(last_);
  lowest_ = low, highest_ = high;
  fastest_ = std::max({fastest(last_), how.driven, run.scene.pins.fastest()});
  energy_ = energy(last_);
  const sim::Parameters& p = run.scene.parameters;
  const double g = std::abs(double(p.gravity[1]));
  // What there is at the start: over its lowest place, taken up again as that sinks.
  for (size_t i = 0; i < last_.id.size(); ++i)
    scale_ += double(p.particle_mass) *
              (0.5 * at(last_.velocity, i).length2() + g * double(last_.position.y[i]));
  for (size_t v = 0; v < last_.cloth_position.size(); ++v)
    scale_ += double(run.scene.cloth.mass[v]) *
              (0.5 * at(last_.cloth_velocity, v).length2() + g * double(last_.cloth_position.y[v]));
  scale_ += elastic_energy(run.scene.cloth, last_);
}

double ShellWatch::energy(const sim::HostState& state) const {
  const sim::Parameters& p = run.scene.parameters;
  const V3d g(p.gravity[0], p.gravity[1], p.gravity[2]);
  double sum = elastic_energy(run.scene.cloth, state);
  const auto add = [&](double mass, const V3d& x, const V3d& v) {
    sum += mass * (0.5 * v.length2() - g.dot(x));
  };
  for (size_t i = 0; i < state.id.size(); ++i)
    add(double(p.particle_mass), at(state.position, i), at(state.velocity, i));
  for (size_t v = 0; v < state.cloth_position.size(); ++v)
    add(double(run.scene.cloth.mass[v]), at(state.cloth_position, v), at(state.cloth_velocity, v));
  return sum;
}

bool ShellWatch::until(double time) {
  while (figures_.finite && !thrown() && run.time < time - 1e-12) {
    const double before = cpu_seconds();
    run.step_towards(time, how_.step * run.next_dt());
    measure(cpu_seconds() - before);
  }
  return figures_.finite && !thrown();
}

bool ShellWatch::thrown() const { return figures_.max_speed > 100 * figures().speed_bound; }

void ShellWatch::measure(double cpu_s) {
  sim::HostState now = run.solver->save();
  const sim::Limits& l = run.limits;
  ++figures_.steps, cpu_s_ += cpu_s;
  figures_.capped +=
      run.scene.parameters.fluid && l.iterations >= run.scene.parameters.most_iterations;
  figures_.finite = l.bad_particle < 0 && l.bad_vertex < 0 && is_finite(now);
  figures_.whole = now.id.size() == size_t(figures_.particles);
  if (!figures_.finite || !figures_.whole) return;
  const sim::ClothTopology& cloth = run.scene.cloth;
  // Straight paths between two states are not to cross, either: moments of them, in double, since
  // what is pressed may be nearer than single precision resolves.
  const int moments = how_.step > 1 ? 8 : 2;
  std::vector<Point> x(now.cloth_position.size());
  for (int m = 1; m <= moments; ++m) {
    for (size_t v = 0; v < x.size(); ++v) {
      const Point from = place_of(last_.cloth_position, v), to = place_of(now.cloth_position, v);
      x[v] = to;
      for (size_t k = 0; k < 3 && m < moments; ++k)
        x[v][k] = from[k] + (to[k] - from[k]) * m / moments;
    }
    figures_.meetings += count_meetings(cloth, x);
  }
  if (figures_.steps % how_.nearest_every == 0)
    figures_.nearest =
        std::min(figures_.nearest, least_distance(cloth, now.cloth_position, far_apart));
  if (figures_.particles > 0) figures_.leaks += count_crossings(cloth, last_, now);
  last_speed_ = fastest(now);
  figures_.max_speed = std::max(figures_.max_speed, last_speed_);
  lowest_ = std::min(lowest_, heights(now).first);
  gained_ = std::max(gained_, energy(now) - energy_);
  last_ = std::move(now);
}

ShellFigures ShellWatch::figures() const {
  ShellFigures f = figures_;
  const double g = std::abs(double(run.scene.parameters.gravity[1]));
  double mass = double(run.scene.parameters.particle_mass) * figures_.particles;
  for (const float m : run.scene.cloth.mass) mass += double(m);
  f.speed_bound = 3 * std::sqrt(2 * g * (highest_ - lowest_)) + fastest_;
  f.energy = gained_ / std::max(scale_ - mass * g * lowest_, 1e-30);
  f.cpu_ms = 1e3 * cpu_s_ / std::max(f.steps, 1);
  return f;
}

void report(const std::string& stress, const std::string& setting, const ShellWatch& watch,
            const ShellGates& gates, const std::string& measured) {
  const ShellFigures f = watch.figures();
  EXPECT_EQ(broken(f, gates), "") << stress << ", " << setting;
  ShellGates common;
  if (gates.energy == no_rule) common.energy = no_rule;
  const std::string fails = broken(f, common);
  print(fmt::format(
      "| {} | {} | {} | {} | {} | {:.1f} | {:.0f} | {} | {} | {:.2f} | {} | {} | {} |", stress,
      setting, f.vertices, f.particles, f.steps, f.cpu_ms, 100 * f.max_speed / f.speed_bound,
      gates.energy == no_rule ? "" : fmt::format("{:.2f}", 100 * f.energy), f.meetings, f.nearest,
      f.capped, measured, fails.empty() ? "pass" : "FAIL: " + fails));
}

}  // namespace drench::stress_tests
