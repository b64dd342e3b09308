#pragma once
// How an image is estimated, for tests and measurements: every choice gives the same mean.

#include <filesystem>
#include <functional>
#include <memory>

#include "pipeline/contract/hash.h"
#include "render/sampler.h"

namespace drench::render {

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

/// Whether lamps are looked for through water from where they shine on (manifold.h).
enum class ManifoldWalks {
  none,
  some,
  if_calm,  // if walks find most of what photons bring
};

/// What render.denoise makes of a frame.
enum class Denoised {
  alone,  // smooth, by this frame only
  later,  // noisy, with the layers of noisy_frame.h
};

/// Where a frame's samples are kept until it is finished, so that a stopped one goes on.
struct FrameCheckpoint {
  std::filesystem::path file;  // empty: none is kept
  Digest inputs;               // of all that the frame is made from
  double every_s = 300;        // wall seconds between two; one is written on a stop, too
};

class SceneCache;
struct Film;

struct RenderOptions {
  Estimator estimator = Estimator::mis;
  EnvironmentSampling environment = EnvironmentSampling::automatic;
  FirstInterface first_interface = FirstInterface::both;
  WaterGuide water_guide = WaterGuide::on;
  ManifoldWalks walks = ManifoldWalks::if_calm;
  PixelOrder pixel_order = PixelOrder::morton;
  unsigned force_features = 0;  // features of path.h switched on although the frame has them not
  double most_photons = 1e7;    // of a round, see photon_rounds.h: 1.5 GB while they are sorted
  FrameCheckpoint checkpoint{};
  Denoised denoised = Denoised::alone;
  std::shared_ptr<SceneCache> cache{};  // of earlier frames of the shot; null: none
  /// Gets the beauty and its alpha as they refine: after 1, 2, 4... samples of every pixel. Null:
  /// none are made. The frame is the same bits with it and without.
  std::function<void(const Film&)> refined{};
};

}  // namespace drench::render
