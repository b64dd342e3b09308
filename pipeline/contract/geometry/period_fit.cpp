#include "pipeline/contract/geometry/period_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace drench {

namespace {

/// Whether it reaches from seam to seam as written.
bool goes_around(const FluidBox& box, int axis, double length) {
  return box.max[axis] - box.min[axis] > length * (1 - 1e-6);
}

}  // namespace

std::vector<std::string> fit_periods(Shot& shot) {
  std::vector<std::string> changed;
  if (!shot.cloth.empty()) return changed;
  const double a = shot.fluid.spacing;
  for (int k = 0; k < 3; ++k) {
    if (shot.domain.axis[size_t(k)] != Axis::periodic) continue;
    const double length = shot.domain.max[k] - shot.domain.min[k];
    std::vector<FluidBox*> around;
    for (FluidBox& box : shot.fluid.box) {
      if (goes_around(box, k, length)) around.push_back(&box);
    }
    const double multiple = std::round(length / a);
    if (around.empty() || std::abs(length - multiple * a) < 1e-3 * a) continue;
    const double least = std::ceil(2 * support_ratio(shot) - 1e-9);
    const double fitted = std::max(multiple, least) * a;
    const double end = shot.domain.min[k] + fitted;
    for (FluidBox& box : shot.fluid.box) {
      const bool ended_there = std::abs(box.max[k] - shot.domain.max[k]) < 1e-6 * length;
      if (ended_there && box.min[k] < end) box.max[k] = end;
    }
    for (FluidBox* box : around) box->max[k] = box->min[k] + fitted;
    shot.domain.max[k] = end;
    for (Probe& probe : shot.probe) {
      const double wide =
          probe.normal.length() > 0
              ? std::sqrt(std::max(0.0, 1 - std::pow(probe.normal.normalized()[k], 2)))
              : 1;
      if (probe.type != ProbeType::pressure || wide == 0) continue;
      const bool as_broad = std::abs(2 * probe.radius * wide - length) < 1e-6 * length;
      const double widest = 0.5 * fitted / wide;
      probe.radius = as_broad ? widest : std::min(probe.radius, widest);
    }
    changed.push_back(fmt::format(
        "the period of the {} axis, {:.9g} m, is {:.6g} times fluid.spacing = {:.9g} m; it is now "
        "{:.9g} m ({:+.2f} %), so that fluid joins itself at the seam",
        "xyz"[k], length, length / a, a, fitted, 100 * (fitted / length - 1)));
  }
  return changed;
}

}  // namespace drench
