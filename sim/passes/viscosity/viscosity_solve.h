#pragma once
// Viscosity at the end of a step, after the pressures. Where it is next to nothing beside the
// smoothing of velocities, that has taken it on (velocity_smoothing.h). A step so short that
// dt nu / h^2 <= 0.01 takes it explicitly; any other solves (1 + K) u = v + f + walls by conjugate
// gradients with 3 x 3 blocks on the diagonal as preconditioner (Weiler et al. 2018), matrix-free.
//
// f = dt (g + a), a of the pressures just found, is what the next step is about to add, so that u
// is the velocity it ends with: a fluid held up by viscosity rests, and a film runs down a wall as
// fast as it should at any step. f is taken off again, gravity and the next pressures add it. With
// f left out fluid slips along walls by dt g; with friction before the pressures it creeps up them
// at rest. What is about to be added is known where gravity and pressure nearly balance, and is
// never longer than dt g there; after an impact it is not, so that it is cut to this length.
// Without the cut the pressure of an impact would keep itself up: as friction undoes what it does,
// the next step finds it again. In a full box a is that of its second solve, which velocities do
// not feel; with that of the first, or none, sheared packings stir more (docs/benchmarks.md).
//
// What a solve leaves, r = b - (1 + K) u, is added to u: v = b - K u is what forces between pairs
// make of b, so that momentum and angular momentum are kept to rounding, and since 0 <= K the error
// is no larger than r. Not so where a solve was cut short: r may be larger than u.

#include "sim/backend/parallel.h"
#include "sim/passes/motion/turning_frame.h"
#include "sim/passes/viscosity/viscosity_cloth.h"
#include "sim/passes/viscosity/viscosity_rows.h"

namespace drench::sim::DRENCH_BACKEND {

struct ViscousSums {
  double square = 0, product = 0, size = 0;  // r . r, r . B r, b . b
  DRENCH_HD ViscousSums operator()(const ViscousSums& a, const ViscousSums& b) const {
    return {a.square + b.square, a.product + b.product, a.size + b.size};
  }
};

/// What an iteration reads and writes; copied into every launch.
struct ViscousIteration {
  VecView velocity;
  const Float4 *place, *displacement;  // by the pressures of the step, m
  const Float4 *product, *diagonal, *cross;
  Float4 *solution, *residual, *direction;
  ViscousControl* control;
  NoSlipWalls walls;
  Vec3<float> kick;    // dt g, m/s
  TurningFrame frame;  // what adds to it, ...
  bool turns;          // ... if it does
  float inverse_dt;    // 1/s
  float tolerance;     // of the residual, over b
  double least;        // of the sum of squares, m^2/s^2
  int most_iterations;

  /// f, no longer than dt g.
  DRENCH_HD Vec3<float> coming(int i) const {
    const Float4 d = displacement[i];
    Vec3<float> push = kick;
    if (turns) {
      const Vec3<float> u = velocity[i], x{place[i].x, place[i].y, place[i].z};
      push = push + (frame(x, u) - u);
    }
    const Vec3<float> f = push + Vec3<float>{d.x, d.y, d.z} * inverse_dt;
    const float longest2 = length2(push), length2_f = length2(f);
    return length2_f > longest2 ? f * sqrtf(longest2 / length2_f) : f;
  }
  DRENCH_HD Float4 preconditioned(const Float4& r, int i) const {
    return multiply_symmetric(diagonal[i], cross[i], r);
  }
  DRENCH_HD static double inner(const Float4& a, const Float4& b) {
    return double(a.x) * b.x + double(a.y) * b.y + double(a.z) * b.z;
  }

  /// The velocity to start from stands in the direction as well, for the product.
  DRENCH_HD void guess(int i) const {
    const Vec3<float> u = velocity[i];
    solution[i] = direction[i] = {u.x, u.y, u.z, 0.f};
  }
  DRENCH_HD ViscousSums start(int i) const {
    const Vec3<float> b = velocity[i] + coming(i) + walls.drag(i, place[i]).source;
    const Float4 u = solution[i], k = product[i];
    const Float4 r{b.x - u.x - k.x, b.y - u.y - k.y, b.z - u.z - k.z, 0.f};
    const Float4 z = preconditioned(r, i);
    residual[i] = r, direction[i] = z;
    return {inner(r, r), inner(r, z), double(length2(b))};
  }
  DRENCH_HD void decide_start(const ViscousSums& sums) const {
    ViscousControl& c = *control;
    const ViscousControl old = c;
    c = {};
    c.sheet_square = old.sheet_square, c.sheet_product = old.sheet_product;
    c.size = sums.size;
    finish_iteration(sums);
  }
  DRENCH_HD void finish_iteration(const ViscousSums& sums) const {
    ViscousControl& c = *control;
    const double allowed = double(tolerance) * tolerance * c.size;
    const double square = sums.square + c.sheet_square;
    c.residual = c.size > 0 ? float(::sqrt(square / c.size)) : 0.f;
    c.product = sums.product + c.sheet_product;
    c.converged = square <= allowed || square <= least;
    c.done = c.converged || c.iterations >= most_iterations || !(c.product > 0);
  }

