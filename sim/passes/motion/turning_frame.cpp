#include "sim/passes/motion/turning_frame.h"

#include "sim/passes/motion/mover.h"

namespace drench::sim::DRENCH_BACKEND {

void wrap_positions(State& state) {
  const Mover mover = mover_of(state.parameters, 0.f);
  const VecView x = state.fluid.position.view();
  parallel_for(
      state.queue, "wrap", state.fluid.count,
      DRENCH_LAMBDA(int i) { x.set(i, mover.wrapped(x[i])); });
}

void turn_frame(State& state) {
  const TurningFrame turn = turning_frame_of(state);
  const ConstVecView x = state.fluid.position.view();
  const VecView v = state.fluid.velocity.view();
  const ConstVecView cloth = state.cloth.position.view();
  const VecView speed = state.cloth.velocity.view();
  const float* inverse_mass = state.cloth.inverse_mass.data();
  parallel_for(
      state.queue, "turning frame", state.fluid.count,
      DRENCH_LAMBDA(int i) { v.set(i, turn(x[i], v[i])); });
  parallel_for(
      state.queue, "turning frame: cloth", state.cloth.vertices, DRENCH_LAMBDA(int i) {
        if (inverse_mass[i] > 0.f) speed.set(i, turn(cloth[i], speed[i]));
      });
}

}  // namespace drench::sim::DRENCH_BACKEND
