#include "sim/stable_step.h"

#include <algorithm>
#include <cmath>

namespace drench::sim {

StepLimit stable_step(const Parameters& p, const Limits& limits) {
  StepLimit ruling{1e30, "none"};
  const auto consider = [&](double dt, const char* name) {
    if (dt < ruling.dt) ruling = {dt, name};
  };
  const double h = p.support_radius, a = p.spacing;
  const double viscosity = double(p.dynamic_viscosity) / p.rest_density;
  if (sheets_are_implicit(p)) {
    const double g = std::hypot(p.gravity[0], p.gravity[1], p.gravity[2]) + p.carried;
    // What has not moved yet may be about to: the sound speed is ten times what is expected.
    const double speed = limits.max_speed > 0 ? limits.max_speed : 0.1 * p.sound_speed;
    if (speed > 0) consider(0.4 * a / speed, "speed");
    if (p.surface_tension > 0)
      consider(0.25 * std::sqrt(p.rest_density * a * a * a / (2 * M_PI * p.surface_tension)),
               "surface tension");
    if (g > 0) consider(0.08 * std::sqrt(a / g), "gravity");
    if (limits.step > 0 && p.fixed_dt == 0) {
      // Impacts may ask for more iterations than there are; shorter steps ask for fewer, each. What
      // a solve leaves turns into speed over a short step: not shorter than a tenth, and no faster
      // back than the warm start bears.
      if (limits.iterations >= p.most_iterations)
        consider(std::max(0.5 * limits.step, 0.1 * ruling.dt), "iterations");
      consider(1.25 * limits.step, "growth");
      // The solve takes the places of neighbours as they are; moved by what pressures push, they
      // answer like springs of frequency sqrt(p / rho) / a and more, which long steps excite: 40
      // layers at rest boil at 0.51, 30 do not at 0.44.
      if (limits.pressure > 0)
        consider(std::max(0.43 * a / std::sqrt(limits.pressure), 0.1 * ruling.dt), "pressure");
    }
  } else if (p.fluid) {
    // One speed of sound a step, and nothing moves farther than 0.4 supports: cloth speed counts.
    consider(0.4 * h / (double(p.sound_speed) + limits.max_speed), "sound speed");
    if (limits.max_acceleration > 0)
      consider(0.25 * std::sqrt(h / limits.max_acceleration), "force");
    if (viscosity > 0) consider(0.125 * h * h / viscosity, "viscosity");
  } else {
    consider(p.cloth_dt_limit, "cloth");
  }
  return ruling;
}

}  // namespace drench::sim
