#include "sim/parameters.h"

#include <cmath>

namespace drench::sim {

StepLimit stable_step(const Parameters& p, const Limits& limits) {
  StepLimit ruling{1e30, "none"};
  const auto consider = [&](double dt, const char* name) {
    if (dt < ruling.dt) ruling = {dt, name};
  };
  if (p.fluid) {
    const double h = p.support_radius;
    // One speed of sound a step, and nothing moves farther than 0.4 supports: cloth speed counts.
    consider(0.4 * h / (double(p.sound_speed) + limits.max_speed), "sound speed");
    if (limits.max_acceleration > 0)
      consider(0.25 * std::sqrt(h / limits.max_acceleration), "force");
    const double viscosity = double(p.dynamic_viscosity) / p.rest_density;
    if (viscosity > 0) consider(0.125 * h * h / viscosity, "viscosity");
  } else {
    consider(p.cloth_dt_limit, "cloth");
  }
  return ruling;
}

}  // namespace drench::sim
