#pragma once
// Meshes + camera + lights -> film -> EXR.

#include <cstdint>
#include <functional>

#include "pipeline/contract/shot/shot.h"
#include "render/film/film.h"
#include "render/frame_geometry.h"

namespace drench::render {

struct RenderOptions;

struct RenderStats {
  uint64_t camera_samples = 0, rays = 0;
  double relative_mse = 0;  // of the frame, as its samples tell; 0 with fewer than 16 a pixel
  double photon_error = 0;  // the part of it that photons have
  double cpu_s = 0;         // of the whole process during the call
  /// m: photons blur caustics by that at most, of several rounds in the mean; 0: all is right in
  /// the mean.
  double photon_radius = 0;
  double walked = 0;  // fraction of photons' light that manifold walks (manifold.h) would find
};

/// Path-traces one frame. The same bits for any thread count and tile order.
/// @param progress  called with the finished fraction 0..1; may throw to stop.
/// @throws Error for a map or texture that cannot be read, or a light or camera without extent.
Film render_frame(const Shot& shot, int frame, const FrameGeometry& geometry,
                  RenderStats* stats = nullptr, const std::function<void(double)>& progress = {});

/// The same with explicit options (options.h).
Film render_frame(const Shot& shot, int frame, const FrameGeometry& geometry,
                  const RenderOptions& options, RenderStats* stats = nullptr,
                  const std::function<void(double)>& progress = {});

}  // namespace drench::render
