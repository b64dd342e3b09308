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

/// Rows of the near list as the solve reads them.
struct ClothDragRows {
  ClothRows rows;
  ClothRates rates;
  VecView load;  // what a row gives to its vertices
  ConstVecView normal;

  /// M_s v of a row.
  DRENCH_HD Vec3<float> times(int row, Vec3<float> v) const {
    const Vec3<float> n = normal[rows.particle[row]];
    return v * rates.along[row] + n * ((rates.across[row] - rates.along[row]) * dot(n, v));
  }
};

/// Sum of the rows' loads on a vertex.
struct VertexLoads {
  NearView near;
  ConstVecView of_corner;
  const float* share;
  DRENCH_HD Vec3<float> on(int vertex) const {
    if (share[vertex] == 0.f) return {0.f, 0.f, 0.f};
    return near.sum_on_vertex(of_corner, vertex);
  }
};

/// The vertices' part of the conjugate gradients of viscosity_solve.h. The unknown w stands in
/// ClothSystem::answer.
struct ClothDragIteration {
  BlockInverse block;
  ClothMatrix matrix;
  ConstraintProjection constraints;
  VecView solution, residual, direction, image;
  ViscousControl* control;
  float mass, inverse_mass;  // kg, 1/kg, of a particle

  DRENCH_HD Vec3<float> preconditioned(int v) const {
    return constraints.project(v, block.times(v, residual[v])) * mass;
  }
  DRENCH_HD Two<double> sums(int v) const {
    const double product = dot_double(residual[v], preconditioned(v));
    return {product, product};
  }
  /// Residual and preconditioned residual of w = 0, from what the rows load a vertex with.
  DRENCH_HD Two<double> start(int v, Vec3<float> load) const {
    residual.set(v, constraints.project(v, load));
    solution.set(v, {0.f, 0.f, 0.f}), direction.set(v, preconditioned(v));
    return sums(v);
  }
  DRENCH_HD double curvature(int v, Vec3<float> load) const {
    if (control->done) return 0;
    const Vec3<float> product =
        matrix.times(direction, v) * inverse_mass - constraints.project(v, load);
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

}  // namespace drench::sim::DRENCH_BACKEND
