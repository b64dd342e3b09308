#pragma once
// The step of a fluid that fills a closed domain. Nothing there can boil: velocities and positions
// are solved for one after the other, both with pressures of either sign. Velocities are made free
// of divergence by rows that are exact for every particle in linear flows; then particles relax
// towards an even arrangement (Fickian shifting: Lind, Xu, Stansby, Rogers 2012) and a second
// solve, which velocities do not feel, makes the density even. With free surfaces the same makes
// waves of the packing (docs/decisions/0005-closed-domain.md).

#include "sim/passes/coupling/collision_rounds.h"
#include "sim/passes/pressure/pressure_kick.h"
#include "sim/passes/pressure/pressure_solve.h"

namespace drench::sim::DRENCH_BACKEND {

/// Down the gradient of the summed density, except beside walls: what a wall adds to it is known
/// for where a lattice would stand only, and with it a crowded box takes all the iterations there
/// are, or stays denser (docs/decisions/0005-closed-domain.md).
template <class Separation>
struct Relaxation {
  static constexpr int columns = 1;
  static constexpr float strength = 0.5f;  // of the way from the mean of the neighbours
  const Float4 *place, *wall;
  Float4* shift;  // m
  Separation separation;

  DRENCH_HD bool idle() const { return false; }
  DRENCH_HD Columns<1> inputs() const { return {{place}}; }
  template <class Q>
  struct Particle {
    Q place;
  };
  template <class Q>
  struct Sum {
    Q shift, weight;
  };
  template <class T>
  DRENCH_HD T weight(T u) const {
    return WendlandC2::slope(u);
  }
  template <class Q>
  DRENCH_HD void pair(const Particle<Q>& i, const Particle<Q>& j, Q weight, Sum<Q>& sum) const {
    sum.shift = multiply_add(weight, separation(i.place, j.place), sum.shift);
    sum.weight = sum.weight + weight;
  }
  DRENCH_HD void finish(int i, const Sum<Float4>& sum) const {
    const Float4 d = sum.shift;
    const float all = sum.weight.x, f = all > 0.f && wall[i].w == 0.f ? strength / all : 0.f;
    shift[i] = {f * d.x, f * d.y, f * d.z, 0.f};
  }
};

void project_closed_domain(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
