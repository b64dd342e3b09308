#pragma once
// Whole states compared, every column and count.

#include <gtest/gtest.h>

#include "sim/solver.h"

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
}

}  // namespace drench::sim_tests
