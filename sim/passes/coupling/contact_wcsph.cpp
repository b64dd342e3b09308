#include "sim/passes/coupling/contact_wcsph.h"

namespace drench::sim::DRENCH_BACKEND {

void sort_wcsph_contacts(State& state) {
  // Faster than a quarter of the speed of sound nothing should come near.
  sort_contacts(state, 0.25f * state.parameters.sound_speed * float(state.dt));
}

namespace {

ContactSetup contact_setup(State& state) {
  FluidState& f = state.fluid;
  ClothState& c = state.cloth;
  const Parameters& p = state.parameters;
  const float beta = 0.5f * float(state.substeps + 1) / float(state.substeps);
  return {.near = near_list(state),
          .velocity = f.velocity.view(),
          .normal = f.normal.view(),
          .distance = f.cloth_distance.data(),
          .pressure_term = f.pressure_term.data(),
          .inverse_density = f.inverse_density.data(),
          .half_thickness = c.half_thickness.data(),
          .inverse_mass = c.inverse_mass.data(),
          .contact_weight = c.share.data(),
          .beta = beta,
          .dt = float(state.dt),
          .mass = p.particle_mass,
          .rest_density = p.rest_density,
          .sound_speed = p.sound_speed,
          .support_radius = p.support_radius,
          .contact_distance = contact_distance_of(p),
          .viscosity = p.dynamic_viscosity,
          .push_speed = 0.01f * p.sound_speed,
          .wall_scale = p.wall_scale};
}

}  // namespace

void solve_contacts(State& state) {
  if (state.contact.near == 0) return;
  ClothState& cloth = state.cloth;
  const ContactSetup setup = contact_setup(state);
  const ExactContacts c = exact_contacts(state);
  const NearView near = setup.near;
  const VecView predicted = cloth.predicted.view(), force = cloth.force.view(),
                velocity = state.fluid.velocity.view();
  const ConstVecView impulse = state.contact.impulse.view();
  const float *inverse_mass = cloth.inverse_mass.data(), *contact_weight = cloth.share.data();
  const float inverse_dt = 1.f / float(state.dt), inverse_particle_mass = 1.f / setup.mass;
  for_each_lane(
      state.queue, "contact: prepare", c.list.rows,
      DRENCH_LAMBDA(auto row) { setup.prepare(c, row); });
  for_each_lane(
      state.queue, "contact: soft", c.list.rows - c.list.soft_begin, DRENCH_LAMBDA(auto row) {
        update_contact(c, row + c.list.soft_begin, predicted, inverse_particle_mass, 1.f);
      });
  for (int iteration = 0; iteration < contact_iterations; ++iteration) {
    const float relaxation = iteration + 1 < contact_iterations ? over_relaxation : 1.f;
    for_each_lane(
        state.queue, "contact: particles", c.list.close, DRENCH_LAMBDA(auto row) {
          update_contact(c, row, predicted, inverse_particle_mass, relaxation);
        });
    sum_by_triangle(state, iteration == 0 ? Rows::all : Rows::close,
                    iteration > 1 ? IdleCorners::zero : IdleCorners::unset);
    // Reaction shared by barycentric weights (eqs 10, 11 mended), gathered in a fixed order.
    parallel_for(
        state.queue, "contact: vertices", cloth.vertices, DRENCH_LAMBDA(int v) {
          if (contact_weight[v] == 0.f) return;
          const Vec3<float> sum = near.sum_on_vertex(impulse, v);
          predicted.set(v, predicted[v] - sum * (setup.beta * inverse_mass[v]));
          force.set(v, force[v] - sum * inverse_dt);
        });
  }
  parallel_for(
      state.queue, "contact: velocities", c.list.rows, DRENCH_LAMBDA(int row) {
        if (c.list.particle[row] >= 0) velocity.set(c.list.particle[row], c.velocity[row]);
      });
}

}  // namespace drench::sim::DRENCH_BACKEND
