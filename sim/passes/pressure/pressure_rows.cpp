#include "sim/passes/pressure/pressure_rows.h"

namespace drench::sim::DRENCH_BACKEND {

void accelerate_by_pressure(State& state) {
  PressureState& s = state.pressure;
  with_separation(state.parameters, [&](auto separation) {
    for_each_neighbour(
        state.queue, "pressure: acceleration", s.lists, state.fluid.count,
        PressureAcceleration<decltype(separation)>{.place = s.place.data(),
                                                   .correction = s.correction.data(),
                                                   .correction_cross = s.correction_cross.data(),
                                                   .own_acceleration = s.scratch_b.data(),
                                                   .vector = s.scratch_a.data(),
                                                   .done = &s.control.data()->done,
                                                   .scale = gradient_scale(state.parameters),
                                                   .separation = separation});
  });
}

void density_rate(State& state) {
  PressureState& s = state.pressure;
  with_separation(state.parameters, [&](auto separation) {
    for_each_neighbour(
        state.queue, "pressure: density rate", s.lists, state.fluid.count,
        DensityRate<decltype(separation)>{.place = s.place.data(),
                                          .vector = s.scratch_a.data(),
                                          .correction = s.correction.data(),
                                          .correction_cross = s.correction_cross.data(),
                                          .wall = s.wall.data(),
                                          .rate = s.product.data(),
                                          .done = &s.control.data()->done,
                                          .scale = gradient_scale(state.parameters),
                                          .separation = separation});
  });
}

void invert_diagonal(State& state) {
  PressureState& s = state.pressure;
  with_separation(state.parameters, [&](auto separation) {
    using Separation = decltype(separation);
    const InverseDiagonal<Separation> pass{.place = s.place.data(),
                                           .correction = s.correction.data(),
                                           .correction_cross = s.correction_cross.data(),
                                           .wall = s.wall.data(),
                                           .own_acceleration = s.scratch_b.data(),
                                           .inverse = s.inverse_diagonal.data(),
                                           .scale = gradient_scale(state.parameters),
                                           .separation = separation};
    if (state.contact.near > 0)
      for_each_neighbour(state.queue, "neighbours: diagonal", s.lists, state.fluid.count, pass);
    else
      for_each_neighbour(state.queue, "neighbours: diagonal", s.lists, state.fluid.count,
                         EvenInverseDiagonal<Separation>{pass, s.next.data()});
  });
}

}  // namespace drench::sim::DRENCH_BACKEND
