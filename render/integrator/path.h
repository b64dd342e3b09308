#pragma once
// The path loop, compiled once for every set of features and chosen once for a frame.

#include <cstdint>
#include <span>
#include <vector>

#include "render/film/matte.h"
#include "render/integrator/photons.h"
#include "render/integrator/sampler.h"

namespace drench::render {

/// What the loop must be able to do for a frame. What is absent costs no branch.
struct Feature {
  enum : unsigned {
    motion_blur = 1,     // something, or the camera, moves in the shutter
    dielectric = 2,      // water: refraction, absorption, medium on the path
    sampled_lights = 4,  // lights are sampled, with multiple importance sampling
    thin_lens = 8,
    glossy = 16,        // metal, coats, rough dielectrics, fabric
    combinations = 32,  // of these
    mattes = 32,        // a plate goes behind; such frames have all the others switched on
  };
};

/// Sampling dimensions of the camera; those of the path's vertices follow from 8 on.
enum CameraDimension : uint32_t { filter_dimension, lens_dimension, time_dimension };

struct PathSample {
  V3f radiance;     // W/(sr m^2)
  float alpha = 1;  // less where the camera sees the background or a holdout
  V3f split{0.f};   // of what photons bring: GatheredLight
};

/// What a camera sample met, for the layers of a film.
struct PathRecord {
  std::vector<V3f> light;  // W/(sr m^2), what each group of lights gave; empty: not asked for
  Hit first;               // the ground or object met first, if any
  V3f position, normal;    // of it; normal to the side seen
  float time = 0;          // in the shutter
  V3f albedo;              // of the first diffuse surfaces, through water and glass
  bool shaded = false;     // whether there was one on this branch
  MatteRecord matte;
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

/// Camera samples that are on their way at once.
inline constexpr size_t paths_in_flight = 4;

/// Traces that many samples or fewer; `rays` counts rays traced.
using PathFunction = void (*)(const Scene&, const PathSettings&, std::span<CameraSample>,
                              uint64_t& rays);

/// @param features  any of Feature, combined
PathFunction path_function(unsigned features);

}  // namespace drench::render
