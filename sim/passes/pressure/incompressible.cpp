#include "sim/passes/pressure/incompressible.h"

#include "sim/passes/obstacle/obstacle_guard.h"
#include "sim/passes/pressure/gradient_correction.h"
#include "sim/passes/pressure/pressure_rows.h"

namespace drench::sim::DRENCH_BACKEND {

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
  if (state.cloth.vertices > 0 && !all_sheets_sleep(state)) settle_cloth(state);
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
  all_sheets_sleep(state) ? keep_cloth(state) : finish_cloth(state);
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

void predict_around_obstacles(State& state) { predict_with(state, obstacle_guard_of(state, 0)); }

void project_around_obstacles(State& state) { project_with(state, obstacle_guard_of(state, 1)); }

}  // namespace drench::sim::DRENCH_BACKEND
