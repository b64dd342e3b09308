#include "sim/passes/pressure/incompressible.h"

#include "sim/passes/obstacle/obstacle_guard.h"
#include "sim/passes/pressure/closed_domain.h"
#include "sim/passes/pressure/gradient_correction.h"
#include "sim/passes/pressure/measure_density.h"
#include "sim/passes/pressure/pressure_kick.h"
#include "sim/passes/pressure/pressure_rows.h"
#include "sim/passes/pressure/velocity_smoothing.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// L of each M by itself, where nothing boils: the domain is full (closed_domain.h).
void correct_alone(State& state) {
  PressureState& s = state.pressure;
  const Float4 *moment = s.scratch_a.data(), *cross = s.scratch_b.data();
  Float4 *own = s.correction.data(), *own_cross = s.correction_cross.data();
  parallel_for(
      state.queue, "neighbours: own correction", state.fluid.count,
      DRENCH_LAMBDA(int i) { invert_moments(moment[i], cross[i], own[i], own_cross[i]); });
}

}  // namespace

void correct_gradients(State& state) {
  PressureState& s = state.pressure;
  const Parameters& p = state.parameters;
  const float h = p.support_radius;
  const float scale = p.particle_mass / p.rest_density / p.lattice_sum / (h * h * h * h * h);
  with_separation(p, [&](auto separation) {
    for_each_neighbour(state.queue, "neighbours: moments", s.lists, state.fluid.count,
                       GradientMoments<decltype(separation)>{.place = s.place.data(),
                                                             .wall = s.wall.data(),
                                                             .density = state.fluid.density.data(),
                                                             .diagonal = s.scratch_a.data(),
                                                             .cross = s.scratch_b.data(),
                                                             .scale = scale,
                                                             .least = 0.95f * p.rest_density,
                                                             .separation = separation});
  });
  if (p.full) return correct_alone(state);
  for_each_neighbour(state.queue, "neighbours: correction", s.lists, state.fluid.count,
                     GradientCorrection{s.scratch_a.data(), s.scratch_b.data(), s.wall.data(),
                                        s.correction.data(), s.correction_cross.data()});
}

void accelerate_by_pressure(State& state) {
  PressureState& s = state.pressure;
  with_separation(state.parameters, [&](auto separation) {
    for_each_neighbour(
        state.queue, "pressure: acceleration", s.lists, state.fluid.count,
        PressureAcceleration<decltype(separation)>{.place = s.place.data(),
                                                   .correction = s.correction.data(),
                                                   .correction_cross = s.correction_cross.data(),
                                                   .own_acceleration = s.scratch_b.data(),
                                                   .vector = s.scratch_a.data(),
                                                   .done = &s.control.data()->done,
                                                   .scale = gradient_scale(state.parameters),
                                                   .separation = separation});
  });
}

void density_rate(State& state) {
  PressureState& s = state.pressure;
  with_separation(state.parameters, [&](auto separation) {
    for_each_neighbour(
        state.queue, "pressure: density rate", s.lists, state.fluid.count,
        DensityRate<decltype(separation)>{.place = s.place.data(),
                                          .vector = s.scratch_a.data(),
                                          .correction = s.correction.data(),
                                          .correction_cross = s.correction_cross.data(),
                                          .wall = s.wall.data(),
                                          .rate = s.product.data(),
                                          .done = &s.control.data()->done,
                                          .scale = gradient_scale(state.parameters),
                                          .separation = separation});
  });
}

namespace {

/// Of D D^T, and InverseDiagonal::own_acceleration in PressureState::scratch_b; where there may be
/// levels EvenInverseDiagonal::even as well, in PressureState::next until an iteration.
void invert_diagonal(State& state) {
  PressureState& s = state.pressure;
  with_separation(state.parameters, [&](auto separation) {
    using Separation = decltype(separation);
    const InverseDiagonal<Separation> pass{.place = s.place.data(),
                                           .correction = s.correction.data(),
                                           .correction_cross = s.correction_cross.data(),
                                           .wall = s.wall.data(),
                                           .own_acceleration = s.scratch_b.data(),
                                           .inverse = s.inverse_diagonal.data(),
                                           .scale = gradient_scale(state.parameters),
                                           .separation = separation};
    if (state.contact.near > 0)
      for_each_neighbour(state.queue, "neighbours: diagonal", s.lists, state.fluid.count, pass);
    else
      for_each_neighbour(state.queue, "neighbours: diagonal", s.lists, state.fluid.count,
                         EvenInverseDiagonal<Separation>{pass, s.next.data()});
  });
}

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

}  // namespace

void smooth_velocities(State& state) {
  const Parameters& p = state.parameters;
  PressureState& s = state.pressure;
  const VecView v = state.fluid.velocity.view();
  Float4* vector = s.scratch_a.data();
  parallel_for(
      state.queue, "smoothing: velocities", state.fluid.count, DRENCH_LAMBDA(int i) {
        vector[i] = {v.x[i], v.y[i], v.z[i], 0.f};
      });
  const float fraction =
      p.xsph + (smoothing_takes_viscosity(p, state.dt) ? smoothing_of_viscosity(p, state.dt) : 0.f);
  const float h = p.support_radius, volume = gradient_scale(p) / p.rest_density;  // over h^5
  for_each_neighbour(state.queue, "smoothing", s.lists, state.fluid.count,
                     VelocitySmoothing{vector, v, fraction * volume * h * h});
}

