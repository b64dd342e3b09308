#pragma once
// A keyframed thin-lens camera over one frame's shutter, with the shape of its aperture and the
// course of its shutter.

#include "pipeline/contract/shot/shot.h"
#include "render/vector.h"

namespace drench::render {

struct Ray {
  V3f origin, direction;  // m; direction is unit
  float time = 0;         // 0 at shutter open, 1 at shutter close (of the last row)
};

/// When light that falls on the film counts: the shutter opens evenly, stays open and closes
/// evenly, for every row of a rolling one a little later than for the row above it.
class ShutterCurve {
 public:
  /// @throws Error if it would close before it is open, or rows were late by less than nothing.
  explicit ShutterCurve(const Camera& camera);

  /// A time, 0..1 of all rows together; `row` from 0 at the top of the film to 1 at its bottom.
  /// The inverse of the integral of a trapezoid; u itself for an even, global shutter.
  float time(float u, float row) const {
    const float y = u * open_;
    float t = y + opening_ / 2;
    if (y < opening_ / 2)
      t = std::sqrt(2 * opening_ * y);
    else if (y > open_ - closing_ / 2)
      t = 1 - std::sqrt(2 * closing_ * (open_ - y));
    return (t + std::clamp(row, 0.f, 1.f) * late_) * row_fraction_;
  }
  bool rolls() const { return late_ > 0; }
  /// Film frame at which the last row is done.
  static double end(const Camera& camera) {
    return camera.shutter_close +
           camera.rolling_shutter * (camera.shutter_close - camera.shutter_open);
  }

 private:
  float opening_, closing_, late_;
  float open_;          // integral of the trapezoid
  float row_fraction_;  // of one row's time in that of all
};

/// The camera at one instant.
struct CameraPose {
  V3f position, right, up, forward;  // unit axes
  float half_width = 1;              // of the image plane at distance 1
  float focus_distance = 1;          // m
  float lens_radius = 0;             // m
};

/// What a camera may do, for code that is compiled apart for each.
enum class CameraMotion { still, moving };
enum class Lens { pinhole, thin };

class ShutterCamera {
 public:
  /// @param open, close  film frames, fractional; equal for a still picture
  /// @throws Error if the camera looks nowhere, straight along `up`, or its numbers are impossible.
  ShutterCamera(const Camera& camera, double open, double close, int width, int height);

  /// A time of the shutter, by its curve. @param u  in [0, 1)
  float time(float u, const V2f& film) const { return curve_.time(u, film.y / height_); }
  const ShutterCurve& curve() const { return curve_; }

  /// @param film  in pixels from the top left, y down
  /// @param lens  in [0, 1)^2
  template <CameraMotion motion, Lens model>
  Ray ray(const V2f& film, const V2f& lens, float time) const {
    if constexpr (motion == CameraMotion::moving)
      return from_pose<model>(moves_ ? pose_at(time) : open_, film, lens, time);
    else
      return from_pose<model>(open_, film, lens, time);
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
  template <Lens model>
  Ray from_pose(const CameraPose& pose, const V2f& film, const V2f& lens, float time) const;
  CameraPose pose_at(float time) const;
  V2f aperture(const V2f& lens) const;

  CameraPose open_, close_;
  ShutterCurve curve_;
  int blades_ = 0;
  float blade_rotation_ = 0;  // radians
  float narrowing_ = 1;       // of the aperture's width
  V3f world_up_;
  float width_ = 1, height_ = 1;
  bool moves_ = false;
};

template <Lens model>
Ray ShutterCamera::from_pose(const CameraPose& pose, const V2f& film, const V2f& lens,
                             float time) const {
  const float scale = 2 * pose.half_width / width_;
  const V3f through = pose.forward + pose.right * ((film.x - 0.5f * width_) * scale) -
                      pose.up * ((film.y - 0.5f * height_) * scale);
  if constexpr (model == Lens::pinhole) return {pose.position, normalized(through), time};
  const V2f d = aperture(lens) * pose.lens_radius;
  const V3f shift = pose.right * d.x + pose.up * d.y;
  // Divided by the focus distance, so that a lens of radius 0 gives the pinhole's bits.
  return {pose.position + shift, normalized(through - shift * (1 / pose.focus_distance)), time};
}

}  // namespace drench::render
