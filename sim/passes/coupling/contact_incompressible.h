#pragma once
// Sheets in the pressure solve. To the fluid at its side a sheet is a mirror wall (image_walls.h)
// that gives way: at predicted positions a particle's gap to the sheet's surface is
//   gap = d - t/2 + n . (dx - sum_k w_k dt v_k),
// its row of the density rate gains G . (d_i - sum_k w_k u_k), G = rho_0 grad S, and what pressure
// q_i takes from the particle, m q_i G, its three vertices get by the weights w_k of its foot. The
// sheet answers with u = A^-1 (base + loads), so that the solve's matrix is D D^T + C A^-1 C^T
// (cloth_implicit.h): stiffness, damping and pins are in it. Particles of both sides push with
// pressures of their own.

#include "sim/passes/cloth/cloth_obstacles.h"
#include "sim/passes/coupling/contact_rows.h"
#include "sim/passes/obstacle/obstacle_density.h"
#include "sim/passes/pressure/pressure_rows.h"

namespace drench::sim::DRENCH_BACKEND {

/// Sweeps at most before the first, between further iterations of the pressures, and at the end: as
/// few as leave the pressures the iterations that an exact answer takes
/// (docs/decisions/0022-cloth-sweeps.md); one where the sheets' matrix is factored
/// (cloth_factor.h). What is left at the end is of how sheets bend; the momentum of those that
/// nothing holds is whole (balance_loose_cloth).
constexpr int first_sweeps = 100, next_sweeps = 16, last_sweeps = 4000;
constexpr float cloth_tolerance = 1e-3f, last_tolerance = 1e-4f;

/// Rows of the near list as the pressure solve has them.
struct ClothRows : ContactRows {
  ConstVecView gradient{};                      // kg/m^4, G
  const float* recovery = nullptr;              // m, that the row may ask for in this step
  const float* compliance = nullptr;            // kg^2/m^8
  const float *gap = nullptr, *open = nullptr;  // m; fraction of the density that the cloth leaves
};

inline ClothRows cloth_rows(const State& state) {
  const ContactState& c = state.contact;
  ClothRows rows{contact_rows(state)};
  rows.gradient = c.gradient.view();
  rows.recovery = c.recovery.data(), rows.compliance = c.compliance.data();
  rows.gap = c.gap.data(), rows.open = c.open.data();
  return rows;
}

/// Between a sheet that a wall holds and that wall there may be no room for a particle, and no
/// pressure makes any: there the row is a little compliant, by this fraction of |G|^2.
constexpr float squeeze = 0.1f;

/// The fraction of density that a sheet replaces at a gap, and its slope, 1/m. Nearer than a tenth
/// of a spacing the fraction goes on along its tangent: the solve must push a particle out of a
/// sheet, too.
struct ClothDensity {
  float scale, inverse_h, spacing;
  float value, slope;

  DRENCH_HD void at(float gap, float edge) {
    const float nearest = 0.1f * spacing, held = maximum(gap, nearest);
    const float q = minimum((2.f * held - 0.5f * spacing) * inverse_h, 1.f);
    slope = -2.f * scale * edge * inverse_h * WendlandC2::plane(q);
    value = scale * edge * WendlandC2::halfspace(q) + slope * (gap - held);
  }
};

/// Adds the sheets to what walls replace, and sets up the rows of the near list.
void add_cloth_to_walls(State& state);

/// What is pressed between sheets, or a sheet and a wall, comes apart no faster than the scene
/// moves, and not within the step: what gives way are its neighbours and light sheets, which would
/// be thrown, and the shorter steps that follow would throw them faster. A row of norm |D_i| asks
/// for displacements of at least source / |D_i|; they stop what comes nearer and add `recovery`.
void limit_recovery(State& state);

/// Whether ClothSystem::right, the sum of what the rows give to their vertices, has the sheets' own
/// forces in it.
enum class Base { none, own };

/// What bounds A from below: inertia, and tension without its direction; what is left out, the
/// stiffness along springs, is not negative. Its inverse has no negative entry. Acts on each
/// component alike.
struct TensionMatrix {
  SpringEnds ends;
  ShellTension shell;
  const float *tension, *inertia, *inverse_mass;

  template <class Index, class T>
  DRENCH_HD Vec3<T> moving(Index i, Vec3<T> v) const {
    return select(load(inverse_mass, i) > T(0.f), v, Vec3<T>{T(0.f), T(0.f), T(0.f)});
  }
  template <class Index>
  DRENCH_HD auto times(const ConstVecView& view, Index i) const {
    using T = decltype(load(inertia, i));
    const Vec3<T> x = view.at(i);
    Vec3<T> y = x * load(inertia, i);
    for (int s = 0; s < ends.slots; ++s)
      y = y + (x - ends.at_end(view, i, s)) * load(tension, i + s * ends.stride);
    if (shell.any) y = y + shell.times(view, i);
    return moving(i, y);
  }
  template <class Index, class T>
  DRENCH_HD Vec3<T> scaled(Index i, Vec3<T> r) const {
    T sum = load(inertia, i);
    for (int s = 0; s < ends.slots; ++s) sum = sum + load(tension, i + s * ends.stride);
    if (shell.any) sum = sum + shell.diagonal(i, sum);
    return moving(i, r * (T(1.f) / maximum(sum, T(1e-20f))));
  }
};

/// w_k |P G|, kg/m^4: what one row's unit pressure gives to a vertex along the directions that it
/// may go.
struct RowSize {
  ClothRows rows;
  ConstraintProjection constraints;
  DRENCH_HD float at(int row, int k) const {
    return rows.weight[k][row] *
           length(constraints.project(rows.vertex[k][row], rows.gradient[row]));
  }
};

/// Before the first iteration, with the pressures of the warm start in place: what walls hold, the
/// rows' part of the diagonal, and from what the sweeps' tolerance counts: loads and the sheets'
/// own forces, which may well balance.
void start_cloth(State& state);

/// The sheets' answer to the pressures beside the positions, into ClothSystem::change, m.
/// @param tolerance  of the preconditioned residual, over that of start_cloth
void respond_cloth(State& state, int sweeps, float tolerance);

/// The sheets' answer to the pressures that the solve ended with, to the tolerance.
void settle_cloth(State& state);

/// Takes the sheets' motion off the density rates, PressureState::product.
void subtract_cloth_rate(State& state);

/// Leaves the domain's walls and obstacles alone in PressureState::wall, for whoever asks for their
/// force.
void take_cloth_off_walls(State& state);

/// Where the sheets end the step if nothing stops them, and the fluid's force on them for whoever
/// asks: the loads over dt^2, beside what collisions owed.
void finish_cloth(State& state);

/// The same of sheets that all sleep: they stay.
void keep_cloth(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
