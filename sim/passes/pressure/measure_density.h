#pragma once
// Density of the incompressible fluid at the positions it has, for whoever looks between steps: the
// lists of a step belong to its predicted positions. Moves nothing and changes no order.

#include "sim/neighbours/sort_particles.h"
#include "sim/passes/obstacle/obstacle_share.h"

namespace drench::sim::DRENCH_BACKEND {

struct MeasuredDensity {
  static constexpr int columns = 3;
  static constexpr bool costly = false;
  VecView position;  // sorted by cell
  const int* order;  // where each stands in the state
  float* density;    // kg/m^3, in the order of the state
  float support_radius, scale, rest_density;
  ImageWalls walls;
  ObstacleShare law;
  ObstacleViews obstacles;

  DRENCH_HD Inputs<3> inputs() const { return {{position.x, position.y, position.z}}; }
  template <class T>
  struct Particle {
    Vec3<T> position;
  };
  template <class T>
  struct Sum {
    T w{0.f};
  };
  template <class T>
  DRENCH_HD void pair(const Particle<T>& i, const Particle<T>& j, Sum<T>& sum) const {
    sum.w = sum.w + WendlandC2::shape(length2(i.position - j.position), T(support_radius));
  }
  DRENCH_HD void finish(int i, const Sum<float>& sum) const {
    const WallShare share = law.with(walls.share(position[i]), obstacles, position[i]);
    density[order[i]] = scale * sum.w + rest_density * share.value;
  }
};

inline void measure_density(State& state) {
  FluidState& f = state.fluid;
  const Parameters& p = state.parameters;
  sort_by_cell(state);
  f.density.clear_bytes(0);  // lost particles have none
  const VecView x = f.position.view(),
                sorted{state.pressure.before.data(), state.pressure.next.data(),
                       state.pressure.product.data()};
  const int* order = f.order.data();
  parallel_for(
      "measure: sort", f.count, DRENCH_LAMBDA(int i) { sorted.set(i, x[order[i]]); });
  for_each_pair(
      "measure: density", {f.grid, f.cell_start.data()}, f.count,
      MeasuredDensity{sorted, order, f.density.data(), p.support_radius,
                      p.particle_mass / p.lattice_sum * WendlandC2::factor(p.support_radius),
                      p.rest_density, image_walls_of(p), obstacle_share_of(p),
                      state.obstacles.views()});
}

}  // namespace drench::sim::DRENCH_BACKEND
