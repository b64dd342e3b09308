// Sheets that lie still sleep and wake (sim/setup/sheet_rest.h).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/simulator.h"
#include "tests/sim/same_state.h"
#include "tests/sim/shell_run.h"
#include "tests/temporary_folder.h"

namespace drench::sim_tests {
namespace {

constexpr double thickness = 0.002;  // m

Cloth& add_towel(Shot& shot, double height, double size = 0.2) {
  Cloth& sheet = add_sheet(shot, size, height, 8);
  sheet.name = "towel" + std::to_string(shot.cloth.size());
  sheet.model = ClothModel::shell;
  sheet.thickness = thickness, sheet.damping = 5;
  return sheet;
}

/// Two sheets that fall on each other on the floor.
Shot pile() {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  shot.gravity = V3d(0, -9.81, 0);
  shot.domain.axis[1] = Axis::walls;
  add_towel(shot, -0.98), add_towel(shot, -0.96);
  return shot;
}

/// Along the floor to the pile's middle, between two frames.
void roll_a_ball(Shot& shot, double from, double begins, double ends) {
  Obstacle& ball = shot.obstacle.emplace_back();
  ball.type = ObstacleType::sphere, ball.radius = 0.05;
  ball.position.keys = {
      {1.0, V3d(from, -0.95, 0)}, {begins, V3d(from, -0.95, 0)}, {ends, V3d(0, -0.95, 0)}};
}

int asleep(const Stepper& run) { return run.scene.rest.asleep(); }

void until_all_sleep(Stepper& run, double latest) {
  while (asleep(run) < int(run.scene.sheet.size()) && run.time < latest) run.step();
  ASSERT_EQ(asleep(run), int(run.scene.sheet.size()));
}

double farthest_apart(const sim::HostVec& a, const sim::HostVec& b) {
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, (at(a, i) - at(b, i)).length());
  return most;
}

// What the pile would have done in a second more, by a run that never sleeps: it creeps by less
// than twice the sleeping speed.
TEST(SheetRest, APileSleepsWhereItWouldHaveStayed) {
  Shot shot = pile();
  Stepper run(shot);
  until_all_sleep(run, 6);
  const sim::HostVec fell = run.solver->cloth_positions();
  const int64_t steps = run.steps;
  for (const double end = run.time + 1; run.time < end;) {
    run.step();
    ASSERT_EQ(run.limits.sheet_sweeps, 0);
    ASSERT_EQ(run.limits.max_speed, 0);
  }
  EXPECT_GT(run.steps, steps + 100);
  expect_same_vectors(run.solver->cloth_positions(), fell);
  for (Cloth& sheet : shot.cloth) sheet.sleep_speed = 0;
  Stepper awake(shot);
  while (awake.time < run.time) awake.step();
  EXPECT_FALSE(awake.scene.rest.any());
  const double speed = std::min(1e-3, std::hypot(0.2, 0.2) / 500);
  EXPECT_LT(farthest_apart(awake.solver->cloth_positions(), fell), 2 * speed * 1.5);
}

TEST(SheetRest, SheetsThatNothingSendsToSleepHaveTheSameBits) {
  Shot shot = pile();
  Stepper may(shot);
  for (Cloth& sheet : shot.cloth) sheet.sleep_speed = 0;
  Stepper never(shot);
  for (int k = 0; k < 60; ++k) may.step(), never.step();
  EXPECT_EQ(asleep(may), 0);
  expect_same_state(may.solver->save(), never.solver->save());
}

TEST(SheetRest, OneThatFallsWakesThePileAndAnotherAwayFromItSleepsOn) {
  Shot shot = pile();
  add_towel(shot, -0.98).corner += V3d(0.5, 0, 0);
  Cloth& last = add_towel(shot, 0.95, 0.1);
  last.pin.push_back({});
  for (uint32_t v = 0; v < 81; ++v) last.pin[0].vertices.push_back(v);
  last.pin[0].release = 4;
  Stepper run(shot);
  for (; run.time < 3.9; run.step_towards(3.9, run.next_dt())) continue;
  EXPECT_EQ(asleep(run), 4);
  const sim::HostVec before = run.solver->cloth_positions();
  while (run.time < 6 && asleep(run) > 1) run.step_towards(6, run.next_dt());
  EXPECT_EQ(run.scene.rest.state().asleep, (std::vector<char>{0, 0, 1, 0}));
  // It lands, and presses the pile on the floor.
  run.advance(run.time + 0.1);
  const sim::HostVec after = run.solver->cloth_positions();
  double pile = 0, away = 0;
  for (size_t i = 0; i < 81; ++i) {
    pile = std::max(pile, (at(after, 81 + i) - at(before, 81 + i)).length());
    away = std::max(away, (at(after, 162 + i) - at(before, 162 + i)).length());
  }
  EXPECT_GT(pile, 1e-6);
  EXPECT_EQ(away, 0);
}

TEST(SheetRest, AnObstacleThatComesNearWakesIt) {
  Shot shot = pile();
  shot.timeline.first = 1, shot.timeline.last = 120, shot.timeline.fps = 24;
  roll_a_ball(shot, 0.5, 73, 97);
  Stepper run(shot);
  run.advance(3);
  ASSERT_EQ(asleep(run), 2);
  while (asleep(run) > 0 && run.time < 4) run.step();
  // Its box meets theirs once its centre has come within 0.15 m and what they keep apart.
  const double centre = 0.5 * (4 - run.time);
  EXPECT_NEAR(centre, 0.15, 0.02);
}

TEST(SheetRest, WaterWakesItAndAPoolKeepsItAwake) {
  Shot shot = pile();
  shot.fluid.spacing = 0.02, shot.cloth.pop_back();
  shot.domain.min = V3d(-0.2, -1, -0.2), shot.domain.max = V3d(0.2, 1, 0.2);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  FluidEmitter jet;
  jet.center = V3d(0, -0.9, 0), jet.radius = 0.04, jet.direction = V3d(0, -1, 0), jet.speed = 0.5;
  jet.start = 5, jet.stop = 5.3;
  shot.timeline.first = 1, shot.timeline.last = 80, shot.timeline.fps = 12;
  shot.fluid.emitter.push_back(jet);
  Simulator run(shot, {.device = Device::cpu});
  int least = 1, most = 0;
  double wet = 0;
  for (int frame = 0; frame < 79; ++frame) {
    const StepReport report = run.advance_frame();
    if (report.time < 5) most = std::max(most, report.sheets_asleep);
    if (report.time > 5.3)
      least = std::min(least, report.sheets_asleep), wet += double(report.near);
    if (report.near > 0) EXPECT_EQ(report.sheets_asleep, 0) << report.time;
  }
  EXPECT_EQ(most, 1);
  EXPECT_EQ(least, 0);
  EXPECT_GT(wet, 100);
}

TEST(SheetRest, APinThatMovesAndOneThatLetsGoWakeIt) {
  for (const bool moves : {true, false}) {
    Shot shot = pile();
    shot.cloth.pop_back();
    Cloth& sheet = shot.cloth[0];
    sheet.corner.y = 0, sheet.damping = 20;
    ClothPin& pin = sheet.pin.emplace_back();
    for (int k = 0; k < 9; ++k) pin.vertices.push_back(k);
    const double then = 7;
    shot.timeline.first = 1, shot.timeline.last = 200, shot.timeline.fps = 24;
    if (moves)
      pin.position.keys = {
          {1.0, V3d(0)}, {1 + 24 * then, V3d(0)}, {25 + 24 * then, V3d(0.1, 0, 0)}};
    else
      pin.release = then;
    Stepper run(shot);
    until_all_sleep(run, then);
    while (asleep(run) > 0 && run.time < then + 1) run.step_towards(then + 1, run.next_dt());
    EXPECT_NEAR(run.time, then, 0.01) << moves;
  }
}

// A strip on its edge in syrup, 25 % beyond the load that buckles it sideways: for two seconds it
// is slower than its sleeping speed, and in the first of these it sags by more than it goes aside.
TEST(SheetRest, WhatGrowsFromLittleIsNotTakenForRest) {
  ShellSheet strip;
  strip.size = {0.066, 0.012, 16}, strip.across = V3d(0, 1, 1e-4);
  strip.young = 2e4, strip.bend = 2e-5, strip.damping = 60;
  strip.held = [](V3d x) { return x.x < 0.0045; };
  const auto aside = [&](bool sleeps) {
    ShellRun run(strip);
    if (!sleeps) run.scene.rest = {};
    run.advance(5);
    double most = 0;
    for (const V3d& x : run.places()) most = std::max(most, std::abs(x.z));
    return most;
  };
  const double with = aside(true), without = aside(false);
  EXPECT_GT(without, 1e-3);
  EXPECT_EQ(with, without);
}

TEST(SheetRest, ARunThatIsResumedAsleepOrBeforeHasTheSameBits) {
  test::TemporaryFolder folder;
  Shot shot = pile();
  shot.timeline.first = 1, shot.timeline.last = 70, shot.timeline.fps = 12;
  roll_a_ball(shot, 0.4, 61, 67);
  Simulator whole(shot, {.device = Device::cpu});
  const auto places = [](const Simulator& run) {
    std::vector<V3f> all;
    for (const ClothFrame& sheet : run.cloth())
      all.insert(all.end(), sheet.mesh.position.begin(), sheet.mesh.position.end());
    return all;
  };
  std::vector<std::vector<V3f>> frame;
  int slept = 0;
  for (int f = 2; f <= 70; ++f) {
    slept += whole.advance_frame().sheets_asleep;
    frame.push_back(places(whole));
    if (f == 8 || f == 55) whole.write_checkpoint(folder / std::to_string(f));
  }
  EXPECT_GT(slept, 20);
  for (const int from : {8, 55}) {
    Simulator resumed(shot, {.device = Device::cpu});
    resumed.read_checkpoint(folder / std::to_string(from));
    for (int f = from + 1; f <= 70; ++f) {
      resumed.advance_frame();
      ASSERT_EQ(places(resumed), frame[size_t(f - 2)]) << from << " " << f;
    }
  }
}

// At a frame from which a run is taken up.
TEST(SheetRest, APinThatLetsGoAsTheRunIsResumedWakesIt) {
  Shot shot = pile();
  shot.cloth.pop_back();
  Cloth& sheet = shot.cloth[0];
  sheet.corner.y = 0;
  ClothPin& pin = sheet.pin.emplace_back();
  for (uint32_t v = 0; v < 81; ++v) pin.vertices.push_back(v);
  const double then = 3;
  pin.release = then;
  Stepper run(shot);
  while (run.time < then) run.step_towards(then, run.next_dt());
  ASSERT_EQ(asleep(run), 1);
  Stepper resumed(shot);
  resumed.load(run.solver->save(), run.limits, run.time, run.scene.rest.state());
  for (Stepper* one : {&run, &resumed}) one->step(1e-3);
  EXPECT_EQ(asleep(run), 0);
  expect_same_state(run.solver->save(), resumed.solver->save());
}

}  // namespace
}  // namespace drench::sim_tests
