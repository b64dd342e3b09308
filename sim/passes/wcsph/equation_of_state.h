#pragma once
// Pressure of the weakly compressible fluid, p = c^2 (rho - rho_0): the equation of state of
// Desbrun and Gascuel 1996, whose stiffness is the square of the speed of sound. Never negative: a
// free surface must not pull.

#include "sim/backend/vec3.h"

namespace drench::sim::DRENCH_BACKEND {

/// p / rho^2, m^5/(kg s^2).
DRENCH_HD float pressure_term_of(float density, float rest_density, float sound_speed2) {
  const float inverse = 1.f / density;
  return sound_speed2 * max0(density - rest_density) * inverse * inverse;
}

}  // namespace drench::sim::DRENCH_BACKEND
