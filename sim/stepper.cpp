#include "sim/stepper.h"

#include <algorithm>
#include <cmath>

namespace drench::sim {

Stepper::Stepper(Scene scene_, std::unique_ptr<Solver> solver_, double start)
    : scene(std::move(scene_)), solver(std::move(solver_)) {
  load(scene.start, {}, start);
  limits = solver->measure();
}

void Stepper::load(const HostState& state, const Limits& limits_, double time_,
                   const SheetRestState& rest) {
  solver->load(state);
  limits = limits_, time = time_;
  scene.obstacles.place(*solver, time, time);
  scene.sinks.place(*solver, time, time);
  if (scene.pins.any()) solver->hold(scene.pins.over(scene.obstacles, time, time));
  if (scene.rest.any()) scene.rest.start(*solver, rest, time);
}

StepLimit Stepper::stable_limit() {
  if (scene.motion.moves()) scene.set_drive(time);
  const StepLimit limit = stable_step(scene.parameters, limits);
  if (!scene.motion.turns()) return limit;
  Limits more = limits;
  more.max_speed += float(scene.motion.kick(time, limit.dt));
  return stable_step(scene.parameters, more);
}

StepLimit Stepper::limit() {
  const StepLimit stable = stable_limit();
  const double moves = scene.obstacles.limit(time, stable.dt),
               pinned = scene.pins.limit(time, moves);
  if (pinned < moves) return {pinned, "pin speed"};
  return moves < stable.dt ? StepLimit{moves, "obstacle speed"} : stable;
}

int Stepper::cloth_substeps(double dt) const {
  if (scene.cloth.vertices() == 0) return 1;
  return std::max(1, int(std::ceil(dt / scene.parameters.cloth_dt_limit - 1e-6)));
}

double Stepper::step_towards(double end, double longest) {
  const double stop = scene.pins.stop(time, scene.obstacles.stop(time, end)), rest = stop - time;
  const double parts = std::ceil(rest / longest - 1e-9);  // no step more for rounding
  const double dt = parts <= 1 ? rest : rest / parts;
  step_to(parts <= 1 ? stop : time + dt, dt);
  return dt;
}

void Stepper::step_to(double end, double dt) {
  scene.obstacles.place(*solver, time, end);
  scene.sinks.place(*solver, time, end);
  const PinsNow pins = scene.pins.any() ? scene.pins.over(scene.obstacles, time, end) : PinsNow{};
  if (scene.pins.any()) solver->hold(pins);
  const bool draws = scene.sewing.draws(time), air = scene.parameters.air_density > 0;
  if (draws) solver->draw_seams(scene.sewing.lengths(end));
  const WindNow wind = air ? scene.wind.at(end) : WindNow{};
  if (air) solver->blow(wind);
  if (scene.motion.moves()) solver->drive(scene.motion.over(time, end));
  const bool rests = scene.rest.any();
  if (rests)
    scene.rest.before_step(*solver, {draws || wind.blows(), scene.obstacles.moving(), pins});
  limits = solver->step(dt, cloth_substeps(dt));
  time = end, ++steps;
  if (rests) scene.rest.after_step(*solver, time);
}

}  // namespace drench::sim
