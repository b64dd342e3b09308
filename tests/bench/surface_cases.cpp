// Surfacing: time against error on shapes with a closed form, and time on scenes that are mostly
// surface.

#include <cmath>
#include <string>

#include "surfacing/surface.h"
#include "tests/bench/bench.h"
#include "tests/surfacing/mesh_checks.h"
#include "tests/surfacing/scenes.h"
#include "tests/surfacing/shapes.h"

namespace drench::bench {
namespace {

constexpr double spacing = 0.01;  // m
constexpr int repeats = 3;        // the cheapest is taken: other work only ever adds
constexpr SurfaceKernel kernels[] = {SurfaceKernel::isotropic, SurfaceKernel::anisotropic};

struct Run {
  TriangleMesh mesh;
  SurfaceStats stats;
  Measured cost;
};

Run cheapest(const ParticleFrame& frame, const SurfaceSettings& settings) {
  Run best;
  for (int k = 0; k < repeats; ++k) {
    best.mesh = {};  // or it would count among the memory
    const Measured cost = measure(
        [&] { best.mesh = surface_frame(frame, settings, {}, InteriorBlocks::skip, &best.stats); });
    if (k == 0 || cost.cpu_s < best.cost.cpu_s) best.cost = cost;
  }
  return best;
}

Line line_of(const ParticleFrame& frame, const SurfaceSettings& settings, const Run& run) {
  Line line;
  line.method =
      std::string(settings.kernel == SurfaceKernel::anisotropic ? "anisotropic" : "isotropic") +
      ", voxel " + std::to_string(settings.voxel).substr(0, 4) + ", " +
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

size_t defects_of(const TriangleMesh& mesh) {
  const auto defects = surfacing_checks::defects_of(mesh);
  return defects.unmatched_edges + defects.repeated_edges + defects.split_fans +
         defects.bad_triangles;
}

/// The default settings on shapes with a closed form, five resolutions: no constant is fitted to
/// one of them.
void surface_error(const Emit& emit) {
  for (const double n : sizes({8e3, 24e3, 65e3, 250e3, 1e6}, 2)) {
    for (const surfacing_scenes::Shape& shape : surfacing_scenes::all_shapes(n)) {
      const ParticleFrame frame = surfacing_scenes::relaxed(shape, spacing, 60, 1);
      const Run run = cheapest(frame, {});
      const auto error = surfacing_scenes::shape_error(run.mesh, shape, spacing);
      Line line = line_of(frame, {}, run);
      line.method = shape.name + ", " + line.method;
      line.error = error.scatter, line.gate = 0.025;
      line.error_of = "scatter of vertices about the shape, spacings";
      line.more["bias"] = error.bias;
      line.more["max"] = error.max;
      line.more["volume_error"] = error.volume;
      line.more["normal_mean_deg"] = error.normal_mean;
      line.more["normal_max_deg"] = error.normal_max;
      line.more["defects"] = defects_of(run.mesh);
      line.more["sliver_share"] = surfacing_checks::sliver_share(run.mesh, 10);
      emit(line);
    }
  }
}

void emit_drops(const SurfaceSettings& settings, const Emit& emit) {
  const ParticleFrame drops = surfacing_scenes::lone_particles(1000, spacing, 1);
  const Run run = cheapest(drops, settings);
  Line line = line_of(drops, settings, run);
  line.method = "single particles, " + line.method;
  line.error = std::abs(surfacing_checks::volume_of(run.mesh) / (1000 * std::pow(spacing, 3)) - 1);
  line.error_of = "volume against that of the particles, relative", line.gate = 0.15;
  line.more["kept"] = surfacing_checks::topology_of(run.mesh).components;
  emit(line);
}

/// A sheet or a thread in one part without a hole.
Line whole_line(const std::string& what, double stretch, const ParticleFrame& frame,
                const SurfaceSettings& settings) {
  const Run run = cheapest(frame, settings);
  const auto topology = surfacing_checks::topology_of(run.mesh);
  Line line = line_of(frame, settings, run);
  line.method = what + ", " + line.method;
  line.resolution = "stretched to " + std::to_string(stretch).substr(0, 4) + " spacings";
  // a part without a hole has Euler's number 2, and every hole takes two
  line.error = static_cast<double>(topology.components) - 1 +
               static_cast<double>(2 * static_cast<long>(topology.components) - topology.euler) / 2;
  line.error_of = "holes and torn parts";
  line.more["volume"] = surfacing_checks::volume_of(run.mesh) /
                        (static_cast<double>(frame.position.size()) * std::pow(spacing, 3));
  line.more["sliver_share"] = surfacing_checks::sliver_share(run.mesh, 10);
  return line;
}

/// Single particles, and sheets and threads one particle thick whose particles stand farther and
/// farther apart; sheets on a plane of the lattice and askew to it.
void surface_thin(const Emit& emit) {
  for (const SurfaceKernel kernel : kernels)
    for (const double voxel : {0.5, 0.25}) {
      SurfaceSettings settings;
      settings.kernel = kernel;
      settings.voxel = voxel;
      emit_drops(settings, emit);
      const bool round = kernel == SurfaceKernel::isotropic;
      for (const double stretch : {1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6}) {
        const ParticleFrame sheet = surfacing_scenes::sheet({120, 120}, stretch, spacing, 0.1, 1);
        Line line = whole_line("sheet", stretch, sheet, settings);
        if (stretch < (round ? 1.35 : 1.55)) line.gate = 0;
        emit(line);
        line = whole_line("sheet askew", stretch, surfacing_scenes::askew(sheet, 1.1), settings);
        if (!round && stretch < 1.55) line.gate = 0;
        emit(line);
        const ParticleFrame row = surfacing_scenes::sheet({300, 1}, stretch, spacing, 0.1, 1);
        emit(whole_line("thread", stretch, surfacing_scenes::askew(row, 1.1), settings));
      }
    }
}

/// A splash with both kernels in turns: what the anisotropic one costs.
void surface_kernels(const Emit& emit) {
  for (const size_t n : sizes<size_t>({65000, 1000000}, 1)) {
    const ParticleFrame frame = surfacing_scenes::splash(n, spacing, 1);
    Line best[2];
    for (int turn = 0; turn < 2; ++turn)
      for (const SurfaceKernel kernel : kernels) {
        SurfaceSettings settings;
        settings.kernel = kernel;
        const Run run = cheapest(frame, settings);
        Line& line = best[static_cast<int>(kernel)];
        if (turn > 0 && run.cost.cpu_s >= line.cost->cpu_s) continue;
        line = line_of(frame, settings, run);
        line.method = "splash, " + line.method;
      }
    for (const SurfaceKernel kernel : kernels) {  // checks after all runs: they leave memory behind
      SurfaceSettings settings;
      settings.kernel = kernel;
      const TriangleMesh mesh = surface_frame(frame, settings);
      Line& line = best[static_cast<int>(kernel)];
      line.error = line.cost->cpu_s / best[0].cost->cpu_s, line.gate = 2;
      line.error_of = "CPU time over that of round kernels";
      line.more["volume"] =
          surfacing_checks::volume_of(mesh) / (static_cast<double>(n) * std::pow(spacing, 3));
      line.more["defects"] = defects_of(mesh);
      line.more["sliver_share"] = surfacing_checks::sliver_share(mesh, 10);
      emit(line);
    }
  }
}

/// Cost of a particle in scenes that are mostly surface; the smallest in turns with every other.
void surface_scaling(const Emit& emit) {
  const SurfaceSettings settings;
  const ParticleFrame small = surfacing_scenes::splash(65000, spacing, 1);
  for (const size_t n : sizes<size_t>({65000, 250000, 1000000, 2000000, 4000000, 8000000}, 2)) {
    const ParticleFrame frame = surfacing_scenes::splash(n, spacing, 1);
    const auto each = [](const ParticleFrame& f, const Run& run) {
      return 1e6 * run.cost.cpu_s / static_cast<double>(f.position.size());
    };
    const double beside = each(small, cheapest(small, settings));
    const Run run = cheapest(frame, settings);
    Line line = line_of(frame, settings, run);
    line.error = each(frame, run) / beside - 1;
    line.error_of = "cost of a particle over that of 65,000, relative", line.gate = 0.2;
    line.more["bytes_a_particle"] =
        run.cost.peak_mib * 1048576 / static_cast<double>(frame.position.size());
    emit(line);
  }
}

/// The highest memory while a splash is meshed, particles and all.
void surface_memory(const Emit& emit) {
  for (const auto& [voxel, gate] : {std::pair{0.5, 350.}, {0.25, 900.}}) {
    const ParticleFrame frame = surfacing_scenes::splash(1000000, spacing, 1);
    SurfaceSettings settings;
    settings.voxel = voxel;
    const Run run = cheapest(frame, settings);
    Line line = line_of(frame, settings, run);
    line.error = run.cost.peak_mib, line.gate = gate;
    line.error_of = "peak memory, MiB";
    emit(line);
  }
}

const Registration error{"surface_error", "surfacing: errors on five shapes, 8k to 1M particles",
                         surface_error, InQuick::yes};
const Registration thin{"surface_thin", "surfacing: single particles and stretched sheets",
                        surface_thin};
const Registration memory{"surface_memory",
                          "surfacing: memory on a splash of 1M at h = r and r / 2", surface_memory};
const Registration beside{"surface_kernels",
                          "surfacing: cost of anisotropic kernels beside round ones",
                          surface_kernels, InQuick::yes};
const Registration scaling{"surface_scaling", "surfacing: cost of a particle from 65k to 8M",
                           surface_scaling, InQuick::yes};

}  // namespace
}  // namespace drench::bench
