// Surfacing beside OpenVDB's own ways from particles to a mesh, same scenes, same voxels, same run.

#include <cmath>
#include <string>

#include "surfacing/surface.h"
#include "tests/bench/bench.h"
#include "tests/bench/openvdb_rivals.h"
#include "tests/surfacing/mesh_checks.h"
#include "tests/surfacing/scenes.h"

namespace drench::bench {
namespace {

constexpr double spacing = 0.01;  // m
// In turns; the cheapest counts: other work only ever adds. What takes minutes has fewer.
constexpr int repeats = 7, long_repeats = 2;

struct Way {
  std::string name;
  std::function<TriangleMesh(const ParticleFrame&, double voxel)> mesh;
  double times_slower;  // what it must at least be
  int repeats;
};

TriangleMesh ours(const ParticleFrame& frame, double voxel) {
  SurfaceSettings settings;
  settings.voxel = voxel / spacing;
  return surface_frame(frame, settings);
}

void compare(const std::string& scene, const ParticleFrame& frame, double voxel,
             const std::vector<Way>& rivals, const Emit& emit) {
  std::vector<Way> ways{{"drench", ours, 1, repeats}};
  ways.insert(ways.end(), rivals.begin(), rivals.end());
  std::vector<Measured> best(ways.size());
  std::vector<TriangleMesh> mesh(ways.size());
  for (int k = 0; k < repeats; ++k)
    for (size_t w = 0; w < ways.size(); ++w) {
      if (k >= ways[w].repeats) continue;
      mesh[w] = {};
      const Measured cost = measure([&] { mesh[w] = ways[w].mesh(frame, voxel * spacing); });
      if (k == 0 || cost.cpu_s < best[w].cpu_s) best[w] = cost;
    }
  const double volume = static_cast<double>(frame.position.size()) * std::pow(spacing, 3);
  for (size_t w = 0; w < ways.size(); ++w) {
    Line line;
    line.method = ways[w].name;
    line.resolution = scene + ", " + std::to_string(frame.position.size()) + " particles, voxel " +
                      std::to_string(voxel).substr(0, 4) + " spacings";
    line.threads = hardware_threads();
    line.cost = best[w];
    const double ratio = best[w].cpu_s / best[0].cpu_s;
    line.more["times_our_cpu"] = ratio;
    if (w > 0) {
      line.error = ways[w].times_slower / ratio, line.gate = 1;
      line.error_of = "lead asked for over the lead";
    }
    const auto defects = surfacing_checks::defects_of(mesh[w]);
    line.more["triangles"] = mesh[w].triangle.size();
    line.more["parts"] = surfacing_checks::topology_of(mesh[w]).components;
    line.more["volume"] = surfacing_checks::volume_of(mesh[w]) / volume;
    line.more["open_edges"] = defects.unmatched_edges;
    line.more["repeated_edges"] = defects.repeated_edges;
    emit(line);
  }
}

void surface_vs_openvdb(const Emit& emit) {
  const Way classic{"OpenVDB spheres, 2 Gaussians, erosion", openvdb_level_set, 20, long_repeats};
  const auto smooth = [](double times) {
    return Way{"OpenVDB rasterizeSmoothSpheres", openvdb_smooth_spheres, times, repeats};
  };
  const ParticleFrame ball = surfacing_scenes::relaxed_ball(1000000, spacing, 40, 1);
  const ParticleFrame splash = surfacing_scenes::splash(1000000, spacing, 1);
  compare("ball", ball, 0.5, {smooth(4), classic}, emit);
  compare("splash", splash, 0.5, {smooth(2), classic}, emit);
  compare("splash", splash, 0.25, {smooth(2)}, emit);
}

const Registration versus{"surface_vs_openvdb", "surfacing beside OpenVDB's rasterisers and mesher",
                          surface_vs_openvdb};

}  // namespace
}  // namespace drench::bench
