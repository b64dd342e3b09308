#pragma once
// How long a time step may be.

#include "sim/parameters.h"

namespace drench::sim {

/// The largest stable fluid step and the name of the limit that rules it.
/// Acoustic 0.4 h/(c + v), force 0.25 sqrt(h/a), viscous 0.125 h^2/nu (research figures, Monaghan
/// 1992). Incompressible: nothing moves farther than 0.4 spacings, gravity displaces by 0.003, and
/// a step follows the one before: half of it when its solve was cut short, 0.43 spacings over
/// sqrt(p / rho) of the pressure it found; surface tension 0.25
/// sqrt(rho a^3 / (2 pi sigma)), more heats a drop. Its viscosity sets none. Implicit sheets alone
/// keep to the two of speed and gravity.
struct StepLimit {
  double dt;
  const char* name;
};
StepLimit stable_step(const Parameters& parameters, const Limits& limits);

}  // namespace drench::sim
