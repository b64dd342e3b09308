#include "sim/passes/viscosity/viscosity_solve.h"

#include "sim/backend/solve_control.h"
#include "sim/passes/viscosity/body_drag.h"
#include "sim/passes/viscosity/viscosity_cloth.h"
#include "sim/passes/viscosity/viscosity_rows.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

bool drags_cloth(const State& state) {
  return state.parameters.no_slip_sheets && state.contact.near > 0;
}

ClothDragRows cloth_drag_rows(State& state) {
  return {cloth_rows(state), cloth_rates(state), state.contact.change.view(),
          state.fluid.normal.view()};
}

BlockInverse drag_block_inverse(State& state) {
  return {state.cloth_system.drag_factor.data(), state.cloth.padded};
}

VertexLoads sum_drag_loads(State& state) {
  sum_by_triangle(state, Rows::all);
  return {near_list(state), state.contact.impulse.view(), state.cloth.share.data()};
}

/// Inverse blocks of A with the rows' drag added to their diagonals, on free directions.
void invert_drag_blocks(State& state) {
  const ClothDragRows drag = cloth_drag_rows(state);
  parallel_for(
      state.queue, "sheet drag: shares", drag.rows.rows, DRENCH_LAMBDA(int row) {
        drag.load.set(row, {drag.rates.along[row], drag.rates.across[row], 0.f});
      });
  const VertexLoads loads = sum_drag_loads(state);
  const BlockInverse whole = block_inverse(state), block = drag_block_inverse(state);
  const ConstraintProjection constraints = constraint_projection(state);
  const float mass = state.parameters.particle_mass, *inertia = state.cloth_system.inertia.data();
  parallel_for(
      state.queue, "sheet drag: blocks", state.cloth.vertices, DRENCH_LAMBDA(int v) {
        const float more = mass * loads.on(v).x, least = maximum(inertia[v], 1e-20f);
        block.copy(v, whole);
        block.add(v, {more, 0.f, 0.f, more, 0.f, more}, least);
        if (constraints.obstacles && length2(constraints.normal[v]) > 0.f)
          block.put_free(v, block, constraints.axis[v], constraints.normal[v], least);
      });
}

ClothDragIteration cloth_drag_iteration(State& state) {
  ClothSystem& s = state.cloth_system;
  const float mass = state.parameters.particle_mass;
  return {.block = drag_block_inverse(state),
          .matrix = cloth_matrix(state),
          .constraints = constraint_projection(state),
          .solution = s.answer.view(),
          .residual = s.residual.view(),
          .direction = s.direction.view(),
          .image = s.image.view(),
          .control = state.viscosity.control.data(),
          .mass = mass,
          .inverse_mass = 1.f / mass};
}

/// Loads of the rows at the fluid's velocities `u` and the vertices' so far.
void load_by_drag(State& state) {
  const ClothDragRows drag = cloth_drag_rows(state);
  const Float4* u = state.viscosity.solution.data();
  const ConstVecView velocity = state.cloth.velocity.view();
  const ConstVecView change = state.cloth_system.change.view(),
                     more = state.cloth_system.answer.view();
  const float inverse_dt = float(1 / state.dt);
  parallel_for(
      state.queue, "sheet drag: loads", drag.rows.rows, DRENCH_LAMBDA(int row) {
        const int i = drag.rows.particle[row];
        if (i < 0) return drag.load.set(row, {0.f, 0.f, 0.f});
        const Vec3<float> sheet = drag.rows.at_foot(row, velocity) +
                                  drag.rows.at_foot(row, change) * inverse_dt +
                                  drag.rows.at_foot(row, more);
        drag.load.set(row, drag.times(row, Vec3<float>{u[i].x, u[i].y, u[i].z} - sheet));
      });
}

/// Before the fluid's own start, at whose velocities the solve begins.
void start_cloth_drag(State& state) {
  invert_drag_blocks(state);
  state.cloth_system.answer.clear(state.queue);
  load_by_drag(state);
  const VertexLoads loads = sum_drag_loads(state);
  const ClothDragIteration iteration = cloth_drag_iteration(state);
  reduce_then(
      state.queue, "sheet drag: start", state.cloth.vertices, Two<double>{0, 0},
      DRENCH_LAMBDA(int v) { return iteration.start(v, loads.on(v)); }, Plus{},
      DRENCH_LAMBDA(const Two<double>& sums) { iteration.keep(sums); });
}

