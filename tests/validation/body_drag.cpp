#include "tests/validation/body_drag.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/sim/obstacle_scenes.h"
#include "tests/validation/viscous.h"

namespace drench::validation {

namespace {

using sim_tests::at;
using sim_tests::Stepper;

constexpr double g = 9.81, width = 0.1;  // m/s^2, m
constexpr int thick = 5;  // particles along z, which is periodic: just over two supports

Shot honey(double spacing, double viscosity) {
  Shot shot = sim_tests::empty_shot();
  shot.timeline = {1001, 2001, 24};
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.spacing = spacing, shot.fluid.kinematic_viscosity = viscosity, shot.fluid.xsph = 0;
  shot.fluid.tolerance = 1e-5;
  return shot;
}

/// Steps of dt until `end`, s.
void advance(Stepper& run, double end, double dt) {
  while (run.time < end - 1e-9) run.step(dt);
}

/// Moves an obstacle along x at a steady speed for all of the shot.
void slide(Obstacle& obstacle, double speed) {
  const double seconds = 1000. / 24;
  const V3d start = obstacle.position.keys.at(0).second;
  obstacle.position.keys = {{1001, start}, {2001, start + V3d(speed * seconds, 0, 0)}};
}

V3d world(const Stepper& run, const sim::HostState& state, size_t i) {
  V3d x;
  for (int k = 0; k < 3; ++k) x[k] = run.scene.frame.to_world(k, at(state.position, i)[k]);
  return x;
}

}  // namespace

Dragged lid_driven(int across) {
  const double a = width / across, viscosity = 1e-2, U = 0.05;
  const int length = 4 * across;
  Shot shot = honey(a, viscosity);
  shot.domain.min = V3d(0, -width, 0), shot.domain.max = V3d(length * a, 2 * width, thick * a);
  shot.domain.axis = {Axis::walls, Axis::open, Axis::periodic};
  shot.domain.slip = Slip::free;
  sim_tests::add_box(shot, V3d(0), {length, across, thick});
  sim_tests::add_plane(shot, V3d(0), V3d(0, 1, 0));
  sim_tests::add_plane(shot, V3d(0, width, 0), V3d(0, -1, 0));
  slide(shot.obstacle[1], U);
  Stepper run(shaken(shot, 0.25));
  const double unit = width * width / viscosity;
  advance(run, 0.4 * unit, unit / (20 * across));
  Dragged result;
  const sim::HostState state = run.solver->save();
  double sum = 0, count = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    const V3d x = world(run, state, i);
    if (std::abs(x.x / (length * a) - 0.5) > 0.125) continue;
    const double y = x.y / width, u = state.velocity.x[i] / U;
    sum += std::pow(u - (3 * y * y - 2 * y), 2), ++count;
    result.scale = std::max(result.scale, -u);
  }
  result.error = std::sqrt(sum / count);
  result.thickness = sim_tests::energy_across(state.velocity);
  result.particles = run.solver->particles(), result.steps = run.steps;
  return result;
}

namespace {

/// What the film runs down, at y = 0.
void add_floor(Shot& shot, Floor floor, double length, double thick, double a) {
  if (floor == Floor::plane) sim_tests::add_plane(shot, V3d(0), V3d(0, 1, 0));
  if (floor == Floor::box) {
    sim_tests::add_obstacle(shot, ObstacleType::box, V3d(length / 2, -0.05, thick / 2)).size =
        V3d(2 * length, 0.1, 2 * thick);
  }
  if (floor == Floor::sheet) {
    Cloth& sheet = shot.cloth.emplace_back();
    sheet.thickness = 1e-5;
    sheet.corner = V3d(-length / 2, 0, 0), sheet.u = V3d(2 * length, 0, 0),
    sheet.v = V3d(0, 0, thick);
    sheet.cells = V2i(int(std::lround(2 * length / a)), int(std::lround(thick / a)));
    sheet.pin.push_back({{}, std::pair(V3d(-100), V3d(100))});
  }
}

}  // namespace

