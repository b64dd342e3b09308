#pragma once
// Gravity and the frame of the domain over time.

#include "pipeline/contract/shot/shot.h"
#include "sim/frame_now.h"

namespace drench::sim {

struct LocalFrame;

/// The domain may turn about an axis: shot.frame_rotation_deg. Gravity is that of the world outside
/// and is turned back into the frame. The angular velocity is the angle's slope from the right, 0
/// before the first key and after the last; what it changes by over a step is an impulse, so that a
/// jump at a key counts whole, whatever the steps. At the start everything moves with the frame.
class FrameMotion {
 public:
  FrameMotion() = default;
  FrameMotion(const Shot& shot, const LocalFrame& frame);

  /// Whether anything changes in time; if not, Parameters::gravity is all.
  bool moves() const { return moves_; }
  bool turns() const { return turns_; }
  /// Times in s since the first frame.
  FrameNow over(double start, double end) const;
  /// As the domain sees it, m/s^2.
  V3d gravity(double time) const;
  /// rad/s, about the axis.
  double rate(double time) const;
  /// Fastest that anything at rest in the world can seem to move by within `dt` of a jump of the
  /// rate, m/s.
  double kick(double time, double dt) const;
  /// Bound of the centrifugal acceleration in the domain, m/s^2.
  double carried(double time) const;
  /// Of all times: gravity and what is carried, m/s^2, and the speed of the fastest corner, m/s.
  double largest_acceleration() const;
  double largest_speed() const;

 private:
  double frame_at(double time) const { return shot_.timeline.first + time * shot_.timeline.fps; }

  Shot shot_;                  // of which gravity_at reads keys and frames
  Animated<double> angle_{0};  // rad
  V3d axis_{0, 1, 0}, centre_{0};
  double reach_ = 0;  // m, of the domain's farthest corner from the axis
  bool moves_ = false, turns_ = false;
};

}  // namespace drench::sim
