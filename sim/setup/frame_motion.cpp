#include "sim/setup/frame_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/shot/gravity.h"
#include "sim/setup/scene.h"

namespace drench::sim {

FrameMotion::FrameMotion(const Shot& shot, const LocalFrame& frame)
    : angle_(shot.frame_rotation_deg) {
  shot_.timeline = shot.timeline;
  shot_.gravity = shot.gravity, shot_.frame_rotation_deg = shot.frame_rotation_deg;
  shot_.frame_axis = shot.frame_axis;
  turns_ = angle_.keys.size() > 1;
  moves_ = turns_ || shot.gravity.keys.size() > 1 || angle_.keys.front().second != 0;
  if (!moves_) return;
  for (auto& [at, degrees] : angle_.keys) degrees *= std::numbers::pi / 180;
  axis_ = shot.frame_axis.normalized();
  centre_ = shot.frame_center - V3d(frame.origin[0], frame.origin[1], frame.origin[2]);
  for (int corner = 0; corner < 8; ++corner) {
    V3d p;
    for (int k = 0; k < 3; ++k) p[k] = corner >> k & 1 ? shot.domain.max[k] : shot.domain.min[k];
    reach_ = std::max(reach_, axis_.cross(p - shot.frame_center).length());
  }
}

V3d FrameMotion::gravity(double time) const { return gravity_at(shot_, frame_at(time)); }

double FrameMotion::rate(double time) const { return frame_turn_at(shot_, frame_at(time)).rate; }

FrameNow FrameMotion::over(double start, double end) const {
  FrameNow now;
  const V3d pull = gravity(0.5 * (start + end));
  const double mean = (angle_.at(frame_at(end)) - angle_.at(frame_at(start))) / (end - start),
               change = rate(end) - rate(start);
  for (int k = 0; k < 3; ++k) {
    now.gravity[k] = float(pull[k]), now.centre[k] = float(centre_[k]);
    now.rate[k] = float(axis_[k] * mean), now.change[k] = float(axis_[k] * change);
  }
  return now;
}

double FrameMotion::kick(double time, double dt) const {
  return std::abs(rate(time + dt) - rate(time)) * reach_;
}

double FrameMotion::carried(double time) const {
  const double w = rate(time);
  return w * w * reach_;
}

double FrameMotion::largest_speed() const {
  double most = 0;
  for (const auto& [frame, angle] : angle_.keys)
    most = std::max(most, std::abs(rate((frame - shot_.timeline.first) / shot_.timeline.fps)));
  return most * reach_;
}

double FrameMotion::largest_acceleration() const {
  const double speed = largest_speed();
  return largest_gravity(shot_) + (reach_ > 0 ? speed * speed / reach_ : 0);
}

}  // namespace drench::sim
