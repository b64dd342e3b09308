#include "sim/passes/pressure/closed_domain.h"

#include "sim/passes/pressure/pressure_kick.h"
#include "sim/passes/pressure/pressure_rows.h"
#include "sim/passes/pressure/pressure_solve.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// -D^T q with neighbours a time `lag` (s) back, into PressureState::scratch_b: a displacement, as
/// what the solve leaves in PressureState::scratch_a. Walls, obstacles and cloth act as there.
void find_kick(State& state, float lag) {
  FluidState& f = state.fluid;
  PressureState& s = state.pressure;
  const Parameters& p = state.parameters;
  const ConstVecView v = f.velocity.view();
  const Float4* displacement = s.scratch_a.data();
  Float4* velocity = s.scratch_b.data();
  const float inverse_dt = float(1 / state.dt), h = p.support_radius;
  parallel_for(
      state.queue, "kick: velocities", f.count, DRENCH_LAMBDA(int i) {
        const Vec3<float> u = v[i];
        const Float4 d = displacement[i];
        velocity[i] = {u.x + inverse_dt * d.x, u.y + inverse_dt * d.y, u.z + inverse_dt * d.z, 1.f};
      });
  for_each_neighbour(state.queue, "kick: mean way", s.lists, f.count,
                     MeanDisplacement{s.scratch_b.data(), s.mean_displacement.data(), lag});
  with_separation(p, [&](auto separation) {
    for_each_neighbour(state.queue, "kick", s.lists, f.count,
                       EarlierAcceleration<decltype(separation)>{
                           .place = s.place.data(),
                           .displacement = s.mean_displacement.data(),
                           .correction = s.correction.data(),
                           .correction_cross = s.correction_cross.data(),
                           .wall = s.wall.data(),
                           .kick = s.scratch_b.data(),
                           .scale = gradient_scale(p) * WendlandC2::slope(1.f),
                           .inverse_h2 = 1.f / (h * h),
                           .separation = separation});
  });
}

/// First guess: the pressures of the last step less their mean. No divergence asks for a mean where
/// there is no free surface, and hardly any takes it back: left to itself it grows to 0.15 of the
/// friction in Couette's channel, and what a sheared packing answers to it bends the profile.
void start_without_mean(State& state) {
  start_from_last_step(state);
  Float4* place = state.pressure.place.data();
  float* before = state.pressure.before.data();
  SolveControl* control = state.pressure.control.data();
  const int n = state.fluid.count;
  reduce_then(
      state.queue, "full: mean pressure", n, 0.0,
      DRENCH_LAMBDA(int i) { return double(before[i]); }, Plus{},
      DRENCH_LAMBDA(double sum) { control->mean = float(sum / n); });
  parallel_for(
      state.queue, "full: first guess", n,
      DRENCH_LAMBDA(int i) { place[i].w = before[i] = before[i] - control->mean; });
}

/// Velocities free of divergence at the places that they predict, and positions with them.
void project_velocities(State& state, const Mover& move) {
  FluidState& f = state.fluid;
  PressureState& s = state.pressure;
  const float dt = float(state.dt), inverse_dt = 1.f / dt;
  const VecView x = f.position.view(), v = f.velocity.view();
  Float4* vector = s.scratch_a.data();
  float *source = s.source.data(), *product = s.product.data();
  parallel_for(
      state.queue, "full: velocities", f.count, DRENCH_LAMBDA(int i) {
        const Vec3<float> u = v[i];
        vector[i] = {dt * u.x, dt * u.y, dt * u.z, 0.f};
      });
  begin_solve(state);
  density_rate(state);
  parallel_for(
      state.queue, "full: divergence", f.count, DRENCH_LAMBDA(int i) { source[i] = product[i]; });
  start_without_mean(state);
  find_pressures(state, any_pressure);
  keep_pressures(state);
  find_kick(state, 0.5f * dt);
  const Float4* kick = s.scratch_b.data();
  parallel_for(
      state.queue, "full: project", f.count, DRENCH_LAMBDA(int i) {
        const Float4 d = vector[i], k = kick[i];
        Vec3<float> change = Vec3<float>{d.x, d.y, d.z} * inverse_dt;
        x.set(i, move(x[i], change));
        v.set(i, v[i] + Vec3<float>{k.x, k.y, k.z} * inverse_dt);
      });
}

/// Positions of even density; adds to what PressureState::scratch_a has moved them by.
void even_out(State& state, const Mover& move) {
  FluidState& f = state.fluid;
  PressureState& s = state.pressure;
  const Parameters& p = state.parameters;
  const float dt = float(state.dt), inverse_dt = 1.f / dt, rest = p.rest_density;
  const VecView x = f.position.view();
  Float4 *vector = s.scratch_a.data(), *shift = s.scratch_b.data(), *diagonal = s.correction.data(),
         *cross = s.correction_cross.data();
  float *source = s.source.data(), *product = s.product.data(), *density = f.density.data();
  with_separation(p, [&](auto separation) {
    for_each_neighbour(
        state.queue, "full: relaxation", s.lists, f.count,
        Relaxation<decltype(separation)>{s.place.data(), s.wall.data(), shift, separation});
  });
  parallel_for(
      state.queue, "full: relax", f.count, DRENCH_LAMBDA(int i) {
        const Float4 d = vector[i], e = shift[i];
        Vec3<float> change = Vec3<float>{e.x, e.y, e.z} * inverse_dt;
        x.set(i, move(x[i], change));
        vector[i] = {d.x + e.x, d.y + e.y, d.z + e.z, 0.f};
        diagonal[i] = {1.f, 1.f, 1.f, 0.f}, cross[i] = {0.f, 0.f, 0.f, 0.f};
      });
  begin_next_solve(state);
  density_rate(state);
  parallel_for(
      state.queue, "full: density", f.count,
      DRENCH_LAMBDA(int i) { source[i] = density[i] - rest + product[i]; });
  invert_diagonal(state);
  start_from_nothing(state);
  find_pressures(state, any_pressure);
  parallel_for(
      state.queue, "full: move", f.count, DRENCH_LAMBDA(int i) {
        const Float4 d = vector[i];
        Vec3<float> change = Vec3<float>{d.x, d.y, d.z} * inverse_dt;
        x.set(i, move(x[i], change));
      });
}

}  // namespace

void project_closed_domain(State& state) {
  const Mover move = mover_of(state.parameters, float(state.dt));
  project_velocities(state, move);
  even_out(state, move);
}

}  // namespace drench::sim::DRENCH_BACKEND