Dragged film(Floor floor, int layers) {
  const double depth = 0.02, a = depth / layers, slope = M_PI / 6;
  const double pull = g * std::sin(slope), viscosity = std::sqrt(2 * pull * std::pow(depth, 3));
  const double unit = depth * depth / viscosity, dt = unit / (10 * layers);
  const int length = 6 * layers;
  Shot shot = honey(a, viscosity);
  shot.gravity = V3d(pull, -g * std::cos(slope), 0);
  shot.domain.min = V3d(-1, -0.2, 0), shot.domain.max = V3d(1, 0.2, thick * a);
  shot.domain.axis = {Axis::open, Axis::open, Axis::periodic};
  sim_tests::add_box(shot, V3d(0), {length, layers, thick});
  add_floor(shot, floor, length * a, thick * a, a);
  Stepper run(shot);
  Dragged result;
  advance(run, 1.5 * unit, dt);
  double impulse = 0;
  const double before = sim_tests::total_momentum(run.scene, run.solver->save()).x;
  const double begin = run.time;
  while (run.time < begin + 0.5 * unit) {
    run.step(dt);
    result.iterations = run.limits.viscous_iterations;
    for (const sim::ObstacleImpulse& i : run.solver->obstacle_impulses()) impulse += i.impulse[0];
  }
  const sim::HostState state = run.solver->save();
  const double weight = run.scene.parameters.particle_mass * run.solver->particles() * pull;
  const double gained = sim_tests::total_momentum(run.scene, state).x - before;
  result.force = (impulse + gained) / (run.time - begin) / weight;
  const double middle = sim_tests::centre_of_mass(state).x,
               largest = pull * depth * depth / (2 * viscosity);
  double sum = 0, count = 0, speed = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    if (std::abs(state.position.x[i] - middle) > 0.75 * depth) continue;
    const double y = world(run, state, i).y / depth, u = state.velocity.x[i] / largest;
    sum += std::pow(u - (2 * y - y * y), 2), speed += 1.5 * u, ++count;
  }
  result.error = std::sqrt(sum / count), result.scale = speed / count;
  result.thickness = sim_tests::energy_across(state.velocity);
  result.particles = run.solver->particles(), result.steps = run.steps;
  return result;
}

Dragged towed_sheet(int across, double mass) {
  const double a = width / across, viscosity = 1e-2, U = 0.05;
  constexpr int period = 6;
  Shot shot = honey(a, viscosity);
  shot.domain.min = V3d(0), shot.domain.max = V3d(period * a, width, period * a);
  shot.domain.axis = {Axis::periodic, Axis::walls, Axis::periodic};
  shot.domain.wall_velocity.y_low = V3d(-U, 0, 0), shot.domain.wall_velocity.y_high = V3d(U, 0, 0);
  Cloth& sheet = shot.cloth.emplace_back();
  sheet.thickness = 1e-5, sheet.damping = 0;
  sheet.corner = V3d(0, width / 4, 0), sheet.u = V3d(period * a, 0, 0);
  sheet.v = V3d(0, 0, period * a), sheet.cells = V2i(period);
  sheet.areal_density = mass * 1000 * a;
  sim_tests::add_box(shot, V3d(0), {period, across, period});
  Stepper run(shot);
  Dragged result;
  const double unit = width * width / viscosity;
  while (run.time < 0.6 * unit) {
    run.step(unit / (20 * across));
    result.iterations += run.limits.viscous_iterations;
  }
  result.iterations /= run.steps;
  const sim::HostState state = run.solver->save();
  double sheet_speed = 0, height = 0;
  for (size_t v = 0; v < state.cloth_velocity.size(); ++v) {
    sheet_speed += state.cloth_velocity.x[v] / double(state.cloth_velocity.size());
    height += run.scene.frame.to_world(1, state.cloth_position.y[v]) /
              double(state.cloth_velocity.size());
  }
  double sum = 0;
  for (size_t i = 0; i < state.id.size(); ++i) {
    const double y = world(run, state, i).y / width;
    sum += std::pow(state.velocity.x[i] / U - (2 * y - 1), 2);
  }
  result.error = sheet_speed / (U * (2 * height / width - 1));
  result.scale = std::sqrt(sum / double(state.id.size()));
  result.force = (height - width / 4) / a;
  result.particles = run.solver->particles(), result.steps = run.steps;
  return result;
}

}  // namespace drench::validation