namespace {

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

namespace {

/// Symplectic Euler as if there were no pressure; `move(x, v)` is where a particle ends up.
template <class Move>
void predict_with(State& state, const Move& move) {
  FluidState& f = state.fluid;
  const Parameters& p = state.parameters;
  const float dt = float(state.dt);
  const VecView x = f.position.view(), v = f.velocity.view(), start = f.start.view();
  const Vec3<float> kick{dt * p.gravity[0], dt * p.gravity[1], dt * p.gravity[2]};
  const bool keep = f.start.x.size() > 0;  // sheets stand where they stood
  const Vec3<float> period = periods_of(p);
  parallel_for(
      state.queue, "predict", f.count, DRENCH_LAMBDA(int i) {
        Vec3<float> velocity = v[i] + kick;
        const Vec3<float> to = move(x[i], velocity);
        if (keep) start.set(i, image_beside(x[i], to, period));
        x.set(i, to);
        v.set(i, velocity);
      });
}

}  // namespace

void predict_particles(State& state) {
  predict_with(state, mover_of(state.parameters, float(state.dt)));
}

void find_neighbours(State& state) {
  const Parameters& p = state.parameters;
  FluidState& f = state.fluid;
  PressureState& s = state.pressure;
  const ConstVecView x = f.position.view();
  const ImageWalls walls = image_walls_of(p);
  const float h = p.support_radius, mass = p.particle_mass / p.lattice_sum;
  float *density = f.density.data(), *source = s.source.data();
  Float4 *place = s.place.data(), *wall = s.wall.data();
  const float rest = p.rest_density;
  parallel_for(
      state.queue, "neighbours: walls", f.count, DRENCH_LAMBDA(int i) {
        const WallDensity walled = walls.density(x[i]);
        place[i] = {x.x[i], x.y[i], x.z[i], 0.f};
        wall[i] = {rest * walled.gradient.x, rest * walled.gradient.y, rest * walled.gradient.z,
                   rest * walled.value};
      });
  if (p.obstacles > 0) add_obstacle_density(state);
  const bool sheets = state.contact.near > 0;
  if (sheets) add_cloth_to_walls(state);
  const float scale = mass / (h * h * h);
  const GridView grid{f.grid, f.cell_start.data()};
  const auto add_up = DRENCH_LAMBDA(int i, float sum) {
    density[i] = scale * sum + wall[i].w;
    source[i] = density[i] - rest;
  };
  if (sheets) {
    build_neighbour_lists<WendlandC2>(state.queue, grid, f.count, x, h, s.lists, add_up,
                                      cloth_filter(state, f.start.view(), Shaded::near));
  } else {
    build_neighbour_lists<WendlandC2>(state.queue, grid, f.count, x, h, s.lists, add_up);
  }
  correct_gradients(state);
  invert_diagonal(state);
  if (sheets) limit_recovery(state);
}

namespace {

/// Pressures, and what they do to positions and velocities.
template <class Move>
void project_with(State& state, const Move& move) {
  FluidState& f = state.fluid;
  solve_pressure(state);
  if (state.cloth.vertices > 0) settle_cloth(state);
  const VecView x = f.position.view(), v = f.velocity.view();
  const Float4* displacement = state.pressure.scratch_a.data();
  const float inverse_dt = float(1 / state.dt);
  parallel_for(
      state.queue, "project", f.count, DRENCH_LAMBDA(int i) {
        const Vec3<float> d{displacement[i].x, displacement[i].y, displacement[i].z};
        Vec3<float> change = d * inverse_dt;
        x.set(i, move(x[i], change));
        v.set(i, v[i] + change);
      });
}

}  // namespace

void project_density(State& state) {
  const float dt = float(state.dt);
  const bool paths = state.cloth.vertices > 0;  // that are not to break off at a seam
  project_with(state, paths ? path_mover_of(state.parameters, dt) : mover_of(state.parameters, dt));
}

void move_with_sheets(State& state) {
  FluidState& f = state.fluid;
  const float dt = float(state.dt);
  const VecView x = f.position.view();
  const ConstVecView v = f.velocity.view(), start = f.start.view();
  const VecView drift = f.drift.view(), end = f.end.view();
  finish_cloth(state);
  if (state.contact.near > 0) take_cloth_off_walls(state);
  parallel_for(
      state.queue, "sheets: paths", f.count, DRENCH_LAMBDA(int i) {
        const Vec3<float> from = start[i];
        drift.set(i, x[i] - from - v[i] * dt);
        end.set(i, x[i]);
        x.set(i, from);
      });
  move_coupled(state);
}

void measure_density(State& state) {
  FluidState& f = state.fluid;
  const Parameters& p = state.parameters;
  sort_by_cell(state);
  f.density.clear_bytes(state.queue, 0);  // lost particles have none
  const ConstVecView x = f.position.view();
  const VecView sorted{state.pressure.before.data(), state.pressure.next.data(),
                       state.pressure.product.data()};
  const int* order = f.order.data();
  parallel_for(
      state.queue, "measure: sort", f.count, DRENCH_LAMBDA(int i) { sorted.set(i, x[order[i]]); });
  for_each_pair(state.queue, "measure: density", {f.grid, f.cell_start.data()}, f.count,
                MeasuredDensity{
                    .position = sorted,
                    .order = order,
                    .density = f.density.data(),
                    .support_radius = p.support_radius,
                    .scale = p.particle_mass / p.lattice_sum * WendlandC2::factor(p.support_radius),
                    .rest_density = p.rest_density,
                    .walls = image_walls_of(p),
                    .law = obstacle_density_of(p),
                    .obstacles = state.obstacles.views()});
}

void predict_around_obstacles(State& state) { predict_with(state, obstacle_guard_of(state, 0)); }

void project_around_obstacles(State& state) { project_with(state, obstacle_guard_of(state, 1)); }

}  // namespace drench::sim::DRENCH_BACKEND
