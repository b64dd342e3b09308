#pragma once
// Sheets in the pressure solve. To the fluid at its side a sheet is a mirror wall (image_walls.h)
// that gives way: at predicted places a particle's gap to the sheet's surface is
//   gap = d - t/2 + n . (dx - sum_k w_k dt v_k),
// its row of the density rate gains G . (d_i - sum_k w_k u_k), G = rho_0 grad S, and what pressure
// q_i takes from the particle, m q_i G, its three vertices get by the weights w_k of its foot. The
// sheet answers with u = A^-1 (base + loads), so that the solve's matrix is D D^T + C A^-1 C^T
// (cloth_implicit.h): stiffness, damping and pins are in it. Particles of both sides push with
// pressures of their own.

#include "sim/passes/cloth/cloth_obstacles.h"
#include "sim/passes/coupling/contact_exact.h"
#include "sim/passes/obstacle/obstacle_share.h"
#include "sim/passes/pressure/pressure_rows.h"

namespace drench::sim::DRENCH_BACKEND {

/// Sweeps at most before the first, between further iterations of the pressures, and at the end; a
/// pool on a taut sheet takes as many iterations as with an exact answer, with 4 in place of 16 one
/// in ten more, with 2 twice as many. What is left at the end is of how sheets bend; the momentum
/// of those that nothing holds is whole (balance_loose_sheets).
constexpr int first_sweeps = 100, next_sweeps = 16, last_sweeps = 400;
constexpr float sheet_tolerance = 1e-3f, last_tolerance = 1e-4f;

/// Rows of the near list, in the place of those of contact_exact.h.
struct SheetRows {
  const int* particle;  // -1: empty
  const int* vertex[3];
  const float* weight[3];
  VecView gradient;   // kg/m^4, G
  VecView load;       // kg m, what the row gives to its vertices
  float* way;         // m, that the row may ask for in this step
  float* compliance;  // kg^2/m^8
  float *gap, *open;  // m; share of the density that the sheet leaves
  int rows;

  /// The weighted mean of the vertices.
  DRENCH_HD Vec3<float> at_foot(int row, const VecView& of_vertex) const {
    Vec3<float> sum{0.f, 0.f, 0.f};
    for (int k = 0; k < 3; ++k) sum = sum + of_vertex[vertex[k][row]] * weight[k][row];
    return sum;
  }
};

inline SheetRows sheet_rows(const State& state) {
  const ContactView c = contact_rows(state);
  return {c.particle,
          {c.vertex[0], c.vertex[1], c.vertex[2]},
          {c.weight[0], c.weight[1], c.weight[2]},
          c.normal,
          c.change,
          c.least,
          c.drag_rate,
          c.lambda,
          c.drag_scale,
          c.rows};
}

/// Between a sheet that a wall holds and that wall there may be no room for a particle, and no
/// pressure makes any: there the row is a little compliant, by this share of |G|^2.
constexpr float squeeze = 0.1f;

/// The sheet's share of density at a gap, and its slope, 1/m. Nearer than a tenth of a spacing the
/// share goes on along its tangent: the solve must push a particle out of a sheet, too.
struct SheetShare {
  float scale, inverse_h, spacing;
  float value, slope;

  DRENCH_HD void at(float gap, float edge) {
    const float nearest = 0.1f * spacing, held = maximum(gap, nearest);
    const float q = minimum((2.f * held - 0.5f * spacing) * inverse_h, 1.f);
    slope = -2.f * scale * edge * inverse_h * WendlandC2::plane(q);
    value = scale * edge * WendlandC2::halfspace(q) + slope * (gap - held);
  }
};

/// Adds the sheets to what walls replace, and sets up the rows of the near list.
inline void add_sheets_to_walls(State& state) {
  const FluidState& f = state.fluid;
  const Parameters& p = state.parameters;
  const SheetRows c = sheet_rows(state);
  const VecView x = f.position.view(), start = f.start.view(), normal = f.normal.view(),
                cloth_velocity = state.cloth.velocity.view();
  const float *distance = f.sheet_distance.data(), *edge = f.edge.data(),
              *half_thickness = state.cloth.half_thickness.data();
  const int* triangle = f.triangle.data();
  Float4* wall = state.pressure.wall.data();
  const float rest = p.rest_density, dt = float(state.dt);
  const ImageWalls walls = image_walls_of(p);
  const ObstacleShare law = obstacle_share_of(p);
  const ObstacleViews obstacles = state.obstacles.views();
  const float recovery = dt * 0.1f * p.sound_speed;
  const SheetShare blank{p.wall_scale, 1.f / p.support_radius, p.spacing, 0.f, 0.f};
  parallel_for(
      "sheets: rows", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        c.gradient.set(row, {0.f, 0.f, 0.f});
        c.compliance[row] = 0.f;
        c.gap[row] = 1e30f, c.open[row] = 1.f;
        if (i < 0 || edge[i] <= 0.f) return;
        const Vec3<float> n = normal[i], foot = c.at_foot(row, cloth_velocity) * dt;
        const float nearer = -dot(n, x[i] - start[i] - foot),
                    gap = distance[i] - half_thickness[triangle[i]] - nearer;
        SheetShare share = blank;
        share.at(gap, edge[i]);
        WallShare w = walls.share(x[i], n, gap);
        c.gap[row] = gap, c.open[row] = max0(1.f - share.value);
        for (int k = 0; k < obstacles.count; ++k)
          w = law.both(w, law.seen(obstacles.obstacle[k], x[i], n, gap, walls));
        const float open = 1.f - w.value, left = max0(1.f - share.value);
        const Vec3<float> g = n * (rest * open * share.slope), all = w.gradient * (rest * left) + g;
        c.gradient.set(row, g);
        c.way[row] = maximum(nearer + recovery, 0.1f * recovery);
        c.compliance[row] = squeeze * max0(-rest * left * dot(g, w.gradient));
        wall[i] = {all.x, all.y, all.z, rest * (1.f - open * (1.f - share.value))};
      });
}

