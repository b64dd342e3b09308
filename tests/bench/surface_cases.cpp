// Surfacing: time against error on the analytic sphere, and time on scenes that are mostly surface.

#include <cmath>
#include <string>

#include "surfacing/surface.h"
#include "tests/bench/bench.h"
#include "tests/surfacing/mesh_checks.h"
#include "tests/surfacing/scenes.h"

namespace drench::bench {
namespace {

constexpr double spacing = 0.01;  // m
constexpr int repeats = 3;        // the cheapest is taken: other work only ever adds

struct Run {
  TriangleMesh mesh;
  SurfaceStats stats;
  Measured cost;
};

Run cheapest(const ParticleFrame& frame, const SurfaceSettings& settings) {
  Run best;
  for (int k = 0; k < repeats; ++k) {
    Run run;
    run.cost = measure(
        [&] { run.mesh = surface_frame(frame, settings, InteriorBlocks::skip, &run.stats); });
    if (k == 0 || run.cost.cpu_s < best.cost.cpu_s) best = std::move(run);
  }
  return best;
}

Line line_of(const ParticleFrame& frame, const SurfaceSettings& settings, const Run& run) {
  Line line;
  line.method = "colour field, voxel " + std::to_string(settings.voxel).substr(0, 4) + ", " +
                std::to_string(settings.smoothing) + " passes";
  line.resolution = std::to_string(frame.position.size()) + " particles";
  line.threads = hardware_threads();
  line.cost = run.cost;
  line.more["triangles"] = run.stats.triangles;
  line.more["parts"] = run.stats.components;
  line.more["evaluated_blocks"] = run.stats.evaluated_blocks;
  line.more["interior_blocks"] = run.stats.interior_blocks;
  line.more["cpu_us_per_particle"] =
      1e6 * run.cost.cpu_s / static_cast<double>(frame.position.size());
  line.more["step_wall_s"] = {{"bin", run.stats.bin_s},       {"weigh", run.stats.weight_s},
                              {"field", run.stats.field_s},   {"extract", run.stats.extract_s},
                              {"smooth", run.stats.smooth_s}, {"velocity", run.stats.velocity_s}};
  return line;
}

/// Relaxed balls; the error is the scatter of the vertices about the mean radius, which no choice
/// of iso value can remove; bias, largest error, volume and normals stand beside it.
void surface_sphere(const Emit& emit) {
  for (const size_t n : {65000, 250000, 1000000}) {
    const ParticleFrame frame = surfacing_scenes::relaxed_ball(n, spacing, 60, 1);
    for (const auto& [voxel, smoothing] :
         {std::pair{1.0, 4}, {0.5, 0}, {0.5, 10}, {0.5, 25}, {0.25, 40}}) {
      if (voxel < 0.5 && n > 250000) continue;  // 9 million triangles say nothing new
      SurfaceSettings settings;
      settings.voxel = voxel;
      settings.smoothing = smoothing;
      const Run run = cheapest(frame, settings);
      const auto error = surfacing_checks::sphere_error(
          run.mesh, surfacing_scenes::ball_radius(n, spacing), spacing);
      Line line = line_of(frame, settings, run);
      line.error = error.scatter;
      line.error_of = "scatter of vertices about the sphere, spacings";
      if (voxel == 0.5 && smoothing == 10) line.gate = 0.025;
      line.more["bias"] = error.bias;
      line.more["max"] = error.max;
      line.more["volume_error"] = error.volume;
      line.more["normal_mean_deg"] = error.normal_mean;
      line.more["normal_max_deg"] = error.normal_max;
      emit(line);
    }
  }
}

/// Pool, crown and drops: extraction and smoothing rule here. The error is that of the volume.
void surface_splash(const Emit& emit) {
  for (const size_t n : {250000, 1000000}) {
    const ParticleFrame frame = surfacing_scenes::splash(n, spacing, 1);
    for (const double voxel : {1.0, 0.5}) {
      SurfaceSettings settings;
      settings.voxel = voxel;
      const Run run = cheapest(frame, settings);
      const double particles = static_cast<double>(frame.position.size()) * std::pow(spacing, 3);
      const auto defects = surfacing_checks::defects_of(run.mesh);
      Line line = line_of(frame, settings, run);
      line.error = std::abs(surfacing_checks::volume_of(run.mesh) / particles - 1);
      line.error_of = "volume against that of the particles, relative";
      if (voxel == 0.5) line.gate = 0.05;
      line.more["defects"] = defects.unmatched_edges + defects.repeated_edges + defects.split_fans +
                             defects.bad_triangles;
      line.more["sliver_share"] = surfacing_checks::sliver_share(run.mesh, 10);
      emit(line);
    }
  }
}

const Registration sphere{
    "surface_sphere", "surfacing: time and error on a sphere, 65k to 1M particles", surface_sphere};
const Registration splash{"surface_splash", "surfacing: time, volume and defects on a splash",
                          surface_splash};

}  // namespace
}  // namespace drench::bench
