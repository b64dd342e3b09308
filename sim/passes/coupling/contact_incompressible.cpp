#include "sim/passes/coupling/contact_incompressible.h"

#include "sim/passes/cloth/cloth_pins.h"
#include "sim/passes/cloth/cloth_sweeps.h"

namespace drench::sim::DRENCH_BACKEND {

void add_cloth_to_walls(State& state) {
  const FluidState& f = state.fluid;
  const Parameters& p = state.parameters;
  const ContactRows c = contact_rows(state);
  const VecView gradient = state.contact.gradient.view();
  float *allowed = state.contact.recovery.data(), *compliance = state.contact.compliance.data(),
        *gaps = state.contact.gap.data(), *left_open = state.contact.open.data();
  const ConstVecView x = f.position.view(), start = f.start.view(), normal = f.normal.view(),
                     cloth_velocity = path_velocity_of(state);
  const float *distance = f.cloth_distance.data(), *edge = f.edge.data(),
              *half_thickness = state.cloth.half_thickness.data();
  const int* triangle = f.triangle.data();
  Float4* wall = state.pressure.wall.data();
  const float rest = p.rest_density, dt = float(state.dt);
  const ImageWalls walls = image_walls_of(p);
  const ObstacleDensity law = obstacle_density_of(p);
  const ObstacleViews obstacles = state.obstacles.views();
  const float recovery = dt * 0.1f * p.sound_speed;
  const ClothDensity blank{p.wall_scale, 1.f / p.support_radius, p.spacing, 0.f, 0.f};
  parallel_for(
      state.queue, "sheets: rows", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        gradient.set(row, {0.f, 0.f, 0.f});
        compliance[row] = 0.f;
        gaps[row] = 1e30f, left_open[row] = 1.f;
        if (i < 0 || edge[i] <= 0.f) return;
        const Vec3<float> n = normal[i], foot = c.at_foot(row, cloth_velocity) * dt;
        const float nearer = -dot(n, x[i] - start[i] - foot),
                    gap = distance[i] - half_thickness[triangle[i]] - nearer;
        ClothDensity density = blank;
        density.at(gap, edge[i]);
        WallDensity w = walls.density(x[i], n, gap);
        gaps[row] = gap, left_open[row] = max0(1.f - density.value);
        for (int k = 0; k < obstacles.count; ++k)
          w = law.both(w, law.seen(obstacles.obstacle[k], x[i], n, gap, walls));
        const float open = 1.f - w.value, left = max0(1.f - density.value);
        const Vec3<float> g = n * (rest * open * density.slope),
                          all = w.gradient * (rest * left) + g;
        gradient.set(row, g);
        allowed[row] = maximum(nearer + recovery, 0.1f * recovery);
        compliance[row] = squeeze * max0(-rest * left * dot(g, w.gradient));
        wall[i] = {all.x, all.y, all.z, rest * (1.f - open * (1.f - density.value))};
      });
}

void limit_recovery(State& state) {
  const ClothRows c = cloth_rows(state);
  float* source = state.pressure.source.data();
  const float* inverse_diagonal = state.pressure.inverse_diagonal.data();
  parallel_for(
      state.queue, "sheets: recovery", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        if (i < 0 || length2(c.gradient[row]) == 0.f || inverse_diagonal[i] == 0.f) return;
        source[i] = minimum(source[i], c.recovery[row] / sqrtf(inverse_diagonal[i]));
      });
}

