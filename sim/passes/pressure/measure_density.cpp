#include "sim/passes/pressure/measure_density.h"

namespace drench::sim::DRENCH_BACKEND {

void measure_density(State& state) {
  FluidState& f = state.fluid;
  const Parameters& p = state.parameters;
  sort_by_cell(state);
  f.density.clear_bytes(state.queue, 0);  // lost particles have none
  const ConstVecView x = f.position.view();
  const VecView sorted{state.pressure.before.data(), state.pressure.next.data(),
                       state.pressure.product.data()};
  const int* order = f.order.data();
  parallel_for(
      state.queue, "measure: sort", f.count, DRENCH_LAMBDA(int i) { sorted.set(i, x[order[i]]); });
  for_each_pair(state.queue, "measure: density", {f.grid, f.cell_start.data()}, f.count,
                MeasuredDensity{
                    .position = sorted,
                    .order = order,
                    .density = f.density.data(),
                    .support_radius = p.support_radius,
                    .scale = p.particle_mass / p.lattice_sum * WendlandC2::factor(p.support_radius),
                    .rest_density = p.rest_density,
                    .walls = image_walls_of(p),
                    .law = obstacle_density_of(p),
                    .obstacles = state.obstacles.views()});
}

}  // namespace drench::sim::DRENCH_BACKEND