/// The sheets' part of the product with the direction; before its curvature is summed.
void multiply_cloth_drag(State& state) {
  const ClothDragRows drag = cloth_drag_rows(state);
  const Float4* direction = state.viscosity.direction.data();
  Float4* product = state.viscosity.product.data();
  const ConstVecView of_vertex = state.cloth_system.direction.view();
  const ViscousControl* control = state.viscosity.control.data();
  parallel_for(
      state.queue, "sheet drag: rows", drag.rows.rows, DRENCH_LAMBDA(int row) {
        const int i = drag.rows.particle[row];
        if (i < 0 || control->done) return;
        const Vec3<float> d{direction[i].x, direction[i].y, direction[i].z},
            sheet = drag.times(row, drag.rows.at_foot(row, of_vertex));
        const Float4 k = product[i];
        product[i] = {k.x - sheet.x, k.y - sheet.y, k.z - sheet.z, 0.f};
        drag.load.set(row, drag.times(row, d) - sheet);
      });
  const VertexLoads loads = sum_drag_loads(state);
  const ClothDragIteration iteration = cloth_drag_iteration(state);
  reduce_then(
      state.queue, "sheet drag: curvature", state.cloth.vertices, 0.,
      DRENCH_LAMBDA(int v) { return iteration.curvature(v, loads.on(v)); }, Plus{},
      DRENCH_LAMBDA(double sum) { iteration.control->sheet_curvature = sum; });
}

void step_cloth_drag(State& state) {
  const ClothDragIteration iteration = cloth_drag_iteration(state);
  reduce_then(
      state.queue, "sheet drag: step", state.cloth.vertices, Two<double>{0, 0},
      DRENCH_LAMBDA(int v) { return iteration.step(v); }, Plus{},
      DRENCH_LAMBDA(const Two<double>& sums) {
        if (!iteration.control->done) iteration.keep(sums);
      });
}

void turn_cloth_drag(State& state) {
  const ClothDragIteration iteration = cloth_drag_iteration(state);
  parallel_for(
      state.queue, "sheet drag: turn", state.cloth.vertices,
      DRENCH_LAMBDA(int v) { iteration.turn(v); });
}

/// What the fluid lost to the sheets is a load of their step like those of the pressures. What the
/// solve leaves of their answer, and no shift closes of sheets that are held, more iterations take
/// up.
void give_back_cloth_drag(State& state) {
  load_by_drag(state);
  const VertexLoads loads = sum_drag_loads(state);
  ClothSystem& s = state.cloth_system;
  const VecView right = s.right.view(), change = s.change.view(), more = s.answer.view();
  const float dt = float(state.dt), mass = state.parameters.particle_mass;
  const int* grip = state.parameters.obstacles > 0 ? s.grip.data() : nullptr;
  const ConstVecView rub = s.rub.view();
  parallel_for(
      state.queue, "sheet drag: give back", state.cloth.vertices, DRENCH_LAMBDA(int v) {
        right.set(v, right[v] + loads.on(v) * (mass * dt));
        change.set(v, change[v] + more[v] * dt);
        const bool rubs = grip && grip[v] >= 0;  // friction as settle_contacts has found it
        more.set(v, rubs ? right[v] + rub[v] : right[v]);
      });
  solve_cloth(state, change, more, last_sweeps, (grip ? 0.1f : 1.f) * last_tolerance);
  balance_loose_cloth(state, change, right);
}

ViscousIteration viscous_iteration_of(State& state, const NoSlipWalls& walls) {
  const Parameters& p = state.parameters;
  ViscosityState& s = state.viscosity;
  const float dt = float(state.dt);
  const double unseen = 1e-6 * p.spacing / state.dt;  // m/s
  return {.velocity = state.fluid.velocity.view(),
          .place = state.pressure.place.data(),
          .displacement = state.pressure.scratch_a.data(),
          .product = s.product.data(),
          .diagonal = s.diagonal.data(),
          .cross = s.cross.data(),
          .solution = s.solution.data(),
          .residual = s.residual.data(),
          .direction = s.direction.data(),
          .control = s.control.data(),
          .walls = walls,
          .kick = {dt * p.gravity[0], dt * p.gravity[1], dt * p.gravity[2]},
          .frame = turning_frame_of(state),
          .turns = p.turns,
          .inverse_dt = float(1 / state.dt),
          .tolerance = p.viscous_tolerance,
          .least = unseen * unseen * state.fluid.count,
          .most_iterations = p.most_viscous_iterations};
}