namespace {

void sum_loads(State& state, Base base) {
  sum_by_triangle(state, Rows::all);
  const NearView near = near_list(state);
  const ConstVecView impulse = state.contact.impulse.view();
  const VecView right = state.cloth_system.right.view();
  const ConstVecView own = state.cloth_system.base.view();
  const float* contact_weight = state.cloth.share.data();
  const bool add = base == Base::own;
  parallel_for(
      state.queue, "sheets: loads", state.cloth.vertices, DRENCH_LAMBDA(int v) {
        Vec3<float> sum = add ? own[v] : Vec3<float>{0.f, 0.f, 0.f};
        if (contact_weight[v] > 0.f) sum = sum + near.sum_on_vertex(impulse, v);
        right.set(v, sum);
      });
}

/// m/s. Where a shell rests its forces are what rounding leaves of them, some 10 um/s a step; the
/// sweeps' tolerance counts from no less than this speed of the whole.
constexpr double quiet_speed = 1e-3;

/// r . A_block^-1 r of the right side, from which the sweeps' tolerance counts, with the levels of
/// the matrix, and with `speed` the kinetic energy, m (v dt)^2, of that. Into ClothSystem::residual
/// and scaled.
template <class Matrix>
void add_to_reference(State& state, const Matrix& matrix, const ConstVecView& of, float keep,
                      double speed) {
  ClothControl* control = state.cloth_system.control.data();
  const float* inertia = state.cloth_system.inertia.data();
  const double least = speed * speed * state.dt * state.dt;  // m^2
  const VecView residual = state.cloth_system.residual.view(),
                scaled = state.cloth_system.scaled.view();
  parallel_for(
      state.queue, "cloth: scaled right side", state.cloth.vertices, DRENCH_LAMBDA(int i) {
        const Vec3<float> r = matrix.moving(i, of[i]);
        residual.set(i, r), scaled.set(i, matrix.scaled(i, r));
      });
  add_cloth_levels(state, matrix);
  reduce_then(
      state.queue, "cloth: reference", state.cloth.vertices, 0.,
      DRENCH_LAMBDA(int i) { return dot_double(residual[i], scaled[i]) + least * inertia[i]; },
      Plus{},
      DRENCH_LAMBDA(double energy) { control->reference = keep * control->reference + energy; });
}

/// What pins drive counts as well: a sheet that nothing else moves is to follow them.
void add_pins_to_reference(State& state) {
  if (!state.pins.drive) return;
  const ScaledClothMatrix matrix = scaled_cloth_matrix(state);
  const ConstVecView change = state.cloth_system.change.view();
  const VecView driven = state.cloth_system.image.view();
  parallel_for(
      state.queue, "pins: drive", state.cloth.vertices,
      DRENCH_LAMBDA(int i) { driven.set(i, matrix.times(change, i)); });
  add_to_reference(state, matrix, driven, 1.f, 0.);
}

/// What the rows take from the particles at the pressures beside the positions.
void load_by_pressures(State& state) {
  const ClothRows c = cloth_rows(state);
  const VecView change = state.contact.change.view();
  const Float4* place = state.pressure.place.data();
  const float mass = state.parameters.particle_mass;
  parallel_for(
      state.queue, "sheets: pressures", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        change.set(row, i < 0 ? Vec3<float>{0.f, 0.f, 0.f} : c.gradient[row] * (mass * place[i].w));
      });
}

/// Sums the sizes of all rows, times a particle's mass, by vertices: kg^2/m^4, into x of `to`.
void sum_row_sizes(State& state, const RowSize& size, const VecView& to) {
  const NearView near = near_list(state);
  const ContactRows c = contact_rows(state);
  const VecView impulse = state.contact.impulse.view();
  const int triangles = state.cloth.polygons, *start = near.start, gap = c.soft_begin - c.close;
  const float mass = state.parameters.particle_mass, *contact_weight = state.cloth.share.data();
  parallel_for(
      state.queue, "sheets: sizes by triangle", triangles, DRENCH_LAMBDA(int t) {
        float sum[3] = {0.f, 0.f, 0.f};
        for (int soft = 0; soft < 2; ++soft) {
          const int k = t + soft * triangles;
          for (int row = start[k] + soft * gap; row < start[k + 1] + soft * gap; ++row)
            for (int e = 0; e < 3; ++e) sum[e] += mass * size.at(row, e);
        }
        for (int e = 0; e < 3; ++e) impulse.set(3 * t + e, {sum[e], 0.f, 0.f});
      });
  parallel_for(
      state.queue, "sheets: sizes", state.cloth.vertices, DRENCH_LAMBDA(int v) {
        const Vec3<float> none{0.f, 0.f, 0.f};
        to.set(v, contact_weight[v] > 0.f ? near.sum_on_vertex(impulse, v) : none);
      });
}