/// What is pressed between sheets, or a sheet and a wall, comes apart no faster than the scene
/// moves, and not within the step: what gives way are its neighbours and light sheets, which would
/// be thrown, and the shorter steps that follow would throw them faster. A row of norm |D_i| asks
/// for displacements of at least source / |D_i|; they stop what comes nearer and add `recovery`.
inline void limit_recovery(State& state) {
  const SheetRows c = sheet_rows(state);
  float* source = state.pressure.source.data();
  const float* inverse_diagonal = state.pressure.inverse_diagonal.data();
  parallel_for(
      "sheets: recovery", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        if (i < 0 || length2(c.gradient[row]) == 0.f || inverse_diagonal[i] == 0.f) return;
        source[i] = minimum(source[i], c.way[row] / sqrtf(inverse_diagonal[i]));
      });
}

/// Sums what the rows give to their vertices into ClothSystem::right, with or without the sheets'
/// own forces.
enum class Base { none, own };
inline void sum_loads(State& state, Base base) {
  sum_by_triangle(state, Rows::all);
  const NearView near = near_list(state);
  const VecView impulse = state.contact.impulse.view(), right = state.cloth_system.right.view(),
                own = state.cloth_system.base.view();
  const float* share = state.cloth.share.data();
  const bool add = base == Base::own;
  parallel_for(
      "sheets: loads", state.cloth.vertices, DRENCH_LAMBDA(int v) {
        Vec3<float> sum = add ? own[v] : Vec3<float>{0.f, 0.f, 0.f};
        if (share[v] > 0.f) sum = sum + near.sum_on_vertex(impulse, v);
        right.set(v, sum);
      });
}

/// r . A_block^-1 r of the right side, from which the sweeps' tolerance counts.
template <class Matrix>
void add_to_reference(State& state, const Matrix& matrix, const VecView& of, float keep) {
  ClothControl* control = state.cloth_system.control.data();
  reduce_then(
      "cloth: reference", state.cloth.vertices, 0.,
      DRENCH_LAMBDA(int i) {
        const Vec3<float> r = matrix.moving(i, of[i]);
        return dot_double(r, matrix.scaled(i, r));
      },
      AddDoubles{},
      DRENCH_LAMBDA(double energy) { control->reference = keep * control->reference + energy; });
}

/// What the rows take from the particles at the pressures beside the positions.
inline void load_by_pressures(State& state) {
  const SheetRows c = sheet_rows(state);
  const Float4* place = state.pressure.place.data();
  const float mass = state.parameters.particle_mass;
  parallel_for(
      "sheets: pressures", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        c.load.set(row, i < 0 ? Vec3<float>{0.f, 0.f, 0.f} : c.gradient[row] * (mass * place[i].w));
      });
}

/// What bounds A from below: inertia, and tension without its direction; what is left out, the
/// stiffness along springs, is not negative. Its inverse has no negative entry. Acts on each
/// component alike.
struct TensionMatrix {
  SpringEnds ends;
  const float *tension, *inertia, *inverse_mass;

