// The same bits far from the origin and for any number of threads, where sheets are hit hard.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "tests/sim/same_state.h"
#include "tests/stress/report.h"
#include "tests/stress/scenes.h"

namespace drench::stress_tests {
namespace {

/// A fast block on a cotton sheet, moved by `shift` m.
Shot splash(V3d shift) {
  Shot shot = fall_on_sheet(100);
  shot.domain.min += shift, shot.domain.max += shift;
  shot.fluid.box[0].min += shift, shot.fluid.box[0].max += shift;
  shot.fluid.box[0].velocity = V3d(1, -10, 0.5);
  shot.cloth[0].corner += shift;
  return shot;
}

/// Numbers that differ, of all columns that the next step reads.
size_t differences(const sim::HostState& a, const sim::HostState& b) {
  size_t count = 0;
  const auto compare = [&](const auto& x, const auto& y) {
    if (x.size() != y.size()) ++count;
    for (size_t i = 0; i < std::min(x.size(), y.size()); ++i) count += !(x[i] == y[i]);
  };
  const auto compare_vectors = [&](const sim::HostVec& x, const sim::HostVec& y) {
    compare(x.x, y.x), compare(x.y, y.y), compare(x.z, y.z);
  };
  compare(a.id, b.id), compare(a.memory_triangle, b.memory_triangle);
  compare(a.memory_side, b.memory_side), compare(a.pressure_term, b.pressure_term);
  compare_vectors(a.position, b.position), compare_vectors(a.velocity, b.velocity);
  compare_vectors(a.owed, b.owed), compare_vectors(a.cloth_position, b.cloth_position);
  compare_vectors(a.cloth_velocity, b.cloth_velocity);
  return count;
}

TEST(Bits, AreTheSameFarFromTheOrigin) {
  const int steps = long_form() ? 1000 : 80;
  const sim::HostState here = after(splash(V3d(0)), steps);
  for (const V3d& shift : {V3d(1e4, 0, 0), V3d(-1e4, 1e4, 1e4), V3d(9e4, -9e4, 9e4)}) {
    const size_t off = differences(here, after(splash(shift), steps));
    report("far from origin", fmt::format("({:g}, {:g}, {:g}) m", shift.x, shift.y, shift.z),
           off == 0, fmt::format("{} numbers differ after {} steps", off, steps));
  }
}

TEST(Bits, AreTheSameForAnyNumberOfThreads) {
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 16);
  const int steps = long_form() ? 1000 : 80;
  std::vector<sim::HostState> state;
  for (const int threads : {1, 2, 16}) {
    tbb::task_arena arena(threads);
    arena.execute([&] { state.push_back(after(splash(V3d(0)), steps)); });
  }
  const size_t off = differences(state[0], state[1]) + differences(state[0], state[2]);
  report("determinism", "1, 2, 16 threads", off == 0,
         fmt::format("{} numbers differ after {} steps", off, steps));
}

}  // namespace
}  // namespace drench::stress_tests
