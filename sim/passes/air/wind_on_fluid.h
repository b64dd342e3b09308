#pragma once
// Air drag on the fluid's surface and spray, after Gissler et al. (2017): a particle on its own is
// a drop, a rigid sphere of its volume, with the drag of Schiller and Naumann (eqs 9, 12 there
// without the deformation); one among neighbours shows a square of its spacing with a coefficient
// of 1 (eqs 10, 13). Neighbours and walls upwind shelter it: the fraction of the area that is left
// is one less the largest cosine between the wind and the direction from one of them (eqs 14, 15).
// What is full around feels nothing. Implicit in the magnitude held, so that no drop overshoots the
// wind.

#include "sim/neighbours/periodic.h"
#include "sim/passes/air/wind_on_cloth.h"
#include "sim/passes/pressure/pressure_rows.h"

namespace drench::sim::DRENCH_BACKEND {

struct DropDrag {
  float air_density, viscosity;  // kg/m^3, Pa s
  float radius, spacing;         // m, of a drop
  float alone;                   // fraction of rest density that a lone particle has of itself

  /// Of a rigid sphere.
  DRENCH_HD float sphere(float speed) const {
    const float re = maximum(2.f * air_density * speed * radius / viscosity, 0.01f);
    const float cube = cbrtf(re);
    return re > 1000.f ? 0.424f : 24.f / re * (1.f + cube * cube * (1.f / 6.f));
  }
  /// C_d A, m^2. @param density  over rest. @param shelter  0 none .. 1.
  DRENCH_HD float area(float speed, float density, float shelter) const {
    const float full = minimum(maximum(1.5f * (density - alone) / (1.f - alone), 0.f), 1.f);
    const float coefficient = (1.f - full) * sphere(speed) + full;
    const float shown = (1.f - full) * 3.14159265f * radius * radius + full * spacing * spacing;
    return coefficient * shown * (1.f - shelter);
  }
};

inline DropDrag drop_drag_of(const Parameters& p) {
  const float h = p.support_radius;
  const float own = p.particle_mass / p.lattice_sum * WendlandC2::factor(h) *
                    WendlandC2::shape(0.f, h) / p.rest_density;
  return {p.air_density, 1.8e-5f, 0.62035f * p.spacing, p.spacing, own};  // (3 / 4 pi)^(1/3)
}

/// Adds the drag of a step to the particles' velocities, by their density and neighbours.
void wind_on_fluid(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