/// Adds to the solve's diagonal a bound of C A^-1 C^T: with T <= A the matrix of inertia and
/// tension it is at most C T^-1 C^T, of which no row's magnitudes sum to more than
///   sum_k w_ik |P_k G_i| (T^-1 m sum_j w_j |P G_j|)_k,   P_k: the directions that vertex k may go,
/// since T^-1 has no negative entry. Flat sheets lose nothing by it: springs along a sheet do not
/// act across it, and this is its answer to the same pressure all along. The answer with its signs
/// is no bound where a sheet is folded: the pushes of two flanks cancel
/// (docs/decisions/0023-bound-of-cloth-in-the-diagonal.md).
void add_cloth_to_diagonal(State& state) {
  ClothSystem& s = state.cloth_system;
  const ClothRows c = cloth_rows(state);
  const RowSize size{c, constraint_projection(state)};
  const TensionMatrix matrix{.ends = spring_ends_of(state.cloth),
                             .shell = shell_tension_of(state),
                             .tension = s.tension.data(),
                             .inertia = s.inertia.data(),
                             .inverse_mass = state.cloth.inverse_mass.data()};
  const VecView answer = s.answer.view();
  const VecView right = s.right.view();
  sum_row_sizes(state, size, right);
  s.answer.clear(state.queue);
  add_to_reference(state, matrix, right, 0.f, 0.);
  solve_cloth_matrix(state, matrix, answer, right, last_sweeps, 0.03f);
  float* inverse = state.pressure.inverse_diagonal.data();
  parallel_for(
      state.queue, "sheets: diagonal", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        if (i < 0 || inverse[i] == 0.f) return;
        float sum = 0.f;
        for (int k = 0; k < 3; ++k) sum += size.at(row, k) * max0(answer.x[c.vertex[k][row]]);
        inverse[i] = 1.f / (1.f / inverse[i] + sum + c.compliance[row] * (1.f / squeeze));
      });
}

/// From what the sweeps' tolerance counts: loads and the sheets' own forces.
void set_reference(State& state) {
  const ClothSystem& s = state.cloth_system;
  const ScaledClothMatrix matrix = scaled_cloth_matrix(state);
  add_to_reference(state, matrix, s.right.view(), 0.f, state.shell.any ? quiet_speed : 0.);
  add_to_reference(state, matrix, s.base.view(), 1.f, 0.);
  add_pins_to_reference(state);
}

void factor_or_build_levels(State& state) {
  if (!factor_cloth(state)) build_cloth_levels(state);
}

/// Lets go what pulls and holds what comes too near under the pressures of the last step. Whether
/// the factor or the levels are to be made anew.
bool settle_before_pressures(State& state) {
  factor_or_build_levels(state);
  set_reference(state);
  sum_loads(state, Base::own);
  return settle_contacts(state, state.cloth_system.right.view(), last_sweeps,
                         {.first = last_tolerance, .between = last_tolerance},
                         {.lets_go = true, .finds_friction = false});
}

}  // namespace

void start_cloth(State& state) {
  load_by_pressures(state);
  sum_loads(state, Base::none);
  hold_at_walls(state);
  if (state.parameters.obstacles > 0) hold_at_obstacles(state);
  const bool settles = state.shell.any && anything_is_met(state),
             anew = !settles || settle_before_pressures(state);
  add_cloth_to_diagonal(state);
  sum_loads(state, Base::none);
  if (anew) factor_or_build_levels(state);
  set_reference(state);
}

void respond_cloth(State& state, int sweeps, float tolerance) {
  ClothSystem& s = state.cloth_system;
  load_by_pressures(state);
  sum_loads(state, Base::own);
  const VecView change = s.change.view();
  const ConstVecView right = s.right.view();
  if (answer_by_factor(state, change, right, tolerance)) return;
  solve_cloth(state, change, right, cloth_is_factored(state) ? 1 : sweeps, tolerance);
}

namespace {

/// As start_cloth, where no fluid is near.
void prepare_cloth_alone(State& state, const ConstVecView& given) {
  ClothSystem& s = state.cloth_system;
  drop_cloth_factor(state);
  s.right.clear(state.queue);
  hold_at_walls(state);
  if (state.parameters.obstacles > 0) hold_at_obstacles(state);
  build_cloth_levels(state);
  add_to_reference(state, scaled_cloth_matrix(state), given, 0.f,
                   state.shell.any ? quiet_speed : 0.);
  add_pins_to_reference(state);
  // What falls freely needs no sweeps.
  if (state.shell.any) balance_loose_cloth(state, s.change.view(), given);
}

}  // namespace

