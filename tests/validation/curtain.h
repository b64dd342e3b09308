#pragma once
// A curtain between two pools of different heights, whose deflection is known: the stress tests
// watch over it, the bench draws its error against time.

#include <vector>

#include "pipeline/contract/shot/shot.h"
#include "sim/setup/scene.h"

namespace drench::validation {

constexpr double curtain_pool = 0.24;  // m, length, width and height of the first pool

/// A curtain of cotton, pinned along all edges, across a tank; incompressible pools of `layers` and
/// of `right` times as many layers of particles beside it.
Shot curtain_shot(int layers, double right);

/// m, of the vertex farthest off the plane of the pins: the same springs under the pressures of two
/// pools of fixed volumes at rest, in double, brought to rest by kinetic damping.
double static_deflection(const sim::Scene& scene, double right);

/// Of a curtain from the plane of its pins, m, towards the second pool.
struct Deflection {
  double most = 0, mean = 0, ripple = 0;  // of any vertex; over all; RMS
};
/// @param x  of all vertices, m. @param plane  of the pins, m.
Deflection deflection_of(const std::vector<float>& x, double plane);

}  // namespace drench::validation
