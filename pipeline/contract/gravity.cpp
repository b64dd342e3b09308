#include "pipeline/contract/gravity.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace drench {

V3d gravity_at(const Shot& shot, double frame) {
  const V3d g = shot.gravity.at(frame);
  const double angle = -shot.frame_rotation_deg.at(frame) * std::numbers::pi / 180;
  if (angle == 0) return g;
  const V3d axis = shot.frame_axis.normalized();  // Rodrigues' formula
  return g * std::cos(angle) + axis.cross(g) * std::sin(angle) +
         axis * (axis.dot(g) * (1 - std::cos(angle)));
}

double largest_gravity(const Shot& shot) {
  double most = 0;
  for (const auto& [frame, g] : shot.gravity.keys) most = std::max(most, g.length());
  return most;
}

}  // namespace drench
