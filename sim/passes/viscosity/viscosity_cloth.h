#pragma once
// Sheets in the viscous solve, where fluid does not slip along them. A sheet may be far lighter
// than the fluid that it holds and far stiffer than its mass: both are unknowns of one system,
//   (1 + K) u - M_s W w = v + f + M_s W v_s + ...,      A w / m = W^T M_s (u - W (v_s + w)),
// u the fluid's velocities, w how much drag changes those of the vertices, v_s + w theirs, W the
// weights of the foot, M_s the sheet's block of each particle (body_drag.h), A the matrix of the
// sheets' implicit step (cloth_implicit.h) and m the mass of a particle. It is symmetric and
// positive: conjugate gradients take both at once. What a particle gets of a sheet its vertices
// give, to rounding.

#include "sim/passes/viscosity/body_drag.h"

namespace drench::sim::DRENCH_BACKEND {

inline bool drags_sheets(const State& state) {
  return state.parameters.no_slip_sheets && state.contact.near > 0;
}

/// Rows of the near list as the solve reads them.
struct SheetDragRows {
  SheetRows rows;
  SheetRates rates;
  VecView normal;

  /// M_s v of a row.
  DRENCH_HD Vec3<float> times(int row, Vec3<float> v) const {
    const Vec3<float> n = normal[rows.particle[row]];
    return v * rates.along[row] + n * ((rates.across[row] - rates.along[row]) * dot(n, v));
  }
};
inline SheetDragRows sheet_drag_rows(const State& state) {
  return {sheet_rows(state), sheet_rates(state), state.fluid.normal.view()};
}

inline BlockInverse drag_block_inverse(const State& state) {
  return {state.cloth_system.drag_factor.data(), state.cloth.padded};
}

/// Sum of the rows' loads on a vertex.
struct VertexLoads {
  NearView near;
  VecView of_corner;
  const float* share;
  DRENCH_HD Vec3<float> on(int vertex) const {
    if (share[vertex] == 0.f) return {0.f, 0.f, 0.f};
    return near.sum_on_vertex(of_corner, vertex);
  }
};
inline VertexLoads sum_drag_loads(State& state) {
  sum_by_triangle(state, Rows::all);
  return {near_list(state), state.contact.impulse.view(), state.cloth.share.data()};
}

/// Inverse blocks of A with the rows' drag added to their diagonals, on free ways.
inline void invert_drag_blocks(State& state) {
  const SheetDragRows drag = sheet_drag_rows(state);
  parallel_for(
      "sheet drag: shares", drag.rows.rows, DRENCH_LAMBDA(int row) {
        drag.rows.load.set(row, {drag.rates.along[row], drag.rates.across[row], 0.f});
      });
  const VertexLoads loads = sum_drag_loads(state);
  const BlockInverse whole = block_inverse(state), block = drag_block_inverse(state);
  const FreeWays free = free_ways(state);
  const float mass = state.parameters.particle_mass, *inertia = state.cloth_system.inertia.data();
  parallel_for(
      "sheet drag: blocks", state.cloth.vertices, DRENCH_LAMBDA(int v) {
        const float d0 = 1.f / whole.field(0)[v], d1 = 1.f / whole.field(1)[v],
                    d2 = 1.f / whole.field(2)[v], l10 = whole.field(3)[v], l20 = whole.field(4)[v],
                    l21 = whole.field(5)[v], more = mass * loads.on(v).x;
        const float b[6] = {d0 + more,
                            d0 * l10,
                            d0 * l20,
                            d0 * l10 * l10 + d1 + more,
                            d0 * l10 * l20 + d1 * l21,
                            d0 * l20 * l20 + d1 * l21 * l21 + d2 + more};
        const float least = maximum(inertia[v], 1e-20f);
        block.put(v, b, least);
        if (free.obstacles && length2(free.normal[v]) > 0.f)
          block.put_free(v, block, free.axis[v], free.normal[v], least);
      });
}

/// The vertices' share of the conjugate gradients of viscosity_solve.h. The unknown w stands in
/// ClothSystem::answer.
struct SheetDragIteration {
  BlockInverse block;
  ClothMatrix matrix;
  FreeWays free;
  VecView solution, residual, direction, image;
  ViscousControl* control;
  float mass, inverse_mass;  // kg, 1/kg, of a particle

