#pragma once
// How an image is estimated, for tests and measurements: every choice gives the same mean.

#include "render/renderer.h"
#include "render/sampler.h"

namespace drench {

enum class Estimator {
  mis,         // light and surface sampling, power heuristic
  light_only,  // lights by light sampling alone
  bsdf_only,   // lights by surface sampling alone
};
enum class EnvironmentSampling {
  automatic,  // light sampling of a map; a constant or gradient sky is found by surface sampling
  always,
  never,
};
enum class FirstInterface {
  both,  // reflection and refraction both followed where the camera first meets water
  one,   // one of them, chosen by Fresnel's weight
};

enum class WaterGuide {
  on,  // part of the rays under water is aimed at lamps above it
  off,
};

class KeptParts;

struct RenderOptions {
  Estimator estimator = Estimator::mis;
  EnvironmentSampling environment = EnvironmentSampling::automatic;
  FirstInterface first_interface = FirstInterface::one;
  WaterGuide water_guide = WaterGuide::on;
  PixelOrder pixel_order = PixelOrder::morton;
  unsigned force_features = 0;  // features of path.h switched on although the frame has them not
  std::shared_ptr<KeptParts> parts{};  // of frames of the same shot before; null: none
};

/// render_frame with explicit options.
Film render_frame(const Shot& shot, int frame, const FrameGeometry& geometry,
                  const RenderOptions& options, RenderStats* stats = nullptr,
                  const std::function<void(double)>& progress = {});

}  // namespace drench
