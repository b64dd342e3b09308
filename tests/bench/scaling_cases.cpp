// Cases fluid_scaling (CPU) and fluid_gpu (CUDA): what a particle costs the incompressible solver,
// from thousands of particles to millions. The cube of water of fluid_dam_64k, some steps into its
// collapse. Solves are made to take 10 and 30 iterations, in turns and from the same state: the
// difference is what iterations cost, the rest is the step's.

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "tests/bench/step_cost.h"

namespace drench::bench {
namespace {

/// A cube of 1 m at one end of a tank of 3 x 2 x 1 m, `side` particles along an edge.
Shot column_shot(int side) {
  Shot shot;
  shot.name = shot.file = "column";
  shot.fluid.spacing = 1.0 / side;
  shot.fluid.solver = FluidSolver::incompressible;
  shot.domain.min = V3d(0), shot.domain.max = V3d(3, 2, 1);
  shot.fluid.box = {{V3d(0), V3d(1), V3d(0)}};
  return shot;
}

struct Cost {
  std::vector<double> step, iteration;  // s a particle: a step of 30 iterations; one iteration
  Measured total;
  std::vector<sim::ColumnMemory> memory;
};

/// One scene with both numbers of iterations.
class Pair {
 public:
  Pair(int side, Where where) : scene(sim::build_scene(column_shot(side))), where_(where) {
    constexpr int warm = 4;
    for (const int k : {0, 1}) {
      sim::Parameters p = scene.parameters;
      p.tolerance = 0, p.most_iterations = k == 0 ? few : many;  // no residual is 0
      solver_[k] = make_solver(p, scene.cloth, where);
      solver_[k]->load(scene.start);
    }
    dt_ = 0.5 * sim::stable_step(scene.parameters, solver_[1]->measure()).dt;
    for (int s = 0; s < warm; ++s) solver_[1]->step(dt_, 1);
  }
  /// A step with few and one with many iterations from the same state.
  void round(Cost& cost) {
    solver_[0]->load(solver_[1]->save());
    const auto one = [&](int k) { return measure([&] { (void)solver_[k]->step(dt_, 1); }); };
    const Measured a = one(0), b = one(1);
    const double n = solver_[1]->particles();
    cost.step.push_back(seconds(b, where_) / n);
    cost.iteration.push_back((seconds(b, where_) - seconds(a, where_)) / (many - few) / n);
    add(cost.total, a), add(cost.total, b);
    cost.memory = solver_[1]->memory();
  }

  const sim::Scene scene;
  static constexpr int few = 10, many = 30;

