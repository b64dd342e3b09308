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
// the next step finds it again. In a closed domain a is that of its second solve, which velocities
// do not feel; with that of the first, or none, sheared packings stir more.
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
  DRENCH_HD ViscousSums operator+(const ViscousSums& other) const {
    return {square + other.square, product + other.product, size + other.size};
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
    Vec3<float> expected = kick;
    if (turns) {
      const Vec3<float> u = velocity[i], x{place[i].x, place[i].y, place[i].z};
      expected = expected + (frame(x, u) - u);
    }
    const Vec3<float> f = expected + Vec3<float>{d.x, d.y, d.z} * inverse_dt;
    const float longest2 = length2(expected), length2_f = length2(f);
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

/// Viscosity over the step's dt, for the velocities that the pressures left.
void apply_viscosity(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
