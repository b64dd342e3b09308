#pragma once
// The path loop, compiled once for every set of features and chosen once for a frame.

#include <cstdint>
#include <span>
#include <vector>

#include "render/film/path_record.h"
#include "render/integrator/photons.h"
#include "render/sampler.h"
#include "render/scene/features.h"

namespace drench::render {

/// Sampling dimensions of the camera; those of the path's vertices follow from 8 on.
enum CameraDimension : uint32_t { filter_dimension, lens_dimension, time_dimension };

struct PathSample {
  V3f radiance;     // W/(sr m^2)
  float alpha = 1;  // less where the camera sees the background or a holdout
  V3f split{0.f};   // of what photons bring: GatheredLight
};

struct PathSettings {
  int depth = 8;
  Estimator estimator = Estimator::mis;
  FirstInterface first_interface = FirstInterface::both;
  WaterGuide water_guide = WaterGuide::on;
  Bodies camera_in = 0;
  Background background = Background::sky;
  RefractionAlpha refraction_alpha = RefractionAlpha::opaque;
  const PhotonMap* photons = nullptr;  // with it, paths leave out what lamps send through bodies
  ManifoldWalks walks = ManifoldWalks::none;  // which find what the photons leave out
};

/// A camera sample to trace.
struct CameraSample {
  Sampler sampler;
  V2f film;                      // pixels
  PathRecord* record = nullptr;  // filled; without it shadow catchers are seen as any object
  PathSample found;
};

/// Camera samples that are traced at once.
inline constexpr size_t paths_in_flight = 4;

/// Traces that many samples or fewer; `rays` counts rays traced.
using PathFunction = void (*)(const Scene&, const PathSettings&, std::span<CameraSample>,
                              uint64_t& rays);

/// @param features  any of Feature, combined
PathFunction path_function(unsigned features);

}  // namespace drench::render
