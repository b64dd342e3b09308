#include "sim/passes/pressure/velocity_smoothing.h"

namespace drench::sim::DRENCH_BACKEND {

void smooth_velocities(State& state) {
  const Parameters& p = state.parameters;
  PressureState& s = state.pressure;
  const VecView v = state.fluid.velocity.view();
  Float4* vector = s.scratch_a.data();
  parallel_for(
      state.queue, "smoothing: velocities", state.fluid.count, DRENCH_LAMBDA(int i) {
        vector[i] = {v.x[i], v.y[i], v.z[i], 0.f};
      });
  const float fraction =
      p.xsph + (smoothing_takes_viscosity(p, state.dt) ? smoothing_of_viscosity(p, state.dt) : 0.f);
  const float h = p.support_radius, volume = gradient_scale(p) / p.rest_density;  // over h^5
  for_each_neighbour(state.queue, "smoothing", s.lists, state.fluid.count,
                     VelocitySmoothing{vector, v, fraction * volume * h * h});
}

}  // namespace drench::sim::DRENCH_BACKEND