  template <class Index, class T>
  DRENCH_HD Vec3<T> moving(Index i, Vec3<T> v) const {
    return select(load(inverse_mass, i) > T(0.f), v, Vec3<T>{T(0.f), T(0.f), T(0.f)});
  }
  template <class Index>
  DRENCH_HD auto times(const VecView& view, Index i) const {
    using T = decltype(load(inertia, i));
    const Vec3<T> x = view.at(i);
    Vec3<T> y = x * load(inertia, i);
    for (int s = 0; s < ends.slots; ++s)
      y = y + (x - ends.at_end(view, i, s)) * load(tension, i + s * ends.stride);
    return moving(i, y);
  }
  template <class Index, class T>
  DRENCH_HD Vec3<T> scaled(Index i, Vec3<T> r) const {
    T sum = load(inertia, i);
    for (int s = 0; s < ends.slots; ++s) sum = sum + load(tension, i + s * ends.stride);
    return moving(i, r * (T(1.f) / maximum(sum, T(1e-20f))));
  }
};

/// w_k |P G|, kg/m^4: what one row's unit pressure gives to a vertex on the ways that it may go.
struct RowSize {
  SheetRows rows;
  FreeWays free;
  DRENCH_HD float at(int row, int k) const {
    return rows.weight[k][row] * length(free.of(rows.vertex[k][row], rows.gradient[row]));
  }
};

/// Sums the sizes of all rows, times a particle's mass, by vertices: kg^2/m^4, into x of `to`.
inline void sum_row_sizes(State& state, const RowSize& size, const VecView& to) {
  const NearView near = near_list(state);
  const ContactView c = contact_rows(state);
  const VecView impulse = state.contact.impulse.view();
  const int triangles = state.cloth.triangles, *start = near.start, gap = c.soft_begin - c.close;
  const float mass = state.parameters.particle_mass, *share = state.cloth.share.data();
  parallel_for(
      "sheets: sizes by triangle", triangles, DRENCH_LAMBDA(int t) {
        float sum[3] = {0.f, 0.f, 0.f};
        for (int soft = 0; soft < 2; ++soft) {
          const int k = t + soft * triangles;
          for (int row = start[k] + soft * gap; row < start[k + 1] + soft * gap; ++row)
            for (int e = 0; e < 3; ++e) sum[e] += mass * size.at(row, e);
        }
        for (int e = 0; e < 3; ++e) impulse.set(3 * t + e, {sum[e], 0.f, 0.f});
      });
  parallel_for(
      "sheets: sizes", state.cloth.vertices, DRENCH_LAMBDA(int v) {
        const Vec3<float> none{0.f, 0.f, 0.f};
        to.set(v, share[v] > 0.f ? near.sum_on_vertex(impulse, v) : none);
      });
}

/// Adds to the solve's diagonal a bound of C A^-1 C^T: with T <= A the matrix of inertia and
/// tension it is at most C T^-1 C^T, of which no row's magnitudes sum to more than
///   sum_k w_ik |P_k G_i| (T^-1 m sum_j w_j |P G_j|)_k,   P_k: the ways that vertex k may go,
/// since T^-1 has no negative entry. Flat sheets lose nothing by it: springs along a sheet do not
/// act across it, and this is its answer to the same pressure all along. The answer with its signs,
/// to the same pressure along one side, is no bound where a sheet is folded: the pushes of two
/// flanks cancel, and pressures there rose without end (4e11 Pa in the folds over a small ball).
inline void add_sheets_to_diagonal(State& state) {
  ClothSystem& s = state.cloth_system;
  const SheetRows c = sheet_rows(state);
  const RowSize size{c, free_ways(state)};
  const TensionMatrix matrix{spring_ends_of(state.cloth), s.tension.data(), s.inertia.data(),
                             state.cloth.inverse_mass.data()};
  const VecView answer = s.answer.view(), right = s.right.view();
  sum_row_sizes(state, size, right);
  s.answer.clear();
  add_to_reference(state, matrix, right, 0.f);
  sweep_matrix(state, matrix, answer, right, last_sweeps, 0.03f);
  float* inverse = state.pressure.inverse_diagonal.data();
  parallel_for(
      "sheets: diagonal", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        if (i < 0 || inverse[i] == 0.f) return;
        float sum = 0.f;
        for (int k = 0; k < 3; ++k) sum += size.at(row, k) * max0(answer.x[c.vertex[k][row]]);
        inverse[i] = 1.f / (1.f / inverse[i] + sum + c.compliance[row] * (1.f / squeeze));
      });
}

/// Before the first iteration, with the pressures of the warm start in place: what walls hold, the
/// rows' share of the diagonal, and from what the sweeps' tolerance counts: loads and the sheets'
/// own forces, which may well balance.
inline void start_sheets(State& state) {
  ClothSystem& s = state.cloth_system;
  load_by_pressures(state);
  sum_loads(state, Base::none);
  hold_at_walls(state);
  if (state.parameters.obstacles > 0) hold_at_obstacles(state);
  add_sheets_to_diagonal(state);
  sum_loads(state, Base::none);
  const ScaledClothMatrix matrix = scaled_cloth_matrix(state);
  add_to_reference(state, matrix, s.right.view(), 0.f);
  add_to_reference(state, matrix, s.base.view(), 1.f);
}

