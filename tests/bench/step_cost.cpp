#include "tests/bench/step_cost.h"

#include <algorithm>
#include <stdexcept>

#include "tests/sim/support.h"

namespace drench::bench {

const char* name_of(Where where) { return where == Where::cpu ? "cpu" : "cuda"; }

bool has_cuda(const Emit& emit) {
  std::string reason = "this build has no CUDA";
#if defined(DRENCH_HAS_CUDA)
  if (sim::cuda::device_available(reason)) return true;
#endif
  Line line;
  line.device = name_of(Where::cuda);
  line.more["skipped"] = "no usable GPU: " + reason;
  emit(line);
  return false;
}

std::unique_ptr<sim::Solver> make_solver(const sim::Parameters& parameters,
                                         const sim::ClothTopology& cloth, Where where) {
#if defined(DRENCH_HAS_CUDA)
  if (where == Where::cuda) return sim::cuda::make_solver(parameters, cloth);
#endif
  if (where == Where::cuda) throw std::logic_error("this build has no CUDA");
  return sim::cpu::make_solver(parameters, cloth);
}

sim::Stepper make_stepper(sim::Scene scene, Where where) {
  std::unique_ptr<sim::Solver> solver = make_solver(scene.parameters, scene.cloth, where);
  return {std::move(scene), std::move(solver)};
}

double take_stable_step(sim::Stepper& run) {
  const double dt = run.stable_limit().dt;
  run.step(dt);
  if (run.limits.bad_particle >= 0 || run.limits.bad_vertex >= 0) throw BlowUp(run.time);
  return dt;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + long(values.size() / 2), values.end());
  return values[values.size() / 2];
}

double seconds(const Measured& cost, Where where) {
  return where == Where::cpu ? cost.cpu_s : cost.wall_s;
}

void add(Measured& total, const Measured& cost) {
  total.wall_s += cost.wall_s, total.cpu_s += cost.cpu_s;
  total.peak_mib = std::max(total.peak_mib, cost.peak_mib);
}

Shot pool_shot(const Pool& pool, Bottom bottom) {
  constexpr double width = 0.64;  // m
  Shot shot = sim_tests::empty_shot();
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = width / pool.side;
  shot.domain.min = V3d(-width / 2, bottom == Bottom::floor ? 0 : -0.5, -width / 2);
  shot.domain.max = V3d(width / 2, 1, width / 2);
  shot.domain.axis = {Axis::walls, Axis::walls, Axis::walls};
  double surface = 0;
  if (bottom == Bottom::sheet) {
    Cloth& sheet = sim_tests::add_sheet(shot, width, 0, pool.cells);
    sheet.areal_density = 0.2, sheet.retardation_time = 0.005, sheet.thickness = 1e-3;
    sheet.adjacent_stiffness = 6000, sheet.diagonal_stiffness = 3000;
    sim_tests::pin_edges(sheet);
    surface = sheet.thickness / 2;
  }
  sim_tests::add_box(shot, V3d(-width / 2, surface, -width / 2),
                     {pool.side, pool.depth, pool.side});
  return shot;
}

PoolCost cost_of(const Pool& pool, Where where, int warm, int steps) {
  sim::Stepper runs[2] = {make_stepper(sim::build_scene(pool_shot(pool, Bottom::sheet)), where),
                          make_stepper(sim::build_scene(pool_shot(pool, Bottom::floor)), where)};
  PoolCost result;
  PoolCost::One* ones[2] = {&result.sheet, &result.floor};
  std::vector<double> took[2], ratio;
  for (int s = 0; s < warm + steps; ++s) {
    double pair[2];
    for (const int k : {0, 1}) {
      double dt = 0;
      const Measured cost = measure([&] { dt = take_stable_step(runs[k]); });
      if (s < warm) continue;
      took[k].push_back(pair[k] = seconds(cost, where));
      ones[k]->dt += dt / steps;
      ones[k]->iterations += double(runs[k].limits.iterations) / steps;
      ones[k]->sweeps += double(runs[k].limits.sheet_sweeps) / steps;
      add(ones[k]->total, cost);
    }
    if (s >= warm) ratio.push_back(pair[0] / pair[1]);
  }
  for (const int k : {0, 1})
    ones[k]->step = median(took[k]), ones[k]->memory = runs[k].solver->memory();
  result.ratio = median(ratio);
  result.particles = runs[0].solver->particles();
  result.polygons = runs[0].scene.cloth.triangles();
  return result;
}

}  // namespace drench::bench
