#pragma once
// Conjugate gradients on the sheets' matrix, and on what bounds it: one launch a solve.

#include "sim/passes/cloth/cloth_implicit.h"
#include "sim/passes/cloth/cloth_level_answers.h"

namespace drench::sim::DRENCH_BACKEND {

/// What beside the matrix's own scaling, and what rows of contact, take part in products with it.
struct ClothSweepParts {
  LevelAnswers levels;
  const BearingRow* bears;
  Vec3<float>* pull;
  int bearing;
#if !defined(__CUDACC__)
  State* state;  // whose factor there may be
#endif

  template <class Matrix>
  DRENCH_DEVICE void precondition(const Team& team, const Matrix& matrix) const {
#if !defined(__CUDACC__)
    if (apply_cloth_factor(*state, matrix)) return;
#endif
    levels.add(team, matrix);
  }
  /// For a product with the whole of A each row that bears is asked for by four vertices.
  DRENCH_DEVICE void ask_rows(const Team& team, const ConstVecView& x) const {
    if (bearing > 0) team.for_each(bearing, [&](int k) { pull[k] = SheetRows::pull(bears[k], x); });
  }
};
inline ClothSweepParts sweep_parts_of(State& state, ScaledClothMatrix& matrix) {
  SelfContact& s = state.self_contact;
  matrix.matrix.contact.pulled = s.pull.data();
  return {
    .levels = level_answers_of(state), .bears = s.bears.data(), .pull = s.pull.data(),
    .bearing = s.bearing,
#if !defined(__CUDACC__)
    .state = &state
#endif
  };
}

/// Of other matrices there are none.
struct NoSweepParts {
  static constexpr int bearing = 0;
  template <class Matrix>
  DRENCH_DEVICE void precondition(const Team&, const Matrix&) const {}
  DRENCH_DEVICE void ask_rows(const Team&, const ConstVecView&) const {}
};
template <class Matrix>
NoSweepParts sweep_parts_of(State&, Matrix&) {
  return {};
}

/// What iterations read and write: z is the scaled residual, p the direction, s = A p. In the order
/// of Chronopoulos and Gear (1989), which sums twice in one place.
template <class Matrix, class Parts>
struct ClothSweeps {
  Matrix matrix;
  Parts parts;
  VecView w;
  ConstVecView right;
  VecView residual, scaled, image, direction, direction_image;
  ClothControl* control;
  int vertices, most;
  float tolerance;  // of r . z, over the reference

  /// After r . z and z . A z: how far to go and what is kept of the last direction.
  DRENCH_HD void decide(double energy, double curvature) const {
    ClothControl& c = *control;
    c.done = !(energy > double(tolerance) * c.reference);
    c.turn = c.energy > 0 ? energy / c.energy : 0;
    const double bend = c.energy > 0 ? curvature - c.turn * energy / c.step : curvature;
    if (!(bend > 0)) c.done = 1;
    if (c.done) return;
    ++c.sweeps;
    c.step = energy / bend, c.energy = energy;
  }
  template <class Index>
  DRENCH_HD void start(Index i) const {
    const auto r = matrix.moving(i, right.at(i)) - matrix.times(w, i);
    using T = decltype(r.x);
    const Vec3<T> none{T(0.f), T(0.f), T(0.f)};
    direction.put(i, none), direction_image.put(i, none);
    residual.put(i, r);
    scaled.put(i, matrix.scaled(i, r));
  }
  template <class Index>
  DRENCH_HD auto multiply(Index i) const {
    const auto z = scaled.at(i), image_of_z = matrix.times(scaled, i);
    image.put(i, image_of_z);
    return Two<decltype(z.x)>{dot(residual.at(i), z), dot(z, image_of_z)};
  }
  template <class Index>
  DRENCH_HD void move(Index i) const {
    const auto r = residual.at(i);
    using T = decltype(r.x);
    const T step(float(control->step)), turn(float(control->turn));
    const Vec3<T> p = scaled.at(i) + direction.at(i) * turn,
                  s = image.at(i) + direction_image.at(i) * turn, left = r - s * step;
    direction.put(i, p), direction_image.put(i, s);
    w.put(i, w.at(i) + p * step);
    residual.put(i, left);
    scaled.put(i, matrix.scaled(i, left));
  }
  DRENCH_DEVICE void operator()(const Team& team) const {
    team.for_each(1, [&](int) { control->energy = 0., control->done = 0; });
    parts.ask_rows(team, w);
    team.for_each_lane(vertices, [&](auto i) { start(i); });
    for (int k = 0; k < most; ++k) {
      parts.precondition(team, matrix);
      parts.ask_rows(team, scaled);
      team.sum_lanes(
          vertices, [&](auto i) { return multiply(i); },
          [&](double energy, double curvature) { decide(energy, curvature); });
      if (control->done) return;
      team.for_each_lane(vertices, [&](auto i) { move(i); });
    }
  }
};

/// At most `most` iterations on A w = right from the w there is, until r . A_block^-1 r is below
/// tolerance^2 of ClothControl::reference.
template <class Matrix>
void solve_cloth_matrix(State& state, Matrix matrix, const VecView& w, const ConstVecView& right,
                        int most, float tolerance) {
  ClothSystem& s = state.cloth_system;
  const auto parts = sweep_parts_of(state, matrix);
  run_together(state.queue, "cloth: sweeps", std::max(state.cloth.vertices, parts.bearing),
               ClothSweeps<Matrix, std::remove_const_t<decltype(parts)>>{
                   .matrix = matrix,
                   .parts = parts,
                   .w = w,
                   .right = right,
                   .residual = s.residual.view(),
                   .scaled = s.scaled.view(),
                   .image = s.image.view(),
                   .direction = s.direction.view(),
                   .direction_image = s.direction_image.view(),
                   .control = s.control.data(),
                   .vertices = state.cloth.vertices,
                   .most = most,
                   .tolerance = tolerance * tolerance});
}

}  // namespace drench::sim::DRENCH_BACKEND
