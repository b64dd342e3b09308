#pragma once
// Obstacles that turn or swing while the shutter is open: the one motion whose course is known
// beyond a velocity. Drawn straight, the ends of a blade would reach out of its circle.

#include "pipeline/contract/geometry/obstacle.h"
#include "render/vector.h"

namespace drench::render {

/// How an obstacle's keys move it about a frame.
class RotationalMotion {
 public:
  RotationalMotion(const Obstacle& obstacle, int frame);

  /// At a time, by the pose there.
  class At {
   public:
    At(const RotationalMotion& motion, double frames);
    /// @param p  m, where a point is at the frame
    /// @param v  m a frame; what the pose does not explain, of files that deform, turns with it
    V3f position(const V3f& p, const V3f& v) const;
    V3f normal(const V3f& n) const;

   private:
    const RotationalMotion& motion_;
    double frames_;
    Pose pose_;
  };

 private:
  const Obstacle& obstacle_;
  int frame_;
  Pose pose_, before_, after_;  // at the frame, and time_step about it
};

}  // namespace drench::render
