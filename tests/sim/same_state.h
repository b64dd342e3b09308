#pragma once
// Whole states compared, every column and count; runs on any number of threads and taken up again.

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <vector>

#include "tests/sim/support.h"

namespace drench::sim_tests {

inline void expect_same_vectors(const sim::HostVec& a, const sim::HostVec& b) {
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.y, b.y);
  EXPECT_EQ(a.z, b.z);
}

inline void expect_same_state(const sim::HostState& a, const sim::HostState& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.memory_triangle, b.memory_triangle);
  EXPECT_EQ(a.memory_side, b.memory_side);
  EXPECT_EQ(a.pressure_term, b.pressure_term);
  EXPECT_EQ(a.guard_hits, b.guard_hits);
  EXPECT_EQ(a.guard_holds, b.guard_holds);
  EXPECT_EQ(a.removed, b.removed);
  expect_same_vectors(a.position, b.position);
  expect_same_vectors(a.velocity, b.velocity);
  expect_same_vectors(a.owed, b.owed);
  expect_same_vectors(a.cloth_position, b.cloth_position);
  expect_same_vectors(a.cloth_velocity, b.cloth_velocity);
  expect_same_vectors(a.shell_landed, b.shell_landed);
  expect_same_vectors(a.shell_rounding, b.shell_rounding);
  expect_same_vectors(a.shell_left, b.shell_left);
  expect_same_vectors(a.shell_lost, b.shell_lost);
  expect_same_vectors(a.shell_acceleration, b.shell_acceleration);
  expect_same_vectors(a.shell_friction, b.shell_friction);
  expect_same_vectors(a.shell_internal, b.shell_internal);
  EXPECT_EQ(a.shell_dt, b.shell_dt);
  EXPECT_EQ(a.cloth_wetness, b.cloth_wetness);
}

/// After so many steps of dt s; of the largest stable size if it is 0. @param start  Shot or Scene.
template <class Start>
sim::HostState after(const Start& start, int steps, double dt = 0) {
  Stepper run(start);
  for (int k = 0; k < steps; ++k) dt > 0 ? run.step(dt) : run.step();
  return run.solver->save();
}

template <class Start>
void expect_same_bits_on_threads(const Start& start, int steps, double dt = 0) {
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 16);
  std::vector<sim::HostState> state;
  for (const int threads : {1, 2, 16}) {
    tbb::task_arena arena(threads);
    arena.execute([&] { state.push_back(after(start, steps, dt)); });
  }
  expect_same_state(state[0], state[1]);
  expect_same_state(state[0], state[2]);
}

/// A run that is taken up where half of the steps are done. @param dt  s, 0: the largest stable
template <class Start>
void expect_same_bits_when_resumed(const Start& start, int steps, double dt) {
  Stepper first(start), second(start);
  const auto step = [&](Stepper& run) { dt > 0 ? run.step(dt) : run.step(); };
  for (int k = 0; k < steps / 2; ++k) step(first);
  second.load(first.solver->save(), first.limits, first.time, first.scene.rest.state());
  for (int k = steps / 2; k < steps; ++k) step(second);
  expect_same_state(after(start, steps, dt), second.solver->save());
}

}  // namespace drench::sim_tests
