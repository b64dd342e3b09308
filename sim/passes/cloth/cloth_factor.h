#pragma once
// A factor of the sheets' matrix (block_cholesky.h) in place of the blocks of the vertices and of
// the levels. Beside fluid a step asks some thirty times for what sheets answer to pressures, with
// one matrix: to factor it costs as much as some 100 sweeps, a solve as much as 5, where conjugate
// gradients take 16 and more. On the CPU, up to some ten thousand vertices, where nothing else
// touches the sheets (docs/decisions/0034-factor-of-sheets.md).

#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

struct ScaledClothMatrix;

#if defined(__CUDACC__)
inline void load_cloth_factor(State&) {}
inline bool factor_cloth(State&) { return false; }
inline bool cloth_is_factored(const State&) { return false; }
inline void drop_cloth_factor(State&) {}
inline bool apply_cloth_factor(State&, const ScaledClothMatrix&) { return false; }
inline bool answer_by_factor(State&, const VecView&, const ConstVecView&, float) { return false; }
#else
/// Order and fronts of shells beside fluid, where a factor pays. After load_cloth_levels.
void load_cloth_factor(State& state);

/// Factors A on free directions where sheets touch nothing but walls and fluid. Whether there is a
/// factor now.
bool factor_cloth(State& state);

bool cloth_is_factored(const State& state);

/// Once A is another one.
void drop_cloth_factor(State& state);

/// Puts A^-1 of ClothSystem::residual into ClothSystem::scaled. Whether there is a factor.
bool apply_cloth_factor(State& state, const ScaledClothMatrix& matrix);

/// w += A^-1 (right - A w), unless w is right within `tolerance` (solve_cloth). Whether there is a
/// factor with which the answer is right within a hundredth of the energy's norm: the first one by
/// a factor says so.
bool answer_by_factor(State& state, const VecView& w, const ConstVecView& right, float tolerance);
#endif

/// Of other matrices there is none.
template <class Matrix>
bool apply_cloth_factor(State&, const Matrix&) {
  return false;
}

}  // namespace drench::sim::DRENCH_BACKEND
