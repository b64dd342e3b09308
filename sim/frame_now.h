#pragma once
// What drives the frame of the domain during one step. Host and device, both builds.

namespace drench::sim {

/// Of a frame that turns about an axis. Local coordinates.
struct FrameNow {
  float gravity[3] = {0, 0, 0};  // m/s^2, as the frame sees it
  float rate[3] = {0, 0, 0};     // rad/s, mean angular velocity over the step
  float change[3] = {0, 0, 0};   // rad/s, of the angular velocity over the step
  float centre[3] = {0, 0, 0};   // m, a point of the axis
};

}  // namespace drench::sim
