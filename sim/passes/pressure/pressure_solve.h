#pragma once
// min 1/2 x^T A x - b^T x over x >= 0 with A = D D^T (pressure_rows.h): pressures that never pull
// and leave no density above rest. Accelerated projected gradients (Nesterov 1983, restarted as in
// O'Donoghue and Candes 2015; with contact as in Mazhar et al. 2015), preconditioned by the
// diagonal and coarse levels (multilevel.h): one application of A an iteration and no line search.
// On a collapsing column, with the diagonal alone, it needs less than half of the iterations of
// plain projected Jacobi for the same residual, with the levels half of those, and a tenth of them
// in deep water. Conjugate gradients with projected steps (MPRGP) were tried and dropped: near a
// free surface each step meets the bound and starts the conjugation anew, so that they need more
// iterations than Jacobi.

#include "sim/backend/parallel.h"
#include "sim/passes/coupling/cloth_pressure.h"
#include "sim/passes/pressure/multilevel.h"

namespace drench::sim::DRENCH_BACKEND {

struct SolveSums {
  double residual = 0, uphill = 0;
  DRENCH_HD SolveSums operator()(const SolveSums& a, const SolveSums& b) const {
    return {a.residual + b.residual, a.uphill + b.uphill};
  }
};

/// Mean residual up to which the pressures of the last step are taken as they are; up to the
/// tolerance they get one iteration at least. A mean does not see what is crushed in one place, and
/// the same pressures again and again throw it out: a collapsing cube at 0.3 % took 27,000 steps in
/// place of 600.
constexpr float nothing_to_do = 1e-5f;

/// What an iteration reads and writes; copied into every launch.
struct PressureIteration {
  Float4* place;  // w: the pressures that A is applied to, extrapolated
  float *before, *next;
  const float *source, *inverse_diagonal, *product;
  SolveControl* control;
  float tolerance, scale;  // of the residual's mean; 1 / (n rest_density)
  int most_iterations;
  FreeGradient on_levels;
  FinestNodes finest;
  const float* answer;  // z on these nodes

  /// A projected step from the extrapolated pressures; what is left of the residual there, over-
  /// and underdense: pressure that is too high makes energy.
  DRENCH_HD SolveSums step(int i) const {
    if (control->done) return {};
    const float y = place[i].w, d = inverse_diagonal[i], least = on_levels.least;
    next[i] = 0.f;
    if (d == 0.f) return {};
    const float gradient = -product[i] - source[i];
    float z = d * gradient;
    if (on_levels.free(i, gradient)) z += finest.interpolate(place[i], answer);
    const float to = y - control->relaxation * z, x = next[i] = maximum(to, least);
    const double change = double(x) - before[i];
    return {double(y > least ? fabsf(gradient) : max0(-gradient)),
            x == to ? gradient * change : double(y - x) * change / d};
  }

  /// After the sums of all particles: done, or how far the next extrapolation goes.
  DRENCH_HD void decide(const SolveSums& sums) const {
    SolveControl& c = *control;
    if (c.done) return;
    c.residual = float(sums.residual * scale);
    const float enough = c.iterations > 0 ? tolerance : minimum(tolerance, nothing_to_do);
    c.done = c.residual <= enough || c.iterations >= most_iterations;
    if (c.done) {
      c.levels = 0;
      return;
    }
    ++c.iterations;
    if (!(c.residual <= 2.f * c.least_residual)) {  // steps too long for the largest eigenvalue
      c.relaxation *= 0.7f;
      c.levels = 0;
      c.least_residual = c.residual;
      c.momentum = 1.f;
    }
    c.least_residual = minimum(c.least_residual, c.residual);
    if (sums.uphill > 0) c.momentum = 1.f;
    const float momentum = 0.5f * (1.f + sqrtf(1.f + 4.f * c.momentum * c.momentum));
    c.extrapolation = (c.momentum - 1.f) / momentum;
    c.momentum = momentum;
  }

