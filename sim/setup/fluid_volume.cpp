// Closed meshes filled with particles.

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "sim/setup/mesh_interior.h"
#include "sim/setup/scene.h"

namespace drench::sim {

namespace {

/// The mesh turned as in the world, about its own origin.
TriangleMesh turned_mesh(const FluidVolume& volume) {
  TriangleMesh mesh = read_closed_mesh(volume.mesh_file, volume.scale);
  Obstacle frame;
  frame.rotation_deg = volume.rotation_deg;
  const Pose pose = obstacle_pose(frame, 0);
  for (V3f& p : mesh.position) p = V3f(pose.to_world(V3d(p)));
  return mesh;
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

FilledVolume fill_volume(const Shot& shot, const FluidVolume& volume, const std::string& name,
                         const LevelSetMaker& make_level_set) {
  const MeshInterior interior(shot, turned_mesh(volume), volume.inset, name, make_level_set);
  const Pose pose{volume.position, {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)}};
  FilledVolume filled{{}, interior.volume()};
  std::vector<V3d>& points = filled.place;
  for (const Cell& cell : interior.cells(shot, pose)) {
    points.push_back(place_of(shot, cell));
    check_walls(shot, points.back(), name);
  }
  if (points.empty()) {
    throw Error(fmt::format(
        "{}: {} holds no particle: nowhere is {} {} spacings (fluid.spacing {} m) or more inside "
        "its surface. Use a smaller spacing, a larger scale, or a smaller inset",
        shot.file.string(), name, volume.mesh_file.string(), volume.inset, shot.fluid.spacing));
  }
  return filled;
}

}  // namespace drench::sim
