#pragma once
// The step of sheets that are shells, in the sheets' one system A w = b (cloth_implicit.h). Here
// w = dt (v_1 - v_0), and a vertex ends at x_0 + dt p + w, its straight path p being
//   p = v_0 - dt/2 a_0,                          a_0 the acceleration over the step before.
// Of the forces inside the sheet
//   F_1 = 2/3 f(x_1) + 1/3 F_0                                   (equal steps; F_0 of the last one)
// acts over the step. So places follow the two-step method rho = z^2 - z, sigma = z^2 - z/2 + 1/2,
// whose real part of rho / sigma on the unit circle is (1 - cos phi)^2 / |sigma|^2, and velocities
// the second backward differentiation formula. Both are A-stable and of second order (Hairer and
// Wanner 1996, V.1), and so is the whole: the product of two numbers of positive real part is not
// negative, as -(omega dt)^2 is. A mode of angle phi a step loses some phi^4, where implicit Euler
// takes phi^2/2. What comes from without, the fluid's impulses, weight and walls, counts in full at
// once; forces inside sum to zero step by step, so that momentum is kept. A vertex that something
// stopped takes up its path anew.
//
// f is linearised, the membrane triangle by triangle: where the straight paths end as long as
// these hardly strain it, so that turning costs no stretch, the farther back towards x_0 the more
// they do. Its part of A are 3 x 3 blocks of vertices that share a triangle (shell_membrane.h, the
// stress that pulls sideways projected and of x_0: with that of the end limp strips boil),
// bending's a number for every pair of vertices (shell_bending.h; its viscosity: shell_patches.h).
// Positions carry what they round
// off: a stiff sheet feels a tenth of a micrometre.

#include "sim/passes/cloth/shell_membrane.h"
#include "sim/passes/coupling/polygon_grid.h"

namespace drench::sim::DRENCH_BACKEND {

/// Of a triangle in ShellState::element.
constexpr int shell_element_fields = 36;
/// Of a sheet in ShellState::law, as ShellLaw.
constexpr int shell_law_fields = 11, damping_field = 6, rigidity_field = 7;

/// Entries of the rows of eight vertices follow each other slot by slot.
struct ShellRows {
  const int *ring_start, *row_start, *end, *offset;

  static DRENCH_HD int slice(int i) { return i >> 3; }
  static DRENCH_HD int entry(int slot, int i) { return 8 * slot + (i & 7); }
  DRENCH_HD Vec3<float> at_end(const ConstVecView& view, int i, int slot) const {
    return view[end[entry(slot, i)]];
  }
  DRENCH_HD float at_end(const float* column, int i, int slot) const {
    return column[end[entry(slot, i)]];
  }
#if !defined(__CUDACC__)
  static DRENCH_HD int slice(Lanes i) { return i.base >> 3; }
  static DRENCH_HD Lanes entry(int slot, Lanes) { return {8 * slot}; }
  DRENCH_HD Vec3<Pack> at_end(const ConstVecView& view, Lanes i, int slot) const {
    if (offset[slot] != 0) return view.at(Lanes{i.base + offset[slot]});
    return view.at(load(end, Lanes{8 * slot}));
  }
#endif
};

/// The sheets' own part of A, as far as they are shells. Its rows sum to zero: a shift of the whole
/// meets no resistance.
struct ShellMatrix {
  ShellRows rows;
  const float *block, *bend, *bend_factor;
  int stride;  // from one field of the blocks to the next
  float dt2;   // s^2, times what of the new force counts
  bool any;

