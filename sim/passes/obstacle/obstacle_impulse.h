#pragma once
// What obstacles received of pressure and surface tension in the step that was made, on demand.

#include "sim/passes/coupling/contact_incompressible.h"
#include "sim/passes/tension/surface_tension.h"

namespace drench::sim::DRENCH_BACKEND {

struct Impulse {
  double x = 0, y = 0, z = 0;
  DRENCH_HD Impulse operator+(const Impulse& other) const {
    return {x + other.x, y + other.y, z + other.z};
  }
};

DRENCH_HD Impulse times(Vec3<float> v, double push) { return {push * v.x, push * v.y, push * v.z}; }

/// What pressure gave to one obstacle, all images of it, in the step that was made, kg m/s: the
/// reaction to its part of -D^T q (pressure_rows.h). Of particles that are not in the near list.
Impulse pressure_impulse(const State& state, int which);

/// The same of those that are.
Impulse pressure_impulse_near_cloth(const State& state, int which);

/// What surface tension gave to one obstacle in the step that was made, kg m/s.
Impulse tension_impulse(const State& state, int which);

}  // namespace drench::sim::DRENCH_BACKEND
