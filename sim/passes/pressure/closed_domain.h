#pragma once
// The step of a fluid that fills a closed domain. Nothing there can boil: velocities and positions
// are solved for one after the other, both with pressures of either sign. Velocities are made free
// of divergence by rows that are exact for every particle in linear flows; then particles relax
// towards an even arrangement (Fickian shifting: Lind, Xu, Stansby, Rogers 2012) and a second
// solve, which velocities do not feel, makes the density even. With free surfaces the same makes
// waves of the packing (docs/benchmarks.md). With one solve Taylor and Green's vortices decayed 11
// % too fast at 50 particles to the side.

#include "sim/passes/coupling/move.h"
#include "sim/passes/pressure/pressure_kick.h"
#include "sim/passes/pressure/pressure_solve.h"

namespace drench::sim::DRENCH_BACKEND {

/// Down the gradient of the summed density, except beside walls: what a wall adds to it is known
/// for where a lattice would stand only, and with it a crowded box took 100 iterations a step in
/// place of 16 (half of what it pushes in the solve) or stayed 0.3 % denser (all of it).
template <class Separation>
struct Relaxation {
  static constexpr int columns = 1;
  static constexpr float strength = 0.5f;  // of the way to the middle of the neighbours
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

/// First guess: the pressures of the last step less their mean. No divergence asks for a mean where
/// there is no free surface, and hardly any takes it back: left to itself it grew to 0.15 of the
/// friction in Couette's channel, and what a sheared packing answers to it bent the profile by 2.5
/// %.
inline void start_without_mean(State& state) {
  start_from_last_step(state);
  Float4* place = state.pressure.place.data();
  float* before = state.pressure.before.data();
  SolveControl* control = state.pressure.control.data();
  const int n = state.fluid.count;
  reduce_then(
      "full: mean pressure", n, 0.0, DRENCH_LAMBDA(int i) { return double(before[i]); },
      AddDoubles{}, DRENCH_LAMBDA(double sum) { control->mean = float(sum / n); });
  parallel_for(
      "full: first guess", n,
      DRENCH_LAMBDA(int i) { place[i].w = before[i] = before[i] - control->mean; });
}

/// Velocities free of divergence at the places that they predict, and positions with them.
inline void project_velocities(State& state, const Mover& move) {
  FluidState& f = state.fluid;
  PressureState& s = state.pressure;
  const float dt = float(state.dt), inverse_dt = 1.f / dt;
  const VecView x = f.position.view(), v = f.velocity.view();
  Float4* vector = s.vector.data();
  float *source = s.source.data(), *product = s.product.data();
  parallel_for(
      "full: velocities", f.count, DRENCH_LAMBDA(int i) {
        const Vec3<float> u = v[i];
        vector[i] = {dt * u.x, dt * u.y, dt * u.z, 0.f};
      });
  begin_solve(s);
  density_rate(state);
  parallel_for(
      "full: divergence", f.count, DRENCH_LAMBDA(int i) { source[i] = product[i]; });
  start_without_mean(state);
  find_pressures(state, any_pressure);
  keep_pressures(state);
  find_kick(state, 0.5f * dt);
  const Float4* kick = s.push.data();
  parallel_for(
      "full: project", f.count, DRENCH_LAMBDA(int i) {
        const Float4 d = vector[i], k = kick[i];
        Vec3<float> change = Vec3<float>{d.x, d.y, d.z} * inverse_dt;
        x.set(i, move(x[i], change));
        v.set(i, v[i] + Vec3<float>{k.x, k.y, k.z} * inverse_dt);
      });
}

/// Positions of even density; adds to what PressureState::vector has moved them by.
inline void even_out(State& state, const Mover& move) {
  FluidState& f = state.fluid;
  PressureState& s = state.pressure;
  const Parameters& p = state.parameters;
  const float dt = float(state.dt), inverse_dt = 1.f / dt, rest = p.rest_density;
  const VecView x = f.position.view();
  Float4 *vector = s.vector.data(), *shift = s.push.data(), *diagonal = s.correction.data(),
         *cross = s.correction_cross.data();
  float *source = s.source.data(), *product = s.product.data(), *density = f.density.data();
  with_separation(p, [&](auto separation) {
    for_each_neighbour(
        "full: relaxation", s.lists, f.count,
        Relaxation<decltype(separation)>{s.place.data(), s.wall.data(), shift, separation});
  });
  parallel_for(
      "full: relax", f.count, DRENCH_LAMBDA(int i) {
        const Float4 d = vector[i], e = shift[i];
        Vec3<float> change = Vec3<float>{e.x, e.y, e.z} * inverse_dt;
        x.set(i, move(x[i], change));
        vector[i] = {d.x + e.x, d.y + e.y, d.z + e.z, 0.f};
        diagonal[i] = {1.f, 1.f, 1.f, 0.f}, cross[i] = {0.f, 0.f, 0.f, 0.f};
      });
  begin_next_solve(s);
  density_rate(state);
  parallel_for(
      "full: density", f.count,
      DRENCH_LAMBDA(int i) { source[i] = density[i] - rest + product[i]; });
  invert_diagonal(state);
  start_from_nothing(state);
  find_pressures(state, any_pressure);
  parallel_for(
      "full: move", f.count, DRENCH_LAMBDA(int i) {
        const Float4 d = vector[i];
        Vec3<float> change = Vec3<float>{d.x, d.y, d.z} * inverse_dt;
        x.set(i, move(x[i], change));
      });
}

inline void project_full_box(State& state) {
  const Mover move = mover_of(state.parameters, float(state.dt));
  project_velocities(state, move);
  even_out(state, move);
}

}  // namespace drench::sim::DRENCH_BACKEND
