// Case surface_rest: does the surface of water at rest flicker? A pool is simulated for 5 s after
// it was let go; then normals and heights of the surface are compared from frame to frame along
// vertical lines, a spacing and a quarter apart and four spacings off the walls.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "sim/simulator.h"
#include "surfacing/surface.h"
#include "tests/bench/bench.h"

namespace drench::bench {
namespace {

using Imath::V3d;

constexpr double spacing = 0.01, width = 0.3, depth = 0.15, rim = 0.04;  // m
constexpr int lines = 177;                                               // along either axis
constexpr double gap = (width - 2 * rim) / (lines - 1);

struct Place {
  V3d normal{0};
  double height = 0;  // m
};
using Heights = std::vector<Place>;  // by line; without a normal where there is no surface

Shot pool() {
  Shot shot;
  shot.name = shot.file = "pool";
  shot.timeline.first = 1001, shot.timeline.last = 1121;
  shot.fluid.spacing = spacing;
  shot.fluid.tolerance = 1e-4;
  shot.domain.min = V3d(0), shot.domain.max = V3d(width);
  shot.fluid.box = {{V3d(0), V3d(width, depth, width), V3d(0)}};
  return shot;
}

/// Where the lines pass through the triangles that face up.
Heights heights_of(const TriangleMesh& mesh) {
  Heights heights(size_t(lines) * lines);
  for (const auto& t : mesh.triangle) {
    const V3d a(mesh.position[t.x]), b(mesh.position[t.y]), c(mesh.position[t.z]);
    const double area = (b.z - a.z) * (c.x - a.x) - (b.x - a.x) * (c.z - a.z);
    if (std::min({a.y, b.y, c.y}) < 0.5 * depth || area <= 0) continue;
    const auto [low_x, high_x] = std::minmax({a.x, b.x, c.x});
    const auto [low_z, high_z] = std::minmax({a.z, b.z, c.z});
    const auto first = [](double at) { return std::max(0, int(std::ceil((at - rim) / gap))); };
    const auto last = [](double at) { return std::min(lines - 1., std::floor((at - rim) / gap)); };
    for (int j = first(low_z); j <= last(high_z); ++j)
      for (int i = first(low_x); i <= last(high_x); ++i) {
        const double x = rim + i * gap, z = rim + j * gap;
        const double u = ((z - a.z) * (c.x - a.x) - (x - a.x) * (c.z - a.z)) / area,
                     v = ((b.z - a.z) * (x - a.x) - (b.x - a.x) * (z - a.z)) / area;
        if (u < 0 || v < 0 || u + v > 1) continue;
        const V3d normal = V3d(mesh.normal[t.x]) * (1 - u - v) + V3d(mesh.normal[t.y]) * u +
                           V3d(mesh.normal[t.z]) * v;
        heights[size_t(j) * lines + size_t(i)] = {normal.normalized(),
                                                  a.y * (1 - u - v) + b.y * u + c.y * v};
      }
  }
  return heights;
}

double degrees_between(const V3d& a, const V3d& b) {
  return std::atan2(a.cross(b).length(), a.dot(b)) * 180 / std::numbers::pi;
}

void rest(const Emit& emit) {
  constexpr int pairs = 6;
  Simulator simulator(pool(), {.device = Device::cpu});
  while (simulator.frame() < 1121 - pairs) simulator.advance_frame();
  Heights before = heights_of(surface_frame(simulator.particles(), {}));
  for (int pair = 0; pair < pairs; ++pair) {
    simulator.advance_frame();
    const Heights now = heights_of(surface_frame(simulator.particles(), {}));
    double turned = 0, moved = 0, tilt = 0, most = 0;
    int seen = 0;
    for (size_t k = 0; k < now.size(); ++k) {
      if (now[k].height == 0 || before[k].height == 0) continue;
      const double angle = degrees_between(now[k].normal, before[k].normal);
      turned += angle * angle, most = std::max(most, angle), ++seen;
      tilt += std::pow(degrees_between(now[k].normal, V3d(0, 1, 0)), 2);
      moved += std::pow((now[k].height - before[k].height) / spacing, 2);
    }
    Line line;
    line.method = "frames " + std::to_string(simulator.frame() - 1) + " and the next";
    line.resolution = std::to_string(simulator.particles().position.size()) + " particles";
    line.threads = hardware_threads();
    line.error = std::sqrt(turned / seen), line.gate = 0.2;
    line.error_of = "RMS change of normals from frame to frame, degrees";
    line.more["largest"] = most;
    line.more["moved_spacings"] = std::sqrt(moved / seen);
    line.more["off_level_degrees"] = std::sqrt(tilt / seen);
    line.more["covered"] = double(seen) / double(now.size());
    emit(line);
    before = now;
  }
}

const Registration still{"surface_rest", "does the surface of a pool at rest flicker", rest};

}  // namespace
}  // namespace drench::bench