  template <class Index>
  DRENCH_HD auto times(const ConstVecView& view, Index i) const {
    const auto x = view.at(i);
    using T = decltype(x.x);
    Vec3<T> y{T(0.f), T(0.f), T(0.f)}, across = y;
    const int slice = ShellRows::slice(i), ring = rows.ring_start[slice];
    const int first = rows.row_start[slice], last = rows.row_start[slice + 1];
    const int inner = first + rows.ring_start[slice + 1] - ring;
    for (int slot = first; slot < inner; ++slot) {
      const Vec3<T> d = x - rows.at_end(view, i, slot);
      const auto at = ShellRows::entry(ring + slot - first, i);
      const auto entry = [&](int k) { return load(block + k * stride, at); };
      y.x = y.x + entry(0) * d.x + entry(1) * d.y + entry(2) * d.z;
      y.y = y.y + entry(3) * d.x + entry(4) * d.y + entry(5) * d.z;
      y.z = y.z + entry(6) * d.x + entry(7) * d.y + entry(8) * d.z;
    }
    for (int slot = inner; slot < last; ++slot)
      across = across + (x - rows.at_end(view, i, slot)) * load(bend, ShellRows::entry(slot, i));
    return y + across * load(bend_factor, i);
  }
};

inline ShellRows shell_rows_of(const ShellState& s) {
  return {s.ring_start.data(), s.row_start.data(), s.end.data(), s.offset.data()};
}

/// What of the force where a step ends acts over it; the rest is of the last step's: (1 + r) / (1 +
/// 2 r), r = dt over that of the last step. 1 in a first step.
inline double new_force_share(const State& state) {
  const double r = state.shell.dt > 0 ? state.dt / state.shell.dt : 0;
  return (1 + r) / (1 + 2 * r);
}

inline ShellMatrix shell_matrix_of(const State& state) {
  const ShellState& s = state.shell;
  return {.rows = shell_rows_of(s),
          .block = s.block.data(),
          .bend = s.bend.data(),
          .bend_factor = s.bend_factor.data(),
          .stride = 8 * s.ring_slots,
          .dt2 = float(new_force_share(state) * state.dt * state.dt),
          .any = s.any};
}

/// The part of A that tension gives without its direction, nowhere above A: a matrix of springs of
/// no direction whose inverse has no negative entry.
struct ShellTension {
  ShellRows rows;
  const float* tension;
  bool any;

  template <class Index>
  DRENCH_HD auto times(const ConstVecView& view, Index i) const {
    const auto x = view.at(i);
    using T = decltype(x.x);
    Vec3<T> y{T(0.f), T(0.f), T(0.f)};
    const int slice = ShellRows::slice(i), ring = rows.ring_start[slice];
    for (int k = 0; k < rows.ring_start[slice + 1] - ring; ++k) {
      y = y + (x - rows.at_end(view, i, rows.row_start[slice] + k)) *
                  load(tension, ShellRows::entry(ring + k, i));
    }
    return y;
  }
  /// The second says of which kind the sum is.
  template <class Index, class T>
  DRENCH_HD T diagonal(Index i, T) const {
    T sum(0.f);
    const int slice = ShellRows::slice(i);
    for (int k = rows.ring_start[slice]; k < rows.ring_start[slice + 1]; ++k)
      sum = sum + load(tension, ShellRows::entry(k, i));
    return sum;
  }
};

inline ShellTension shell_tension_of(const State& state) {
  return {shell_rows_of(state.shell), state.shell.tension.data(), state.shell.any};
}

/// The velocity of the vertices' straight paths.
inline ConstVecView path_velocity_of(const State& state) {
  return state.shell.any ? state.shell.path.view() : state.cloth.velocity.view();
}

/// The straight paths, the blocks at their ends, and the sheet's own part of the right side.
void linearise_shell(State& state);

/// Whether the step that was solved for strains triangles by more than its linear forces know of.
/// @param linearised  times in this step: once by linearise_shell, then by relinearise_shell
bool shell_strains_unseen(State& state, int linearised);

/// Goes back from the solve that was made, which started at ShellState::from, to where of a few
/// places on that line the energy is least.
void search_line(State& state, const ConstVecView& right, int linearised);

/// The shells' blocks and right sides anew, about where the step ends as it is solved for: the next
/// iterate of Newton's method.
void relinearise_shell(State& state);

/// The first vertex of a triangle that is stretched more than tenfold, which no fabric bears, or
/// whose place is not finite; -1 if there is none.
int overstretched_vertex(const State& state);

/// Notes what the next step needs of this one, whose end is in ClothState::next.
void keep_shell_step(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
