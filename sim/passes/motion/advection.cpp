#include "sim/passes/motion/advection.h"

#include "sim/passes/cloth/cloth_obstacles.h"
#include "sim/passes/motion/mover.h"

namespace drench::sim::DRENCH_BACKEND {

void move_particles(State& state) {
  FluidState& f = state.fluid;
  const VecView x = f.position.view(), v = f.velocity.view();
  const Mover mover = mover_of(state.parameters, float(state.dt));
  for_each_lane(
      state.queue, "move particles", f.count, DRENCH_LAMBDA(auto i) {
        auto velocity = v.at(i);
        x.put(i, mover(x.at(i), velocity));
        v.put(i, velocity);
      });
}

void finish_substep(ClothState& c) {
  c.position.swap(c.next);
  c.velocity.swap(c.next_velocity);
}

void move_cloth(State& state) {
  const float dt = float(state.dt / state.substeps);
  for (int s = 0; s < state.substeps; ++s) {
    cloth_verlet(state, cloth_buffers(state.cloth), dt);
    finish_substep(state.cloth);
  }
}

}  // namespace drench::sim::DRENCH_BACKEND
