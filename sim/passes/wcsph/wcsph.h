#pragma once
// The weakly compressible fluid: density by summation, pressure by an equation of state, artificial
// and wall viscosity, symplectic Euler.

#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// kg/m^3, and p / rho^2 by the equation of state (density.h).
void sum_density(State& state);
/// m/s^2, of pressure, viscosity and gravity (pressure_viscosity.h).
void pressure_viscosity(State& state);
/// Velocity first, by the acceleration over the step.
void integrate_velocity(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