  DRENCH_HD Vec3<float> preconditioned(int v) const {
    return free.of(v, block.times(v, residual[v])) * mass;
  }
  DRENCH_HD Two<double> sums(int v) const {
    const double product = dot_double(residual[v], preconditioned(v));
    return {product, product};
  }
  /// Residual and preconditioned residual of w = 0, from what the rows load a vertex with.
  DRENCH_HD Two<double> start(int v, Vec3<float> load) const {
    residual.set(v, free.of(v, load));
    solution.set(v, {0.f, 0.f, 0.f}), direction.set(v, preconditioned(v));
    return sums(v);
  }
  DRENCH_HD double curvature(int v, Vec3<float> load) const {
    if (control->done) return 0;
    const Vec3<float> product = matrix.times(direction, v) * inverse_mass - free.of(v, load);
    image.set(v, product);
    return dot_double(direction[v], product);
  }
  DRENCH_HD Two<double> step(int v) const {
    if (control->done) return {0, 0};
    const float s = control->step;
    solution.set(v, solution[v] + direction[v] * s);
    residual.set(v, residual[v] - image[v] * s);
    return sums(v);
  }
  DRENCH_HD void keep(const Two<double>& sums) const {
    control->sheet_square = sums.a, control->sheet_product = sums.b;
  }
  DRENCH_HD void turn(int v) const {
    if (!control->done) direction.set(v, preconditioned(v) + direction[v] * control->turn);
  }
};

inline SheetDragIteration sheet_drag_iteration(State& state) {
  ClothSystem& s = state.cloth_system;
  const float mass = state.parameters.particle_mass;
  return {drag_block_inverse(state),
          cloth_matrix(state),
          free_ways(state),
          s.answer.view(),
          s.residual.view(),
          s.direction.view(),
          s.image.view(),
          state.viscosity.control.data(),
          mass,
          1.f / mass};
}

/// Loads of the rows at the fluid's velocities `u` and the vertices' so far.
inline void load_by_drag(State& state) {
  const SheetDragRows drag = sheet_drag_rows(state);
  const Float4* u = state.viscosity.solution.data();
  const VecView velocity = state.cloth.velocity.view(), change = state.cloth_system.change.view(),
                more = state.cloth_system.answer.view();
  const float inverse_dt = float(1 / state.dt);
  parallel_for(
      "sheet drag: loads", drag.rows.rows, DRENCH_LAMBDA(int row) {
        const int i = drag.rows.particle[row];
        if (i < 0) return drag.rows.load.set(row, {0.f, 0.f, 0.f});
        const Vec3<float> sheet = drag.rows.at_foot(row, velocity) +
                                  drag.rows.at_foot(row, change) * inverse_dt +
                                  drag.rows.at_foot(row, more);
        drag.rows.load.set(row, drag.times(row, Vec3<float>{u[i].x, u[i].y, u[i].z} - sheet));
      });
}

/// Before the fluid's own start, at whose velocities the solve begins.
inline void start_sheet_drag(State& state) {
  invert_drag_blocks(state);
  state.cloth_system.answer.clear();
  load_by_drag(state);
  const VertexLoads loads = sum_drag_loads(state);
  const SheetDragIteration iteration = sheet_drag_iteration(state);
  reduce_then(
      "sheet drag: start", state.cloth.vertices, Two<double>{0, 0},
      DRENCH_LAMBDA(int v) { return iteration.start(v, loads.on(v)); }, AddPairs{},
      DRENCH_LAMBDA(const Two<double>& sums) { iteration.keep(sums); });
}

/// The sheets' part of the product with the direction; before its curvature is summed.
inline void multiply_sheet_drag(State& state) {
  const SheetDragRows drag = sheet_drag_rows(state);
  const Float4* direction = state.viscosity.direction.data();
  Float4* product = state.viscosity.product.data();
  const VecView of_vertex = state.cloth_system.direction.view();
  const ViscousControl* control = state.viscosity.control.data();
  parallel_for(
      "sheet drag: rows", drag.rows.rows, DRENCH_LAMBDA(int row) {
        const int i = drag.rows.particle[row];
        if (i < 0 || control->done) return;
        const Vec3<float> d{direction[i].x, direction[i].y, direction[i].z},
            sheet = drag.times(row, drag.rows.at_foot(row, of_vertex));
        const Float4 k = product[i];
        product[i] = {k.x - sheet.x, k.y - sheet.y, k.z - sheet.z, 0.f};
        drag.rows.load.set(row, drag.times(row, d) - sheet);
      });
  const VertexLoads loads = sum_drag_loads(state);
  const SheetDragIteration iteration = sheet_drag_iteration(state);
  reduce_then(
      "sheet drag: curvature", state.cloth.vertices, 0.,
      DRENCH_LAMBDA(int v) { return iteration.curvature(v, loads.on(v)); }, AddDoubles{},
      DRENCH_LAMBDA(double sum) { iteration.control->sheet_curvature = sum; });
}

inline void step_sheet_drag(State& state) {
  const SheetDragIteration iteration = sheet_drag_iteration(state);
  reduce_then(
      "sheet drag: step", state.cloth.vertices, Two<double>{0, 0},
      DRENCH_LAMBDA(int v) { return iteration.step(v); }, AddPairs{},
      DRENCH_LAMBDA(const Two<double>& sums) {
        if (!iteration.control->done) iteration.keep(sums);
      });
}
inline void turn_sheet_drag(State& state) {
  const SheetDragIteration iteration = sheet_drag_iteration(state);
  parallel_for(
      "sheet drag: turn", state.cloth.vertices, DRENCH_LAMBDA(int v) { iteration.turn(v); });
}

/// What the fluid lost to the sheets is a load of their step like those of the pressures. What the
/// solve leaves of their answer, and no shift closes of sheets that are held, sweeps take up.
inline void give_back_sheet_drag(State& state) {
  load_by_drag(state);
  const VertexLoads loads = sum_drag_loads(state);
  ClothSystem& s = state.cloth_system;
  const VecView right = s.right.view(), change = s.change.view(), more = s.answer.view();
  const float dt = float(state.dt), mass = state.parameters.particle_mass;
  const int* grip = state.parameters.obstacles > 0 ? s.grip.data() : nullptr;
  const VecView rub = s.rub.view();
  parallel_for(
      "sheet drag: give back", state.cloth.vertices, DRENCH_LAMBDA(int v) {
        right.set(v, right[v] + loads.on(v) * (mass * dt));
        change.set(v, change[v] + more[v] * dt);
        const bool rubs = grip && grip[v] >= 0;  // friction as settle_at_obstacles has found it
        more.set(v, rubs ? right[v] + rub[v] : right[v]);
      });
  sweep_cloth(state, change, more, last_sweeps, (grip ? 0.1f : 1.f) * last_tolerance);
  balance_loose_sheets(state, change, right);
}

}  // namespace drench::sim::DRENCH_BACKEND
