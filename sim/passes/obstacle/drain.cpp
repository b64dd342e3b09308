#include "sim/passes/obstacle/drain.h"

#include "sim/backend/parallel.h"

namespace drench::sim::DRENCH_BACKEND {

void mark_drained(State& state, int first_key) {
  const ObstacleViews sinks = state.sinks.views();
  const ConstVecView x = state.fluid.position.view();
  int* cell = state.fluid.cell.data();
  parallel_for(
      state.queue, "fluid in sinks", state.fluid.count, DRENCH_LAMBDA(int i) {
        const Vec3<float> q = x[i];
        for (int k = sinks.count - 1; k >= 0; --k) {
          const ObstacleView& sink = sinks.obstacle[k];
          if (!sink.near_path(q, q, 0.f)) continue;
          if (sink.distance(sink.to_own(1, q), sink.blend[1]) < 0.f) cell[i] = first_key + k;
        }
      });
}

void drop_removed(State& state) {
  FluidState& f = state.fluid;
  const int cells = f.grid.cells(), sinks = state.sinks.count, before = f.count;
  f.count = value_at(f.cell_start, cells);
  if (f.count == before) return;
  int begin = f.count;
  for (int k = 0; k < sinks; ++k) {
    const int end = value_at(f.cell_start, cells + k + 1);
    state.removed[k] += uint64_t(end - begin);
    begin = end;
  }
  state.removed.back() += uint64_t(before - begin);
}

}  // namespace drench::sim::DRENCH_BACKEND
