#include "sim/neighbours/sort_particles.h"

#include "sim/columns.h"
#include "sim/passes/motion/domain_walls.h"
#include "sim/passes/obstacle/drain.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

template <class T>
void permute(Queue& queue, Column<T>& column, Column<T>& spare, const int* order, int n) {
  const T* from = column.data();
  T* to = spare.data();
  parallel_for(
      queue, "permute", n, DRENCH_LAMBDA(int i) { to[i] = from[order[i]]; });
  column.swap(spare);
}
void permute(Column<float>& column, State& state, const int* order, int n) {
  permute(state.queue, column, state.swap_float, order, n);
}
/// The cells of particles are of no use any more.
void permute(Column<int>& column, State& state, const int* order, int n) {
  permute(state.queue, column, state.fluid.cell, order, n);
}
void permute(VecColumn& column, State& state, const int* order, int n) {
  for (Column<float>* c : {&column.x, &column.y, &column.z}) permute(*c, state, order, n);
}

}  // namespace

void sort_by_cell(State& state) {
  FluidState& f = state.fluid;
  const Parameters& p = state.parameters;
  const int n = f.count;
  const ConstVecView x = f.position.view();
  // Past an open side of the domain by more than a support a particle is lost: it sorts behind all,
  // and the grid ends there, however far it flies.
  const DomainWalls domain = domain_walls(p);
  const Vec3<float> support{p.support_radius, p.support_radius, p.support_radius},
      lower = Vec3<float>{domain.low[0], domain.low[1], domain.low[2]} - support,
      upper = Vec3<float>{domain.high[0], domain.high[1], domain.high[2]} + support;
  Bounds box = bounds_of_points(state.queue, "fluid bounds", x, n);
  const auto clamped = [&](Vec3<float> q) {
    return Vec3<float>{minimum(maximum(q.x, lower.x), upper.x),
                       minimum(maximum(q.y, lower.y), upper.y),
                       minimum(maximum(q.z, lower.z), upper.z)};
  };
  box = {clamped(box.low), clamped(box.high)};
  const Vec3<float> period = periods_of(p);
  if (period.x > 0.f) box.low.x = domain.low[0];
  if (period.y > 0.f) box.low.y = domain.low[1];
  if (period.z > 0.f) box.low.z = domain.low[2];
  f.grid = make_grid_shape(box.low, box.high, p.support_radius, period);
  const GridShape grid = f.grid;
  const int lost = grid.cells(), sinks = state.sinks.count;
  int* cell = f.cell.data();
  parallel_for(
      state.queue, "fluid cells", n, DRENCH_LAMBDA(int i) {
        const Vec3<float> q = x[i];
        const bool inside = q.x >= lower.x && q.x <= upper.x && q.y >= lower.y && q.y <= upper.y &&
                            q.z >= lower.z && q.z <= upper.z;
        cell[i] = inside ? grid.cell(q) : lost + sinks;
      });
  if (state.sinks.count > 0) mark_drained(state, lost);
  stable_sort_keys(state.queue, f.cell, n, lost + state.sinks.count, f.order, f.cell_start);
}

void sort_particles(State& state) {
  FluidState& f = state.fluid;
  const Parameters& p = state.parameters;
  const int n = f.count;
  sort_by_cell(state);
  const int* order = f.order.data();
  for_each_fluid_column(state, [&](const ColumnInfo& info, auto& column, auto) {
    const bool lasts = info.extent == Extent::particles && info.use != Use::rebuilt;
    if (lasts && size_of(column) > 0) permute(column, state, order, n);
  });
  bool open = false;
  for (int k = 0; k < 3; ++k) open |= !p.wall[k] && !p.periodic[k];
  if (open || state.sinks.count > 0) drop_removed(state);
}

}  // namespace drench::sim::DRENCH_BACKEND
