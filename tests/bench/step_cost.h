#pragma once
// What steps of the incompressible solver cost on either device: scenes and measurements that
// several cases share.

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim/setup/scene.h"
#include "sim/solver.h"
#include "sim/stepper.h"
#include "tests/bench/bench.h"

namespace drench::bench {

enum class Where { cpu, cuda };
const char* name_of(Where where);
/// Whether steps can be taken on a CUDA device; where not, emits a line that says why.
bool has_cuda(const Emit& emit);
std::unique_ptr<sim::Solver> make_solver(const sim::Parameters& parameters,
                                         const sim::ClothTopology& cloth, Where where);
sim::Stepper make_stepper(sim::Scene scene, Where where);
struct BlowUp : std::runtime_error {
  explicit BlowUp(double at)
      : runtime_error("blew up at t = " + std::to_string(at) + " s"), time(at) {}
  double time;  // s
};
/// One step as long as it may be. @return its length, s. @throws BlowUp.
double take_stable_step(sim::Stepper& run);

double median(std::vector<double> values);
/// Of the device's clock, s: CPU seconds of all threads, or wall seconds beside a GPU.
double seconds(const Measured& cost, Where where);
void add(Measured& total, const Measured& cost);

enum class Bottom { floor, sheet };
/// A pool of side x depth x side particles in a shaft of 0.64 m: on the shaft's floor, or on a
/// sheet of cotton pinned to its walls, of cells x cells cells.
struct Pool {
  int side, depth, cells;
};
Shot pool_shot(const Pool& pool, Bottom bottom);

/// The pool's first steps on a sheet and on a floor, in turns, each as long as it may be.
struct PoolCost {
  struct One {
    double step = 0;                    // s of the device's clock, median
    double dt = 0;                      // s, mean
    double iterations = 0, sweeps = 0;  // means, a step
    std::vector<sim::ColumnMemory> memory;
    Measured total;
  } sheet, floor;
  double ratio = 0;  // of a step on the sheet to one on the floor, median over pairs of steps
  int particles = 0, polygons = 0;
};
PoolCost cost_of(const Pool& pool, Where where, int warm, int steps);

}  // namespace drench::bench
