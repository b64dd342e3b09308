#pragma once
// A keyframed thin-lens camera over one frame's shutter.

#include "pipeline/contract/shot.h"
#include "render/vector.h"

namespace drench {

struct Ray {
  V3f origin, direction;  // m; direction is unit
  float time = 0;         // 0 at shutter open, 1 at shutter close
};

/// The camera at one instant.
struct CameraPose {
  V3f position, right, up, forward;  // unit axes
  float half_width = 1;              // of the image plane at distance 1
  float focus_distance = 1;          // m
  float lens_radius = 0;             // m
};

class ShutterCamera {
 public:
  /// @param open, close  film frames, fractional; equal for a still picture
  /// @throws Error if the camera looks nowhere, straight along `up`, or its numbers are impossible.
  ShutterCamera(const Camera& camera, double open, double close, int width, int height);

  /// @param film  in pixels from the top left, y down
  /// @param lens  in [0, 1)^2
  template <bool moving, bool thin_lens>
  Ray ray(const V2f& film, const V2f& lens, float time) const {
    if constexpr (moving)
      return from_pose<thin_lens>(moves_ ? pose_at(time) : open_, film, lens, time);
    else
      return from_pose<thin_lens>(open_, film, lens, time);
  }

  /// Where a point before the camera appears, in pixels from the top left, y down.
  V2f project(const CameraPose& pose, const V3f& point) const;

  bool moves() const { return moves_; }
  bool has_lens() const { return open_.lens_radius > 0 || close_.lens_radius > 0; }
  const CameraPose& open() const { return open_; }
  const CameraPose& close() const { return close_; }
  /// Pixels that a length of 1 m at a distance of 1 m covers.
  float pixels_per_radian() const { return 0.5f * width_ / open_.half_width; }

 private:
  template <bool thin_lens>
  Ray from_pose(const CameraPose& pose, const V2f& film, const V2f& lens, float time) const;
  CameraPose pose_at(float time) const;

  CameraPose open_, close_;
  V3f world_up_;
  float width_ = 1, height_ = 1;
  bool moves_ = false;
};

}  // namespace drench
