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
  return {.position = f.position.view(),
          .cloth_density = f.cloth_density.size() ? f.cloth_density.data() : nullptr,
          .density = f.density.data(),
          .pressure_term = f.pressure_term.data(),
          .inverse_density = f.inverse_density.data(),
          .support_radius = p.support_radius,
          .scale = p.particle_mass * Kernel::factor(p.support_radius) / p.lattice_sum,
          .rest_density = p.rest_density,
          .sound_speed2 = p.sound_speed * p.sound_speed,
          .walls = halfspace_walls_of(p)};
}

}  // namespace

void sum_density(State& state) {
  if (state.cloth.triangles == 0) {
    for_each_pair(state.queue, "density", grid_of(state), state.fluid.count,
                  density_pass<Spiky>(state));
  } else if (state.parameters.paper) {
    for_each_pair(state.queue, "density", grid_of(state), state.fluid.count,
                  density_pass<Poly6>(state));
  } else {
    for_each_pair(state.queue, "density", grid_of(state), state.fluid.count,
                  density_pass<Spiky>(state),
                  cloth_filter(state, state.fluid.position.view(), Shaded::near));
  }
}

void pressure_viscosity(State& state) {
  const Parameters& p = state.parameters;
  FluidState& f = state.fluid;
  const PressureViscosity pass{.position = f.position.view(),
                               .velocity = f.velocity.view(),
                               .pressure_term = f.pressure_term.data(),
                               .inverse_density = f.inverse_density.data(),
                               .acceleration = f.acceleration.view(),
                               .support_radius = p.support_radius,
                               .scale = p.particle_mass * spiky_gradient_factor(p.support_radius),
                               .dynamic_viscosity = p.dynamic_viscosity,
                               .wall_viscosity = p.wall_viscosity,
                               .rest_density = p.rest_density,
                               .gravity = {p.gravity[0], p.gravity[1], p.gravity[2]},
                               .walls = halfspace_walls_of(p)};
  if (state.cloth.triangles > 0 && !p.paper) {
    for_each_pair(state.queue, "pressure and viscosity", grid_of(state), f.count, pass,
                  cloth_filter(state, state.fluid.position.view(), Shaded::hidden));
  } else {
    for_each_pair(state.queue, "pressure and viscosity", grid_of(state), f.count, pass);
  }
}

void integrate_velocity(State& state) {
  FluidState& f = state.fluid;
  const VecView v = f.velocity.view();
  const ConstVecView a = f.acceleration.view();
  const float dt = float(state.dt);
  parallel_for(
      state.queue, "integrate velocity", f.count,
      DRENCH_LAMBDA(int i) { v.set(i, v[i] + a[i] * dt); });
}

}  // namespace drench::sim::DRENCH_BACKEND