template <class Separation>
void solve_viscosity(State& state, const Separation& separation) {
  ViscosityState& s = state.viscosity;
  const int n = state.fluid.count;
  for (Column<Float4>* c :
       {&s.solution, &s.residual, &s.direction, &s.product, &s.diagonal, &s.cross})
    c->resize(size_t(n));
  s.control.resize(1);
  const ViscousPairs<Separation> pairs = viscous_pairs_of(state, separation);
  const ViscousIteration iteration = viscous_iteration_of(state, pairs.walls);
  const ViscousProduct<Separation> product{pairs, s.direction.data(), s.product.data(),
                                           &s.control.data()->done};
  const NeighbourLists& lists = state.pressure.lists;
  for_each_neighbour(state.queue, "viscosity: blocks", lists, n,
                     ViscousBlocks<Separation>{pairs, s.diagonal.data(), s.cross.data()});
  ViscousControl* control = s.control.data();
  parallel_for(
      state.queue, "viscosity: control", 1, DRENCH_LAMBDA(int) { *control = {}; });
  parallel_for(
      state.queue, "viscosity: guess", n, DRENCH_LAMBDA(int i) { iteration.guess(i); });
  const bool sheets = drags_cloth(state);
  for_each_neighbour(state.queue, "viscosity: product", lists, n, product);
  if (sheets) start_cloth_drag(state);
  reduce_then(
      state.queue, "viscosity: start", n, ViscousSums{},
      DRENCH_LAMBDA(int i) { return iteration.start(i); }, Plus{},
      DRENCH_LAMBDA(const ViscousSums& sums) { iteration.decide_start(sums); });
  for (int k = 0; !ended(s.control, k, state.parameters.most_viscous_iterations); ++k) {
    for_each_neighbour(state.queue, "viscosity: product", lists, n, product);
    if (sheets) multiply_cloth_drag(state);
    reduce_then(
        state.queue, "viscosity: curvature", n, 0.,
        DRENCH_LAMBDA(int i) { return iteration.curvature(i); }, Plus{},
        DRENCH_LAMBDA(double sum) { iteration.decide_step(sum); });
    if (sheets) step_cloth_drag(state);
    reduce_then(
        state.queue, "viscosity: step", n, ViscousSums{},
        DRENCH_LAMBDA(int i) { return iteration.step(i); }, Plus{},
        DRENCH_LAMBDA(const ViscousSums& sums) { iteration.decide_turn(sums); });
    parallel_for(
        state.queue, "viscosity: turn", n, DRENCH_LAMBDA(int i) { iteration.turn(i); });
    if (sheets) turn_cloth_drag(state);
  }
  parallel_for(
      state.queue, "viscosity: end", n, DRENCH_LAMBDA(int i) { iteration.end(i); });
  if (sheets) give_back_cloth_drag(state);
}

template <class Separation>
void step_viscosity(State& state, const Separation& separation) {
  const VecView v = state.fluid.velocity.view();
  Float4* vector = state.pressure.scratch_a.data();
  parallel_for(
      state.queue, "viscosity: velocities", state.fluid.count, DRENCH_LAMBDA(int i) {
        vector[i] = {v.x[i], v.y[i], v.z[i], 0.f};
      });
  const ViscousProduct<Separation> product{viscous_pairs_of(state, separation), vector, nullptr,
                                           nullptr};
  for_each_neighbour(state.queue, "viscosity", state.pressure.lists, state.fluid.count,
                     ExplicitViscosity<Separation>{product, v});
}

}  // namespace

void apply_viscosity(State& state) {
  if (state.fluid.count == 0 || smoothing_takes_viscosity(state.parameters, state.dt)) return;
  with_separation(state.parameters, [&](const auto& separation) {
    if (viscosity_is_implicit(state.parameters, state.dt))
      solve_viscosity(state, separation);
    else
      step_viscosity(state, separation);
  });
}

}  // namespace drench::sim::DRENCH_BACKEND
