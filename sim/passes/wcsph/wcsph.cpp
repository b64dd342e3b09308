#include "sim/passes/wcsph/wcsph.h"

#include "sim/passes/coupling/cloth_filter.h"
#include "sim/passes/wcsph/density.h"
#include "sim/passes/wcsph/pressure_viscosity.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

GridView grid_of(const State& state) { return {state.fluid.grid, state.fluid.cell_start.data()}; }

template <class Kernel>
DensitySum<Kernel> density_pass(State& state) {
  const Parameters& p = state.parameters;
  FluidState& f = state.fluid;
  return {f.position.view(),
          f.cloth_share.size() ? f.cloth_share.data() : nullptr,
          f.density.data(),
          f.pressure_term.data(),
          f.inverse_density.data(),
          p.support_radius,
          p.particle_mass * Kernel::factor(p.support_radius) / p.lattice_sum,
          p.rest_density,
          p.sound_speed * p.sound_speed,
          halfspace_walls_of(p)};
}

}  // namespace

void sum_density(State& state) {
  if (state.cloth.triangles == 0) {
    for_each_pair("density", grid_of(state), state.fluid.count, density_pass<Spiky>(state));
  } else if (state.parameters.paper) {
    for_each_pair("density", grid_of(state), state.fluid.count, density_pass<Poly6>(state));
  } else {
    for_each_pair("density", grid_of(state), state.fluid.count, density_pass<Spiky>(state),
                  sheet_filter(state, state.fluid.position.view(), Shaded::near));
  }
}

void pressure_viscosity(State& state) {
  const Parameters& p = state.parameters;
  FluidState& f = state.fluid;
  const PressureViscosity pass{f.position.view(),
                               f.velocity.view(),
                               f.pressure_term.data(),
                               f.inverse_density.data(),
                               f.acceleration.view(),
                               p.support_radius,
                               p.particle_mass * spiky_gradient_factor(p.support_radius),
                               p.dynamic_viscosity,
                               p.wall_viscosity,
                               p.rest_density,
                               {p.gravity[0], p.gravity[1], p.gravity[2]},
                               halfspace_walls_of(p)};
  if (state.cloth.triangles > 0 && !p.paper) {
    for_each_pair("pressure and viscosity", grid_of(state), f.count, pass,
                  sheet_filter(state, state.fluid.position.view(), Shaded::hidden));
  } else {
    for_each_pair("pressure and viscosity", grid_of(state), f.count, pass);
  }
}

void integrate_velocity(State& state) {
  FluidState& f = state.fluid;
  const VecView v = f.velocity.view();
  const ConstVecView a = f.acceleration.view();
  const float dt = float(state.dt);
  parallel_for(
      "integrate velocity", f.count, DRENCH_LAMBDA(int i) { v.set(i, v[i] + a[i] * dt); });
}

}  // namespace drench::sim::DRENCH_BACKEND
