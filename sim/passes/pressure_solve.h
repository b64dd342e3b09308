#pragma once
// min 1/2 x^T A x - b^T x over x >= 0 with A = D D^T (pressure_rows.h): pressures that never pull
// and leave no density above rest. Accelerated projected gradients (Nesterov 1983, restarted as in
// O'Donoghue and Candes 2015; with contact as in Mazhar et al. 2015), scaled by the diagonal: one
// application of A an iteration and no line search. On a collapsing column it needs less than half
// of the iterations of plain projected Jacobi for the same residual. Conjugate gradients with
// projected steps (MPRGP) were tried and dropped: near a free surface each step meets the bound and
// starts the conjugation anew, so that they need more iterations than Jacobi.

#include "sim/parallel.h"
#include "sim/passes/sheet_pressure.h"

namespace drench::sim::DRENCH_BACKEND {

struct SolveSums {
  double residual = 0, uphill = 0;
  DRENCH_HD SolveSums operator()(const SolveSums& a, const SolveSums& b) const {
    return {a.residual + b.residual, a.uphill + b.uphill};
  }
};

/// What an iteration reads and writes; copied into every launch.
struct PressureIteration {
  Float4* place;  // w: the pressures that A is applied to, extrapolated
  float *before, *next;
  const float *source, *inverse_diagonal, *product;
  SolveControl* control;
  float tolerance, scale;  // of the residual's mean; 1 / (n rest_density)
  int most_iterations;

  /// A projected step from the extrapolated pressures; what is left of the residual there, over-
  /// and underdense: pressure that is too high makes energy.
  DRENCH_HD SolveSums step(int i) const {
    if (control->done) return {};
    const float y = place[i].w, d = inverse_diagonal[i];
    const float gradient = -product[i] - source[i];
    const float x = d == 0.f ? 0.f : max0(y - control->relaxation * d * gradient);
    next[i] = x;
    const float left = d == 0.f ? 0.f : y > 0.f ? fabsf(gradient) : max0(-gradient);
    const double change = double(x) - before[i];
    return {double(left), d == 0.f ? 0. : double(y - x) * change / d};
  }

  /// After the sums of all particles: done, or how far the next extrapolation goes.
  DRENCH_HD void decide(const SolveSums& sums) const {
    SolveControl& c = *control;
    if (c.done) return;
    c.residual = float(sums.residual * scale);
    c.done = c.residual <= tolerance || c.iterations >= most_iterations;
    if (c.done) return;
    ++c.iterations;
    if (!(c.residual <= 2.f * c.least_residual)) {  // steps too long for the largest eigenvalue
      c.relaxation *= 0.7f;
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
    place[i].w = max0(x + control->extrapolation * (x - before[i]));
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
/// do is to make it even. They need not pull for that: their level is arbitrary and rises until
/// they push everywhere. Against rest density they would rise without end: Taylor and Green's
/// vortices decayed 56 % too fast at 50 particles to the side in place of 18.6 %. Pressures of
/// either sign were tried and dropped: 79 % against 27 % by t U/L = 0.2.
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

/// Solves for dt^2 p / rho^2 from the warm start in FluidState::pressure_term, until the mean
/// residual is `tolerance` of the rest density. Leaves it in s.place, -D^T of it, a displacement,
/// in s.vector.
inline void solve_pressure(State& state, float tolerance, int most_iterations) {
  PressureState& s = state.pressure;
  const int n = state.fluid.count;
  if (n == 0) return;  // the last ones have just left an open domain
  SolveControl* control = s.control.data();
  Float4* place = s.place.data();
  float *term = state.fluid.pressure_term.data(), *before = s.before.data();
  const float dt2 = float(state.dt * state.dt), inverse_dt2 = float(1 / (state.dt * state.dt));
  const PressureIteration iteration{place,
                                    before,
                                    s.next.data(),
                                    s.source.data(),
                                    s.inverse_diagonal.data(),
                                    s.product.data(),
                                    control,
                                    tolerance,
                                    1.f / (float(n) * state.parameters.rest_density),
                                    most_iterations};
  parallel_for(
      "solve: control", 1, DRENCH_LAMBDA(int) { *control = {}; });
  if (state.parameters.full) remove_mean(state);
  parallel_for(
      "solve: warm start", n, DRENCH_LAMBDA(int i) { place[i].w = before[i] = dt2 * term[i]; });
  const bool sheets = state.contact.near > 0;
  if (sheets) start_sheets(state);
  for (int k = 0; k <= most_iterations && !solve_ended(s, k - 1); ++k) {
    accelerate_by_pressure(state);
    density_rate(state);
    if (sheets) {
      respond_sheets(state, k == 0 ? first_sweeps : next_sweeps, sheet_tolerance);
      subtract_sheet_rate(state);
    }
    reduce_then(
        "solve: step", n, SolveSums{}, DRENCH_LAMBDA(int i) { return iteration.step(i); },
        SolveSums{}, DRENCH_LAMBDA(const SolveSums& sums) { iteration.decide(sums); });
    parallel_for(
        "solve: extrapolate", n, DRENCH_LAMBDA(int i) { iteration.extrapolate(i); });
  }
  parallel_for(
      "solve: end", n, DRENCH_LAMBDA(int i) { term[i] = place[i].w * inverse_dt2; });
}

}  // namespace drench::sim::DRENCH_BACKEND
