#include "render/scene/camera.h"

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "render/sampling.h"

namespace drench::render {

namespace {

void aim(CameraPose& pose, const V3f& toward, const V3f& world_up) {
  pose.forward = normalized(toward);
  pose.right = normalized(cross(pose.forward, world_up));
  pose.up = cross(pose.right, pose.forward);
}

CameraPose pose_of(const Camera& camera, double frame) {
  const V3d position = camera.position.at(frame), target = camera.target.at(frame);
  const V3d toward = target - position;
  const double distance = toward.length(), fov = camera.fov_deg.at(frame);
  const double side = (toward % camera.up).length();
  const auto fail = [&](const std::string& what) {
    throw Error(fmt::format("camera at frame {}: {}", frame, what));
  };
  if (!(distance > 0) || !std::isfinite(distance))
    fail("position and target are the same point, so it looks nowhere; move one of them");
  if (!(side > 1e-6 * distance * camera.up.length()))
    fail("it looks along its own up direction; choose another camera.up");
  if (!(fov > 0 && fov < 180))
    fail(fmt::format("fov_deg is {} but must lie between 0 and 180", fov));
  const double focus = camera.focus_distance.at(frame), lens = camera.lens_radius.at(frame);
  if (!(focus >= 0 && lens >= 0 && std::isfinite(focus) && std::isfinite(lens)))
    fail("focus_distance and lens_radius must not be negative");

  CameraPose pose;
  pose.position = V3f(position);
  aim(pose, V3f(toward / distance), V3f(camera.up));
  pose.half_width = float(std::tan(fov * std::numbers::pi / 360));
  pose.focus_distance = float(focus > 0 ? focus : distance);
  pose.lens_radius = float(lens);
  return pose;
}

bool same(const CameraPose& a, const CameraPose& b) {
  return a.position == b.position && a.forward == b.forward && a.half_width == b.half_width &&
         a.focus_distance == b.focus_distance && a.lens_radius == b.lens_radius;
}

}  // namespace

ShutterCurve::ShutterCurve(const Camera& camera)
    : opening_(float(camera.shutter_opening)),
      closing_(float(camera.shutter_closing)),
      late_(float(camera.rolling_shutter)),
      open_(1 - (opening_ + closing_) / 2),
      row_fraction_(1 / (1 + late_)) {
  if (!(opening_ >= 0 && closing_ >= 0 && opening_ + closing_ <= 1 + 1e-6f))
    throw Error(
        fmt::format("camera: shutter_opening is {} and shutter_closing is {}; neither may be "
                    "negative nor their sum more than 1",
                    opening_, closing_));
  if (!(late_ >= 0) || !std::isfinite(late_))
    throw Error(fmt::format("camera: rolling_shutter is {}; it must not be negative", late_));
}

ShutterCamera::ShutterCamera(const Camera& camera, double open, double close, int width, int height)
    : open_(pose_of(camera, open)),
      close_(pose_of(camera, close)),
      curve_(camera),
      blades_(camera.blades),
      blade_rotation_(float(camera.blade_rotation_deg * std::numbers::pi / 180)),
      narrowing_(float(1 / camera.squeeze)),
      world_up_(camera.up),
      width_(float(width)),
      height_(float(height)),
      moves_(!same(open_, close_)) {
  if (blades_ < 0 || blades_ == 1 || blades_ == 2)
    throw Error(fmt::format("camera: blades is {}; it must be 0 or at least 3", blades_));
  if (!(camera.squeeze > 0) || !std::isfinite(camera.squeeze))
    throw Error(fmt::format("camera: squeeze is {}; it must be positive", camera.squeeze));
}

/// Evenly on the unit disc, or the polygon with its corners on the circle: x right, y up.
V2f ShutterCamera::aperture(const V2f& lens) const {
  V2f p;
  if (blades_ == 0) {
    p = sample_disc(lens);
  } else {
    const float along = lens.x * float(blades_), first = std::floor(along), part = along - first;
    const auto corner = [&](float k) {
      const float angle = 2 * pi * k / float(blades_) + blade_rotation_;
      return V2f(std::sin(angle), std::cos(angle));
    };
    p = (corner(first) * (1 - part) + corner(first + 1) * part) * std::sqrt(lens.y);
  }
  p.x *= narrowing_;
  return p;
}

CameraPose ShutterCamera::pose_at(float time) const {
  const auto mix = [time](const auto& a, const auto& b) { return a + (b - a) * time; };
  CameraPose pose;
  pose.position = mix(open_.position, close_.position);
  aim(pose, mix(open_.forward, close_.forward), world_up_);
  pose.half_width = mix(open_.half_width, close_.half_width);
  pose.focus_distance = mix(open_.focus_distance, close_.focus_distance);
  pose.lens_radius = mix(open_.lens_radius, close_.lens_radius);
  return pose;
}

V2f ShutterCamera::project(const CameraPose& pose, const V3f& point) const {
  const V3f to = point - pose.position;
  const float scale = 0.5f * width_ / (pose.half_width * dot(to, pose.forward));
  return {0.5f * width_ + dot(to, pose.right) * scale, 0.5f * height_ - dot(to, pose.up) * scale};
}

}  // namespace drench::render
