// Closed meshes filled with particles.

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/obstacle.h"
#include "sim/obstacle_view.h"
#include "sim/scene.h"

namespace drench::sim {

namespace {

constexpr double voxel = 0.5, band = 2.0;  // of the level set, in spacings
constexpr double rounding = 1e-3;          // spacings; a lattice may stand just as deep as asked
constexpr double most_particles = 2e8;

/// By the divergence theorem, whatever the orientation. m^3
double volume_of(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangle) {
    const V3d a(mesh.position[t.x]), b(mesh.position[t.y]), c(mesh.position[t.z]);
    sum += a.dot(b.cross(c)) / 6;
  }
  return std::abs(sum);
}

/// The mesh turned as in the world, about its own origin; its bounds.
struct Placed {
  TriangleMesh mesh;
  V3d low{1e30}, high{-1e30};
};
Placed place_mesh(const FluidVolume& volume) {
  Placed placed{read_closed_mesh(volume.mesh_file, volume.scale)};
  Obstacle frame;
  frame.rotation_deg = volume.rotation_deg;
  const Pose pose = obstacle_pose(frame, 0);
  for (V3f& p : placed.mesh.position) {
    const V3d turned = pose.to_world(V3d(p));
    p = V3f(turned);
    for (int k = 0; k < 3; ++k) {
      placed.low[k] = std::min(placed.low[k], turned[k]);
      placed.high[k] = std::max(placed.high[k], turned[k]);
    }
  }
  return placed;
}

void check_size(const Shot& shot, const Placed& placed, const std::string& name) {
  const double a = shot.fluid.spacing, count = volume_of(placed.mesh) / (a * a * a);
  const V3d size = placed.high - placed.low;
  const double most = 8.0 * (1 << 16) * voxel * a;  // 65536 blocks of the level set
  if (count <= most_particles && std::max({size.x, size.y, size.z}) <= most) return;
  throw Error(
      fmt::format("{}: {} is [{:.4g}, {:.4g}, {:.4g}] m large and would hold about {:.3g} "
                  "particles of fluid.spacing = {} m; at most {:.3g} are allowed. Use a "
                  "smaller scale or a larger spacing",
                  shot.file.string(), name, size.x, size.y, size.z, count, a, most_particles));
}

void check_walls(const Shot& shot, const V3d& p, const std::string& name) {
  for (int k = 0; k < 3; ++k) {
    const double low = shot.domain.min[k], high = shot.domain.max[k];
    if (shot.domain.axis[size_t(k)] != Axis::walls || (p[k] > low && p[k] < high)) continue;
    throw Error(
        fmt::format("{}: {} reaches to {:.4g} m in {}, beyond the domain's walls at {} and "
                    "{} m. Move it, or widen [domain]",
                    shot.file.string(), name, p[k], "xyz"[k], low, high));
  }
}

}  // namespace

std::vector<V3d> fill_volume(const Shot& shot, const FluidVolume& volume, const std::string& name,
                             const LevelSetMaker& make_level_set) {
  if (!make_level_set) throw std::logic_error("fill_volume: no make_level_set");
  const double a = shot.fluid.spacing, depth = (volume.inset - rounding) * a;
  const Placed placed = place_mesh(volume);
  check_size(shot, placed, name);
  const LevelSet set = make_level_set(placed.mesh, voxel * a, band * a);
  cpu::FieldView distance = cpu::field_view(set);
  distance.block = set.block.data(), distance.value = set.value.data();
  const V3d corner = shot.domain.min;
  int64_t first[3], last[3];
  for (int k = 0; k < 3; ++k) {
    first[k] = int64_t(std::floor((volume.position[k] + placed.low[k] - corner[k]) / a));
    last[k] = int64_t(std::ceil((volume.position[k] + placed.high[k] - corner[k]) / a));
  }
  std::vector<V3d> points;
  for (int64_t z = first[2]; z < last[2]; ++z) {
    for (int64_t y = first[1]; y < last[1]; ++y) {
      for (int64_t x = first[0]; x < last[0]; ++x) {
        const V3d p = corner + V3d(double(x) + 0.5, double(y) + 0.5, double(z) + 0.5) * a;
        const V3d own = p - volume.position;
        if (distance({float(own.x), float(own.y), float(own.z)}) > -depth) continue;
        check_walls(shot, p, name);
        points.push_back(p);
      }
    }
  }
  if (points.empty()) {
    throw Error(fmt::format(
        "{}: {} holds no particle: nowhere is {} {} spacings (fluid.spacing {} m) or more inside "
        "its surface. Use a smaller spacing, a larger scale, or a smaller inset",
        shot.file.string(), name, volume.mesh_file.string(), volume.inset, a));
  }
  return points;
}

}  // namespace drench::sim
