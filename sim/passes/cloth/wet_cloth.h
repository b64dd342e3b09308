#pragma once
// Sheets that take up water. A vertex has a wetness w, the share of its pores that is full. Where a
// particle is within a spacing of it, nothing dries and
//   dw/dt = (1 - w) / soak_time,   elsewhere   dw/dt = -w / dry_time,
// by implicit Euler. Its mass is that of the dry sheet times 1 + uptake w, Coulomb's coefficient
// on sheets goes from the dry to the wet one with w, and moduli and rigidities with the mean of w
// over the sheet: one factor keeps bending, which couples patches, positive definite.
//
// Particles keep their mass: what a sheet holds, C = 0.25 kg/m^2 of cotton, is C / (rho a) of a
// layer of them, a twentieth at a spacing of 5 mm. It counts as taken from the fluid all the same:
// water comes with the velocity of the nearest particle and mixes inelastically, so that fluid less
// what was taken up, and sheets, keep their momentum and gain no energy. What dries leaves with the
// sheet's.

#include "sim/solver.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// Soaks and dries the sheets for a step, with the particles sorted where they are.
void soak_sheets(State& state);

/// Masses, friction and stiffness as the wetness says.
void apply_wetness(State& state);

/// Copies of what the sheets are when dry. After load_shell and load_self_contact.
void load_wet_cloth(State& state, const ClothTopology& cloth);

}  // namespace drench::sim::DRENCH_BACKEND