 private:
  Where where_;
  std::unique_ptr<sim::Solver> solver_[2];
  double dt_ = 0;  // s
};

Line line_of(const sim::Scene& scene, Where where, const Cost& cost) {
  const double n = double(scene.start.id.size());
  Line line;
  line.method = "incompressible, 30 iterations a step";
  line.resolution = std::to_string(scene.start.id.size()) + " particles";
  line.device = name_of(where);
  line.threads = hardware_threads();
  line.cost = cost.total;
  const double step = median(cost.step), iteration = median(cost.iteration);
  line.more["ns_a_particle_iteration"] = 1e9 * iteration;
  line.more["ns_a_particle_step"] = 1e9 * step;
  line.more["ns_a_particle_step_less_iterations"] = 1e9 * (step - Pair::many * iteration);
  double bytes = 0;
  for (const sim::ColumnMemory& one : cost.memory) {
    bytes += double(one.bytes);
    line.more["bytes"][one.name] = double(one.bytes) / n;
  }
  line.more["bytes_a_particle"] = bytes / n;
  return line;
}

/// Sizes take turns with the smallest, so that what else the machine does falls on both.
void fluid_scaling(const Emit& emit) {
  constexpr int smallest = 40;
  Pair reference(smallest, Where::cpu);
  for (const int side : sizes({smallest, 63, 100, 159}, 2)) {
    Pair pair(side, Where::cpu);
    Cost cost;
    std::vector<double> ratio;
    const int rounds = side > 120 ? 3 : 7, turns = side > 63 ? 4 : 1;
    for (int r = 0; r < rounds; ++r) {
      Cost now;
      for (int t = 0; t < turns; ++t) reference.round(now);
      pair.round(cost);
      for (int t = 0; t < turns; ++t) reference.round(now);
      ratio.push_back(cost.iteration.back() / median(now.iteration));
    }
    Line line = line_of(pair.scene, Where::cpu, cost);
    line.error = median(ratio) - 1, line.gate = 0.2;
    line.error_of = "CPU time of a particle in an iteration over that of 64,000 beside it, less 1";
    emit(line);
  }
}

/// The pool of the seed's size and a larger one, and what a sheet under it costs.
void gpu_pool(const Pool& pool, const Emit& emit) {
  const PoolCost cost = cost_of(pool, Where::cuda, 5, 40);
  Line line;
  line.method = "pool on a sheet of " + std::to_string(cost.polygons) + " polygons";
  line.resolution = std::to_string(cost.particles) + " particles";
  line.time_step = cost.sheet.dt;
  line.device = name_of(Where::cuda);
  line.cost = cost.sheet.total;
  line.more["us_a_step"] = 1e6 * cost.sheet.step;
  line.more["us_a_step_on_a_floor"] = 1e6 * cost.floor.step;
  line.more["iterations_a_step"] = cost.sheet.iterations;
  line.more["iterations_a_step_on_a_floor"] = cost.floor.iterations;
  line.more["sweeps_a_step"] = cost.sheet.sweeps;
  line.more["coupling_cost_percent"] = 100 * (cost.ratio - 1);
  emit(line);
}

/// Rates of a GPU: the bar from a million particles on, and what the memory of an H200 (4.3 TB/s)
/// bounds the rate at.
struct Rate {
  const char* name;
  double bar, roof;  // 1/s
};
constexpr Rate iterations{"particle_iterations_per_s", 3e9, 11e9},
    weak_steps{"particle_steps_per_s", 1.5e9, 6e9};

void add_rate(Line& line, const Rate& rate, double value, double particles) {
  line.more[rate.name] = value, line.more["of_roofline"] = value / rate.roof;
  if (particles < 1e6) return;
  line.error = rate.bar / value, line.gate = 1;
  line.error_of = "the rate that is needed over the one reached";
}

void gpu_column(int side, const Emit& emit) {
  Pair pair(side, Where::cuda);
  Cost cost;
  for (int r = 0; r < 7; ++r) pair.round(cost);
  Line line = line_of(pair.scene, Where::cuda, cost);
  const double n = double(pair.scene.start.id.size());
  line.more["us_a_step"] = 1e6 * median(cost.step) * n;
  add_rate(line, iterations, 1 / median(cost.iteration), n);
  emit(line);
}

/// The same column, weakly compressible.
void weak_column(int side, Where where, const Emit& emit) {
  Shot shot = column_shot(side);
  shot.fluid.solver = FluidSolver::weakly_compressible;
  sim::Stepper run = make_stepper(sim::build_scene(shot), where);
  const auto steps = [&](int count) {
    for (int k = 0; k < count; ++k) take_stable_step(run);
  };
  steps(5);
  std::vector<double> step;
  Line line;
  line.cost = Measured{};
  for (int r = 0; r < 7; ++r) {
    const Measured now = measure([&] { steps(10); });
    step.push_back(seconds(now, where) / 10), add(*line.cost, now);
  }
  const double n = double(run.scene.start.id.size());
  line.method = "weakly compressible";
  line.resolution = std::to_string(run.scene.start.id.size()) + " particles";
  line.device = name_of(where), line.threads = hardware_threads();
  line.more["us_a_step"] = 1e6 * median(step);
  if (where == Where::cuda) add_rate(line, weak_steps, n / median(step), n);
  emit(line);
}

void fluid_gpu(const Emit& emit) {
  if (!has_cuda(emit)) return;
  for (const int side : {40, 100, 200}) gpu_column(side, emit);
  for (const int side : {40, 100, 200}) weak_column(side, Where::cuda, emit);
  for (const Pool& pool : {Pool{64, 16, 90}, Pool{128, 64, 180}}) gpu_pool(pool, emit);
}

const Registration gpu{"fluid_gpu", "the same on a CUDA device to 8M, and coupling there",
                       fluid_gpu};
const Registration scaling{"fluid_scaling", "time and memory of a particle from 64k to 4M",
                           [](const Emit& emit) {
                             fluid_scaling(emit);
                             for (const int side : {40, 100}) weak_column(side, Where::cpu, emit);
                           }};

}  // namespace
}  // namespace drench::bench