  DRENCH_HD double curvature(int i) const {
    if (control->done) return 0;
    const Float4 p = direction[i];
    return inner(p, p) + inner(p, product[i]);
  }
  DRENCH_HD void decide_step(double curvature) const {
    if (!control->done)
      control->step = float(control->product / (curvature + control->sheet_curvature));
  }
  DRENCH_HD ViscousSums step(int i) const {
    if (control->done) return {};
    const float s = control->step;
    const Float4 p = direction[i], k = product[i];
    Float4 u = solution[i], r = residual[i];
    u.x += s * p.x, u.y += s * p.y, u.z += s * p.z;
    r.x -= s * (p.x + k.x), r.y -= s * (p.y + k.y), r.z -= s * (p.z + k.z);
    solution[i] = u, residual[i] = r;
    return {inner(r, r), inner(r, preconditioned(r, i)), 0};
  }
  DRENCH_HD void decide_turn(const ViscousSums& sums) const {
    ViscousControl& c = *control;
    if (c.done) return;
    ++c.iterations;
    c.turn = float((sums.product + c.sheet_product) / c.product);
    finish_iteration(sums);
  }
  DRENCH_HD void turn(int i) const {
    if (control->done) return;
    const float t = control->turn;
    const Float4 z = preconditioned(residual[i], i), p = direction[i];
    direction[i] = {z.x + t * p.x, z.y + t * p.y, z.z + t * p.z, 0.f};
  }
  DRENCH_HD void end(int i) const {
    const Float4 u = solution[i], r = residual[i];
    const float rest = control->converged ? 1.f : 0.f;
    velocity.set(i, Vec3<float>{u.x + rest * r.x, u.y + rest * r.y, u.z + rest * r.z} - coming(i));
  }
};

inline bool viscous_solve_ended(const ViscosityState& s, int iteration) {
#if defined(__CUDACC__)
  constexpr int patience = 8;
  return iteration % patience == patience - 1 && value_at(s.control, 0).done;
#else
  (void)iteration;
  return s.control.data()->done;
#endif
}

inline ViscousIteration viscous_iteration_of(State& state, const NoSlipWalls& walls) {
  const Parameters& p = state.parameters;
  ViscosityState& s = state.viscosity;
  const float dt = float(state.dt);
  const double unseen = 1e-6 * p.spacing / state.dt;  // m/s
  return {state.fluid.velocity.view(),
          state.pressure.place.data(),
          state.pressure.vector.data(),
          s.product.data(),
          s.diagonal.data(),
          s.cross.data(),
          s.solution.data(),
          s.residual.data(),
          s.direction.data(),
          s.control.data(),
          walls,
          {dt * p.gravity[0], dt * p.gravity[1], dt * p.gravity[2]},
          turning_frame_of(state),
          p.turns,
          float(1 / state.dt),
          p.viscous_tolerance,
          unseen * unseen * state.fluid.count,
          p.most_viscous_iterations};
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
  for_each_neighbour("viscosity: blocks", lists, n,
                     ViscousBlocks<Separation>{pairs, s.diagonal.data(), s.cross.data()});
  ViscousControl* control = s.control.data();
  parallel_for(
      "viscosity: control", 1, DRENCH_LAMBDA(int) { *control = {}; });
  parallel_for(
      "viscosity: guess", n, DRENCH_LAMBDA(int i) { iteration.guess(i); });
  const bool sheets = drags_sheets(state);
  for_each_neighbour("viscosity: product", lists, n, product);
  if (sheets) start_sheet_drag(state);
  reduce_then(
      "viscosity: start", n, ViscousSums{}, DRENCH_LAMBDA(int i) { return iteration.start(i); },
      ViscousSums{}, DRENCH_LAMBDA(const ViscousSums& sums) { iteration.decide_start(sums); });
  for (int k = 0; k < state.parameters.most_viscous_iterations && !viscous_solve_ended(s, k - 1);
       ++k) {
    for_each_neighbour("viscosity: product", lists, n, product);
    if (sheets) multiply_sheet_drag(state);
    reduce_then(
        "viscosity: curvature", n, 0., DRENCH_LAMBDA(int i) { return iteration.curvature(i); },
        AddDoubles{}, DRENCH_LAMBDA(double sum) { iteration.decide_step(sum); });
    if (sheets) step_sheet_drag(state);
    reduce_then(
        "viscosity: step", n, ViscousSums{}, DRENCH_LAMBDA(int i) { return iteration.step(i); },
        ViscousSums{}, DRENCH_LAMBDA(const ViscousSums& sums) { iteration.decide_turn(sums); });
    parallel_for(
        "viscosity: turn", n, DRENCH_LAMBDA(int i) { iteration.turn(i); });
    if (sheets) turn_sheet_drag(state);
  }
  parallel_for(
      "viscosity: end", n, DRENCH_LAMBDA(int i) { iteration.end(i); });
  if (sheets) give_back_sheet_drag(state);
}

template <class Separation>
void step_viscosity(State& state, const Separation& separation) {
  const VecView v = state.fluid.velocity.view();
  Float4* vector = state.pressure.vector.data();
  parallel_for(
      "viscosity: velocities", state.fluid.count, DRENCH_LAMBDA(int i) {
        vector[i] = {v.x[i], v.y[i], v.z[i], 0.f};
      });
  const ViscousProduct<Separation> product{viscous_pairs_of(state, separation), vector, nullptr,
                                           nullptr};
  for_each_neighbour("viscosity", state.pressure.lists, state.fluid.count,
                     ExplicitViscosity<Separation>{product, v});
}

/// Viscosity over the step's dt, for the velocities that the pressures left.
inline void apply_viscosity(State& state) {
  if (state.fluid.count == 0 || smoothing_takes_viscosity(state.parameters, state.dt)) return;
  with_separation(state.parameters, [&](const auto& separation) {
    if (viscosity_is_implicit(state.parameters, state.dt))
      solve_viscosity(state, separation);
    else
      step_viscosity(state, separation);
  });
}

}  // namespace drench::sim::DRENCH_BACKEND