/// The sheets' answer to the pressures beside the positions.
inline void respond_sheets(State& state, int sweeps, float tolerance) {
  ClothSystem& s = state.cloth_system;
  load_by_pressures(state);
  sum_loads(state, Base::own);
  sweep_cloth(state, s.change.view(), s.right.view(), sweeps, tolerance);
}

/// The sheets' answer to the pressures that the solve ended with, to the tolerance.
inline void settle_sheets(State& state) {
  ClothSystem& s = state.cloth_system;
  const VecView given = state.contact.near > 0 ? s.right.view() : s.base.view();
  if (state.contact.near > 0) {
    respond_sheets(state, last_sweeps, last_tolerance);
  } else {
    s.right.clear();
    hold_at_walls(state);
    if (state.parameters.obstacles > 0) hold_at_obstacles(state);
    add_to_reference(state, scaled_cloth_matrix(state), given, 0.f);
    sweep_cloth(state, s.change.view(), given, last_sweeps, last_tolerance);
  }
  if (state.parameters.obstacles > 0)
    settle_at_obstacles(state, given, last_sweeps, last_tolerance);
  balance_loose_sheets(state, s.change.view(), given);
}

/// Takes the sheets' motion off the density rates.
inline void subtract_sheet_rate(State& state) {
  const SheetRows c = sheet_rows(state);
  const VecView change = state.cloth_system.change.view();
  const Float4* place = state.pressure.place.data();
  float* product = state.pressure.product.data();
  const int* done = &state.pressure.control.data()->done;
  parallel_for(
      "sheets: density rate", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        if (i < 0 || *done) return;
        product[i] -= dot(c.gradient[row], c.at_foot(row, change)) + c.compliance[row] * place[i].w;
      });
}

/// Leaves the domain's walls alone in the column, for whoever asks for their force.
inline void take_sheets_off_walls(State& state) {
  const SheetRows c = sheet_rows(state);
  Float4* wall = state.pressure.wall.data();
  parallel_for(
      "sheets: walls", c.rows, DRENCH_LAMBDA(int row) {
        const int i = c.particle[row];
        if (i < 0) return;
        const Vec3<float> g = c.gradient[row];
        wall[i] = {wall[i].x - g.x, wall[i].y - g.y, wall[i].z - g.z, wall[i].w};
      });
}

/// Where the sheets end the step if nothing stops them, and the fluid's force on them for whoever
/// asks: the loads over dt^2, beside what the path test owed.
inline void finish_sheets(State& state) {
  ClothState& c = state.cloth;
  const VecView x = c.position.view(), v = c.velocity.view(), next = c.next.view(),
                next_velocity = c.next_velocity.view(), predicted = c.predicted.view(),
                change = state.cloth_system.change.view(), force = c.force.view(),
                right = state.cloth_system.right.view(), base = state.cloth_system.base.view(),
                free_axes = state.cloth_system.free.view();
  const bool near = state.contact.near > 0;
  const float dt = float(state.dt), inverse_dt = 1.f / dt, *inverse_mass = c.inverse_mass.data();
  const ClothWalls walls = cloth_walls_of(state.parameters);
  for_each_lane(
      "cloth: finish", c.vertices, DRENCH_LAMBDA(auto i) {
        using T = decltype(load(inverse_mass, i));
        Vec3<T> velocity = v.at(i) + change.at(i) * T(inverse_dt), to = x.at(i) + velocity * T(dt);
        walls.stop(to, velocity);
        const auto free = load(inverse_mass, i) > T(0.f);
        const Vec3<T> none{T(0.f), T(0.f), T(0.f)};
        // What walls hold does not slide freely: half a step's way, as where they stop it.
        const Vec3<T> may = free_axes.at(i), held{T(1.f) - may.x, T(1.f) - may.y, T(1.f) - may.z};
        velocity = select(length2(held) > T(0.f), along(may, velocity) * T(0.5f), velocity);
        if (near)
          force.put(i, force.at(i) + (right.at(i) - base.at(i)) * T(inverse_dt * inverse_dt));
        velocity = select(free, velocity, none);
        next.put(i, select(free, to, x.at(i)));
        next_velocity.put(i, velocity);
        predicted.put(i, velocity);
      });
  if (state.parameters.obstacles > 0) finish_at_obstacles(state, near ? right : base);
}

}  // namespace drench::sim::DRENCH_BACKEND
