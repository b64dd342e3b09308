// Case sheet_cost: a pool on a pinned sheet against the same pool on a floor, what coupling costs
// the incompressible fluid. Case sheet_curtain: a curtain between two pools against the static
// solution of its own springs.

#include <cmath>
#include <string>

#include "tests/bench/step_cost.h"
#include "tests/sim/support.h"
#include "tests/validation/curtain.h"

namespace drench::bench {
namespace {

void sheet_cost(const Emit& emit) {
  const PoolCost cost = cost_of({64, 16, 90}, Where::cpu, 5, 40);
  for (const bool sheet : {true, false}) {
    const PoolCost::One& one = sheet ? cost.sheet : cost.floor;
    Line line;
    line.method = sheet ? "on " + std::to_string(cost.polygons) + " polygons" : "on a floor";
    line.resolution = std::to_string(cost.particles) + " particles";
    line.time_step = one.dt;
    line.threads = hardware_threads();
    line.cost = one.total;
    line.more["cpu_ms_a_step"] = 1e3 * one.step;
    line.more["iterations_a_step"] = one.iterations;
    line.more["sweeps_a_step"] = one.sweeps;
    if (sheet) line.more["coupling_cost_percent"] = 100 * (cost.ratio - 1);
    double bytes = 0;
    for (const sim::ColumnMemory& group : one.memory) bytes += double(group.bytes);
    line.more["bytes_a_particle"] = bytes / cost.particles;
    emit(line);
  }
}

struct Hung {
  double most = 0, expected = 0;  // m, deflection: mean of the last quarter; the springs' own
  int particles = 0, steps = 0;
};
Hung hang(int layers, double right) {
  constexpr double end = 1;  // s
  sim_tests::Stepper run(validation::curtain_shot(layers, right));
  Hung hung;
  hung.expected = validation::static_deflection(run.scene, right);
  hung.particles = run.solver->particles();
  const double plane = run.scene.start.cloth_position.x[0];
  double samples = 0;
  while (run.time < end) {
    run.step();
    if (run.limits.bad_particle >= 0 || run.limits.bad_vertex >= 0) return hung;
    if (run.time < 0.75 * end) continue;
    hung.most += validation::deflection_of(run.solver->save().cloth_position.x, plane).most;
    ++samples;
  }
  hung.most /= samples, hung.steps = run.steps;
  return hung;
}

void sheet_curtain(const Emit& emit) {
  for (const double right : {0., 0.5}) {
    for (const int layers : sizes({8, 16, 24}, 2)) {
      Hung hung;
      Line line;
      line.cost = measure([&] { hung = hang(layers, right); });
      const double depth = validation::curtain_pool;
      line.method =
          "pools of " + std::to_string(depth) + " and " + std::to_string(right * depth) + " m";
      line.resolution =
          std::to_string(hung.particles) + " particles, " + std::to_string(layers) + " layers";
      line.threads = hardware_threads();
      line.error = std::abs(hung.most / hung.expected - 1), line.gate = 0.05;
      line.error_of = "deflection over that of the springs under both hydrostatic loads, less 1";
      line.more["deflection_mm"] = 1e3 * hung.most;
      line.more["springs_mm"] = 1e3 * hung.expected;
      line.more["steps"] = hung.steps;
      emit(line);
    }
  }
}

const Registration cost{"sheet_cost", "what a sheet under a pool costs the incompressible fluid",
                        sheet_cost};
const Registration curtain{"sheet_curtain",
                           "a curtain between two pools: time and error of its deflection",
                           sheet_curtain, InQuick::yes};

}  // namespace
}  // namespace drench::bench
