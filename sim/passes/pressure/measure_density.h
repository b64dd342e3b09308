#pragma once
// Density of the incompressible fluid at the positions it has, for whoever looks between steps: the
// lists of a step belong to its predicted positions. Moves nothing and changes no order.

#include "sim/neighbours/sort_particles.h"
#include "sim/passes/obstacle/obstacle_density.h"

namespace drench::sim::DRENCH_BACKEND {

struct MeasuredDensity {
  static constexpr int columns = 3;
  static constexpr bool costly = false;
  ConstVecView position;  // sorted by cell
  const int* order;       // where each stands in the state
  float* density;         // kg/m^3, in the order of the state
  float support_radius, scale, rest_density;
  ImageWalls walls;
  ObstacleDensity law;
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
    const WallDensity walled = law.with(walls.density(position[i]), obstacles, position[i]);
    density[order[i]] = scale * sum.w + rest_density * walled.value;
  }
};

void measure_density(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
