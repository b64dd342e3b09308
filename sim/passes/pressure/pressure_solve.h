#pragma once
// min 1/2 x^T A x - b^T x over x >= 0 with A = D D^T (pressure_rows.h): pressures that never pull
// and leave no density above rest. Accelerated projected gradients (Nesterov 1983, restarted as in
// O'Donoghue and Candes 2015; with contact as in Mazhar et al. 2015), preconditioned by the
// diagonal and coarse levels (multilevel.h): one application of A an iteration and no line search.
// Not conjugate gradients with projected steps: near a free surface each step meets the bound and
// starts the conjugation anew (docs/decisions/0002-accelerated-projected-gradients.md).

#include "sim/backend/parallel.h"
#include "sim/passes/coupling/contact_incompressible.h"
#include "sim/passes/pressure/multilevel.h"

namespace drench::sim::DRENCH_BACKEND {

struct SolveSums {
  double residual = 0, uphill = 0;
  DRENCH_HD SolveSums operator+(const SolveSums& other) const {
    return {residual + other.residual, uphill + other.uphill};
  }
};

/// Mean residual up to which the pressures of the last step are taken as they are; up to the
/// tolerance they get one iteration at least. A mean does not see what is crushed in one place, and
/// the same pressures again and again throw it out: a collapsing cube at 0.3 % takes 27,000 steps
/// in place of 600.
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

constexpr float no_pull = 0.f, any_pressure = -1e30f;  // least pressures

/// Before the first solve of a step ...
void begin_solve(State& state);
/// ... and before another one.
void begin_next_solve(State& state);

/// First guess: the pressures of the last step, in FluidState::pressure_term, ...
void start_from_last_step(State& state);
/// ... or none.
void start_from_nothing(State& state);
/// Pressures of the step into FluidState::pressure_term; their peak limits the next step.
void keep_pressures(State& state);

/// Solves for dt^2 p / rho^2 from the first guess in s.place, until the mean residual is
/// Parameters::tolerance of the rest density. Leaves it there, and -D^T of it, a displacement, in
/// s.scratch_a.
void find_pressures(State& state, float least);

/// Pressures that take crowded fluid back to rest density.
void solve_pressure(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
