// What the solver says its columns take.

#include <gtest/gtest.h>
#include <malloc.h>

#include <string>

#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

size_t allocated_by_process() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

double sum(const std::vector<sim::ColumnMemory>& groups) {
  double bytes = 0;
  for (const sim::ColumnMemory& group : groups) bytes += double(group.bytes);
  return bytes;
}

// Against the heap's own count, with every group that a pool on a sheet has. Tiles of threads and
// buckets of maps are in the count as well: 3 %.
TEST(Memory, OfAllColumnsIsWhatTheHeapGave) {
  Shot shot = empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.solver = FluidSolver::incompressible;
  shot.fluid.kinematic_viscosity = 1e-2;
  add_box(shot, V3d(-0.2, 0.005, -0.2), {40, 25, 40});
  pin_edges(add_sheet(shot, 0.5, 0, 50));
  const sim::Scene scene = sim::build_scene(shot);
  const size_t before = allocated_by_process();
  const auto solver = sim::cpu::make_solver(scene.parameters, scene.cloth);
  solver->load(scene.start);
  for (int k = 0; k < 3; ++k) solver->step(1e-3, 1);
  const double heap = double(allocated_by_process() - before), told = sum(solver->memory());
  EXPECT_NEAR(told, heap, 0.03 * heap);
}

// What an incompressible fluid alone takes: lists, and 10 columns of 4 bytes and 6 of 16, the
// ends of columns and the cells.
TEST(Memory, OfFluidAloneIsThatOfItsColumns) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible;
  add_box(shot, V3d(0), {30, 30, 30});
  Stepper run(shot);
  run.step(1e-3);
  double lists = 0;
  for (const sim::ColumnMemory& group : run.solver->memory()) {
    if (group.name == "neighbour lists") lists = double(group.bytes);
  }
  EXPECT_GT(lists, 0);
  EXPECT_NEAR((sum(run.solver->memory()) - lists) / (30 * 30 * 30), 165, 3);
  // Of 33 neighbours in a lattice five blocks of 36 bytes, where they begin and how many, a
  // sixteenth to grow, and what threads leave of the pieces they take.
  EXPECT_LT(lists / (30 * 30 * 30), 1.1 * (5 * 36 + 8));
}

/// Bytes that the solver tells of so many shells of 2 x 2 cells.
double of_shells(int count) {
  Shot shot = empty_shot();
  for (int k = 0; k < count; ++k) {
    Cloth& sheet = add_sheet(shot, 0.1, 0.01 * k, 2);
    sheet.name = "sheet" + std::to_string(k);
    sheet.model = ClothModel::shell;
  }
  return sum(Stepper(shot).solver->memory());
}

// Aggregates of the coarse levels of one sheet begin where those of the ones before end.
TEST(Memory, OfManyShellsIsThatOfEach) { EXPECT_LT(of_shells(16), 1.2 * 4 * of_shells(4)); }

}  // namespace
}  // namespace drench::sim_tests
