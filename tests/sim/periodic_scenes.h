#pragma once
// Domains with periodic axes, and distances in them.

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/sim/support.h"

namespace drench::sim_tests {

/// A box of `cells` spacings of 0.01 m, periodic along x and z, open along y; no gravity.
inline Shot slab(std::array<int, 3> cells) {
  Shot shot = empty_shot();
  shot.fluid.solver = FluidSolver::incompressible, shot.fluid.spacing = 0.01;
  shot.domain.min = V3d(0), shot.domain.max = V3d(cells[0], cells[1], cells[2]) * 0.01;
  shot.domain.axis = {Axis::periodic, Axis::open, Axis::periodic};
  return shot;
}

/// m; 0 along axes that are not periodic.
inline V3d period_of(const Shot& shot) {
  V3d period(0);
  for (int k = 0; k < 3; ++k) {
    if (shot.domain.axis[size_t(k)] == Axis::periodic)
      period[k] = shot.domain.max[k] - shot.domain.min[k];
  }
  return period;
}

inline V3d nearest_image(V3d d, const V3d& period) {
  for (int k = 0; k < 3; ++k)
    if (period[k] > 0) d[k] -= period[k] * std::round(d[k] / period[k]);
  return d;
}

/// Largest distance of a particle or vertex of one state from that of the other moved by `shift`,
/// m.
inline double difference(const sim::HostState& p, const sim::HostState& q, const V3d& shift,
                         const V3d& period) {
  const std::vector<int> of_p = place_of_id(p), of_q = place_of_id(q);
  double worst = 0;
  for (size_t i = 0; i < of_p.size(); ++i) {
    const V3d d = at(q.position, size_t(of_q[i])) - at(p.position, size_t(of_p[i])) - shift;
    worst = std::max(worst, nearest_image(d, period).length());
  }
  for (size_t v = 0; v < p.cloth_position.size(); ++v) {
    const V3d d = at(q.cloth_position, v) - at(p.cloth_position, v) - shift;
    worst = std::max(worst, nearest_image(d, period).length());
  }
  return worst;
}

}  // namespace drench::sim_tests
