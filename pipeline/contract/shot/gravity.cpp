#include "pipeline/contract/shot/gravity.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace drench {

namespace {

constexpr double degree = std::numbers::pi / 180;

/// Rodrigues' formula.
V3d turned(const V3d& v, const V3d& axis, double angle) {
  return v * std::cos(angle) + axis.cross(v) * std::sin(angle) +
         axis * (axis.dot(v) * (1 - std::cos(angle)));
}

}  // namespace

V3d gravity_at(const Shot& shot, double frame) {
  const V3d g = shot.gravity.at(frame);
  const double angle = shot.frame_rotation_deg.at(frame) * degree;
  return angle == 0 ? g : turned(g, shot.frame_axis.normalized(), -angle);
}

V3d FrameTurn::position_in_world(const V3d& position) const {
  return center + turned(position - center, axis, angle);
}
V3d FrameTurn::velocity_in_world(const V3d& position, const V3d& velocity) const {
  return turned(velocity + axis.cross(position - center) * rate, axis, angle);
}
V3d FrameTurn::position_from_world(const V3d& position) const {
  return center + turned(position - center, axis, -angle);
}
V3d FrameTurn::velocity_from_world(const V3d& position, const V3d& velocity) const {
  return turned(velocity, axis, -angle) - axis.cross(position - center) * rate;
}
V3d FrameTurn::centrifugal(const V3d& position) const {
  const V3d r = position - center;
  return (r - axis * axis.dot(r)) * (rate * rate);
}

FrameTurn frame_turn_at(const Shot& shot, double frame) {
  FrameTurn turn{shot.frame_axis.normalized(), shot.frame_center,
                 shot.frame_rotation_deg.at(frame) * degree, 0};
  const auto& keys = shot.frame_rotation_deg.keys;
  for (size_t k = 1; k < keys.size(); ++k) {
    if (frame < keys[k - 1].first || frame >= keys[k].first) continue;
    turn.rate = (keys[k].second - keys[k - 1].second) * degree /
                (keys[k].first - keys[k - 1].first) * shot.timeline.fps;
  }
  return turn;
}

double largest_gravity(const Shot& shot) {
  double most = 0;
  for (const auto& [frame, g] : shot.gravity.keys) most = std::max(most, g.length());
  return most;
}

}  // namespace drench
