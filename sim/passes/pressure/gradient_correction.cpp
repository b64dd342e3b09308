#include "sim/passes/pressure/gradient_correction.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// L of each M by itself, where nothing boils: the domain is full (closed_domain.h).
void correct_alone(State& state) {
  PressureState& s = state.pressure;
  const Float4 *moment = s.scratch_a.data(), *cross = s.scratch_b.data();
  Float4 *own = s.correction.data(), *own_cross = s.correction_cross.data();
  parallel_for(
      state.queue, "neighbours: own correction", state.fluid.count,
      DRENCH_LAMBDA(int i) { invert_moments(moment[i], cross[i], own[i], own_cross[i]); });
}

}  // namespace

void correct_gradients(State& state) {
  PressureState& s = state.pressure;
  const Parameters& p = state.parameters;
  const float h = p.support_radius;
  const float scale = p.particle_mass / p.rest_density / p.lattice_sum / (h * h * h * h * h);
  with_separation(p, [&](auto separation) {
    for_each_neighbour(state.queue, "neighbours: moments", s.lists, state.fluid.count,
                       GradientMoments<decltype(separation)>{.place = s.place.data(),
                                                             .wall = s.wall.data(),
                                                             .density = state.fluid.density.data(),
                                                             .diagonal = s.scratch_a.data(),
                                                             .cross = s.scratch_b.data(),
                                                             .scale = scale,
                                                             .least = 0.95f * p.rest_density,
                                                             .separation = separation});
  });
  if (p.full) return correct_alone(state);
  for_each_neighbour(state.queue, "neighbours: correction", s.lists, state.fluid.count,
                     GradientCorrection{s.scratch_a.data(), s.scratch_b.data(), s.wall.data(),
                                        s.correction.data(), s.correction_cross.data()});
}

}  // namespace drench::sim::DRENCH_BACKEND