void settle_cloth(State& state) {
  ClothSystem& s = state.cloth_system;
  const bool near = state.contact.near > 0;
  const ConstVecView given = near ? s.right.view() : s.base.view();
  if (near) {
    load_by_pressures(state);
    sum_loads(state, Base::own);
  } else {
    prepare_cloth_alone(state, given);
  }
  // No shift of the whole closes the momentum of a sheet that is held: to a tenth.
  settle_contacts(state, given, last_sweeps,
                  {.first = last_tolerance, .between = 0.1f * last_tolerance}, {.lets_go = !near});
  balance_loose_cloth(state, s.change.view(), given);
}

void subtract_cloth_rate(State& state) {
  const ClothRows c = cloth_rows(state);
  const ConstVecView change = state.cloth_system.change.view();
  const Float4* place = state.pressure.place.data();
  float* product = state.pressure.product.data();
  const int* done = &state.pressure.control.data()->done;
  parallel_for(
      state.queue, "sheets: density rate", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        if (i < 0 || *done) return;
        product[i] -= dot(c.gradient[row], c.at_foot(row, change)) + c.compliance[row] * place[i].w;
      });
}

void take_cloth_off_walls(State& state) {
  const ClothRows c = cloth_rows(state);
  Float4* wall = state.pressure.wall.data();
  parallel_for(
      state.queue, "sheets: walls", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        if (i < 0) return;
        const Vec3<float> g = c.gradient[row];
        wall[i] = {wall[i].x - g.x, wall[i].y - g.y, wall[i].z - g.z, wall[i].w};
      });
}

void finish_cloth(State& state) {
  ClothState& c = state.cloth;
  const ConstVecView x = c.position.view(), v = c.velocity.view();
  const VecView next = c.next.view(), next_velocity = c.next_velocity.view(),
                predicted = c.predicted.view();
  const ConstVecView change = state.cloth_system.change.view();
  const VecView force = c.force.view();
  const ConstVecView right = state.cloth_system.right.view();
  const ConstVecView base = state.cloth_system.base.view(),
                     free_axes = state.cloth_system.free.view();
  const bool near = state.contact.near > 0;
  const float dt = float(state.dt), inverse_dt = 1.f / dt, *inverse_mass = c.inverse_mass.data();
  const ClothWalls walls = cloth_walls_of(state.parameters);
  const bool shells = state.shell.any;
  const ConstVecView path = path_velocity_of(state), rounding = state.shell.rounding.view(),
                     lost = state.shell.lost.view();
  for_each_lane(
      state.queue, "cloth: finish", c.vertices, DRENCH_LAMBDA(auto i) {
        using T = decltype(load(inverse_mass, i));
        Vec3<T> velocity = v.at(i) + change.at(i) * T(inverse_dt), to = x.at(i) + velocity * T(dt);
        if (shells) {
          to = x.at(i) + (path.at(i) * T(dt) + change.at(i) + rounding.at(i));
          velocity = v.at(i) + (change.at(i) * T(inverse_dt) + lost.at(i));
        }
        walls.stop(to, velocity);
        const auto free = load(inverse_mass, i) > T(0.f);
        const Vec3<T> none{T(0.f), T(0.f), T(0.f)};
        // What walls hold does not slide freely: half a step's displacement, as where they stop it.
        const Vec3<T> may = free_axes.at(i), held{T(1.f) - may.x, T(1.f) - may.y, T(1.f) - may.z};
        velocity = select(length2(held) > T(0.f), along(may, velocity) * T(0.5f), velocity);
        if (near)
          force.put(i, force.at(i) + (right.at(i) - base.at(i)) * T(inverse_dt * inverse_dt));
        velocity = select(free, velocity, none);
        next.put(i, select(free, to, x.at(i)));
        next_velocity.put(i, velocity);
        predicted.put(i, velocity);
      });
  if (state.pins.count > 0) finish_pins(state);
  if (state.parameters.obstacles > 0) finish_at_obstacles(state, near ? right : base);
  guard_sheets(state);
  if (shells) keep_shell_step(state);
}

void keep_cloth(State& state) {
  ClothState& c = state.cloth;
  const ConstVecView x = c.position.view();
  const VecView next = c.next.view();
  parallel_for(
      state.queue, "cloth: stays", c.padded, DRENCH_LAMBDA(int i) { next.set(i, x[i]); });
  c.next_velocity.clear(state.queue), c.predicted.clear(state.queue);
}

}  // namespace drench::sim::DRENCH_BACKEND