  DRENCH_HD void extrapolate(int i) const {
    if (control->done) return;
    const float x = next[i];
    place[i].w = maximum(x + control->extrapolation * (x - before[i]), on_levels.least);
    before[i] = x;
  }
};

/// Has the solve ended? On the GPU the host asks now and then only; launches after the end do
/// nothing.
inline bool solve_ended(const PressureState& s, int iteration) {
#if defined(__CUDACC__)
  constexpr int patience = 8;
  return iteration % patience == patience - 1 && value_at(s.control, 0).done;
#else
  (void)iteration;
  return s.control.data()->done;
#endif
}

/// A fluid without a free surface has nowhere to go: its mean density is what it is (the kernel's
/// sum over particles out of order is above rest), and no pressure changes it. What pressures can
/// do is to make it even. Against rest density they would rise without end: Taylor and Green's
/// vortices decayed 56 % too fast at 50 particles to the side in place of 18.6 %.
inline void remove_mean(State& state) {
  PressureState& s = state.pressure;
  SolveControl* control = s.control.data();
  float* source = s.source.data();
  const int n = state.fluid.count;
  reduce_then(
      "solve: mean", n, 0.0, DRENCH_LAMBDA(int i) { return double(source[i]); }, AddDoubles{},
      DRENCH_LAMBDA(double sum) { control->mean = float(sum / n); });
  parallel_for(
      "solve: source", n, DRENCH_LAMBDA(int i) { source[i] -= control->mean; });
}

constexpr float no_pull = 0.f, any_pressure = -1e30f;  // least pressures

/// Before the first solve of a step ...
inline void begin_solve(PressureState& s) {
  SolveControl* control = s.control.data();
  parallel_for(
      "solve: control", 1, DRENCH_LAMBDA(int) { *control = {}; });
}
/// ... and before another one.
inline void begin_next_solve(PressureState& s) {
  SolveControl* control = s.control.data();
  parallel_for(
      "solve: control", 1, DRENCH_LAMBDA(int) {
        const SolveControl first = *control;
        *control = {};
        control->spent = first.iterations, control->left = first.residual;
        control->peak = first.peak;
      });
}

/// First guess: the pressures of the last step, in FluidState::pressure_term, ...
inline void start_from_last_step(State& state) {
  Float4* place = state.pressure.place.data();
  float *term = state.fluid.pressure_term.data(), *before = state.pressure.before.data();
  const float dt2 = float(state.dt * state.dt);
  parallel_for(
      "solve: warm start", state.fluid.count,
      DRENCH_LAMBDA(int i) { place[i].w = before[i] = dt2 * term[i]; });
}
/// ... or none.
inline void start_from_nothing(State& state) {
  Float4* place = state.pressure.place.data();
  float* before = state.pressure.before.data();
  parallel_for(
      "solve: cold start", state.fluid.count,
      DRENCH_LAMBDA(int i) { place[i].w = before[i] = 0.f; });
}
/// Pressures of the step into FluidState::pressure_term; their peak limits the next step.
inline void keep_pressures(State& state) {
  const Float4* place = state.pressure.place.data();
  float* term = state.fluid.pressure_term.data();
  SolveControl* control = state.pressure.control.data();
  const float inverse_dt2 = float(1 / (state.dt * state.dt)), rest = state.parameters.rest_density;
  reduce_then(
      "solve: end", state.fluid.count, Two<double>{0., 0.},
      DRENCH_LAMBDA(int i) {
        term[i] = place[i].w * inverse_dt2;
        const double square = double(term[i]) * term[i];
        return Two<double>{square, square * square};
      },
      AddPairs{},
      DRENCH_LAMBDA(const Two<double>& sum) {
        control->peak = sum.a > 0 ? rest * float(sqrt(5. / 3. * sum.b / sum.a)) : 0.f;
      });
}

/// Solves for dt^2 p / rho^2 from the first guess in s.place, until the mean residual is
/// Parameters::tolerance of the rest density. Leaves it there, and -D^T of it, a displacement, in
/// s.vector.
inline void find_pressures(State& state, float least) {
  PressureState& s = state.pressure;
  const int n = state.fluid.count, most_iterations = state.parameters.most_iterations;
  if (state.parameters.full) remove_mean(state);
  const bool sheets = state.contact.near > 0;
  if (sheets) start_sheets(state);
  prepare_levels(state);
  const FreeGradient gradient{s.place.data(),   s.product.data(),
                              s.source.data(),  s.inverse_diagonal.data(),
                              s.control.data(), least};
  const PressureIteration iteration{s.place.data(),
                                    s.before.data(),
                                    s.next.data(),
                                    s.source.data(),
                                    s.inverse_diagonal.data(),
                                    s.product.data(),
                                    s.control.data(),
                                    state.parameters.tolerance,
                                    1.f / (float(n) * state.parameters.rest_density),
                                    most_iterations,
                                    gradient,
                                    {state.fluid.grid, s.hierarchy.level[0], s.hierarchy.shift},
                                    s.hierarchy.answer.data()};
  for (int k = 0; k <= most_iterations && !solve_ended(s, k - 1); ++k) {
    accelerate_by_pressure(state);
    density_rate(state);
    if (sheets) {
      respond_sheets(state, k == 0 ? first_sweeps : next_sweeps, sheet_tolerance);
      subtract_sheet_rate(state);
    }
    correct_on_levels(state, gradient);
    reduce_then(
        "solve: step", n, SolveSums{}, DRENCH_LAMBDA(int i) { return iteration.step(i); },
        SolveSums{}, DRENCH_LAMBDA(const SolveSums& sums) { iteration.decide(sums); });
    parallel_for(
        "solve: extrapolate", n, DRENCH_LAMBDA(int i) { iteration.extrapolate(i); });
  }
}

/// Pressures that push fluid apart to rest density.
inline void solve_pressure(State& state) {
  if (state.fluid.count == 0) return;  // the last ones have just left an open domain
  begin_solve(state.pressure);
  start_from_last_step(state);
  find_pressures(state, no_pull);
  keep_pressures(state);
}

}  // namespace drench::sim::DRENCH_BACKEND
