#include "sim/passes/motion/measure_limits.h"

#include "sim/backend/parallel.h"
#include "sim/passes/cloth/shell_system.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

struct JoinLimits {
  DRENCH_HD Limits operator()(const Limits& a, const Limits& b) const {
    Limits joined = a;
    joined.max_speed = a.max_speed > b.max_speed ? a.max_speed : b.max_speed;
    joined.max_acceleration =
        a.max_acceleration > b.max_acceleration ? a.max_acceleration : b.max_acceleration;
    joined.bad_particle = first(a.bad_particle, b.bad_particle);
    joined.bad_vertex = first(a.bad_vertex, b.bad_vertex);
    return joined;
  }
  /// The smaller index, whatever the order of the reduction; -1 is none.
  DRENCH_HD static int first(int a, int b) { return a < 0 || (b >= 0 && b < a) ? b : a; }
};

}  // namespace

Limits measure_limits(const State& state) {
  const Parameters& p = state.parameters;
  const FluidState& f = state.fluid;
  // Twenty times the speed of sound is no flow but a blow-up; NaN fails the comparison as well.
  const float absurd = p.fluid ? 20.f * p.sound_speed : 1e4f;
  const ConstVecView v = f.velocity.view(), a = f.acceleration.view(),
                     cv = state.cloth.velocity.view();
  const bool accelerated = f.acceleration.x.size() > 0;  // the incompressible solver keeps none
  Limits limits;
  if (f.count > 0) {
    limits = parallel_reduce(
        state.queue, "limits: fluid", f.count, Limits{},
        DRENCH_LAMBDA(int i) {
          const float speed = length(v[i]), push = accelerated ? length(a[i]) : 0.f;
          Limits one;
          if (!(speed < absurd) || !(push < 1e30f)) {
            one.bad_particle = i;
          } else {
            one.max_speed = speed, one.max_acceleration = push;
          }
          return one;
        },
        JoinLimits{});
  }
  if (state.cloth.vertices > 0) {
    const Limits cloth = parallel_reduce(
        state.queue, "limits: cloth", state.cloth.vertices, Limits{},
        DRENCH_LAMBDA(int i) {
          const float speed = length(cv[i]);
          Limits one;
          if (speed < absurd) {
            one.max_speed = speed;
          } else {
            one.bad_vertex = i;
          }
          return one;
        },
        JoinLimits{});
    limits = JoinLimits{}(limits, cloth);
    if (state.shell.any)
      limits.bad_vertex = JoinLimits::first(limits.bad_vertex, overstretched_vertex(state));
  }
  return limits;
}

}  // namespace drench::sim::DRENCH_BACKEND
