#include "pipeline/contract/shot/view_check.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/log.h"
#include "pipeline/contract/shot/light_check.h"
#include "pipeline/contract/shot/shot_table.h"

namespace drench {

namespace {

const Material* material_named(const Shot& shot, const std::string& name) {
  for (const std::vector<Material>* all : {&shot.material, &shot_table::built_in_materials()})
    for (const Material& material : *all)
      if (material.name == name) return &material;
  return nullptr;
}

bool shines(const Shot& shot) {
  if (!shot.light.empty()) return true;
  return std::any_of(shot.obstacle.begin(), shot.obstacle.end(), [&](const Obstacle& obstacle) {
    const Material* material = material_named(shot, obstacle.material);
    return obstacle.visible && material && material->emission != V3f(0);
  });
}

bool lies_in(const Obstacle& obstacle, const V3d& point, double frame) {
  const V3d own = obstacle_pose(obstacle, frame).to_own(point);
  if (obstacle.type == ObstacleType::sphere) return own.length() < obstacle.radius;
  if (obstacle.type != ObstacleType::box) return false;
  for (int k = 0; k < 3; ++k)
    if (!(std::abs(own[k]) < 0.5 * obstacle.size[k])) return false;
  return true;
}

/// Why a frame shows nothing; empty if it may show something.
std::string why_empty(const Shot& shot, const Imath::Box3d& all, double frame) {
  const V3d eye = shot.camera.position.at(frame), view = shot.camera.target.at(frame) - eye;
  for (const Obstacle& obstacle : shot.obstacle) {
    const Material* material = material_named(shot, obstacle.material);
    const bool opaque = material && material->type != MaterialType::dielectric;
    if (obstacle.visible && opaque && obstacle.matte == Matte::none &&
        lies_in(obstacle, eye, frame))
      return fmt::format("stands in obstacle \"{}\": move it out", obstacle.name);
  }
  const Ground& ground = shot.ground;
  if (ground.present) {
    const V3d beside = eye - ground.center;
    const bool over = std::max(std::abs(beside.x), std::abs(beside.z)) < ground.half_size;
    return over && eye.y < ground.height ? "stands under the ground: raise it" : "";
  }
  V3d farthest;
  for (int k = 0; k < 3; ++k) farthest[k] = view[k] > 0 ? all.max[k] : all.min[k];
  return (farthest - eye).dot(view) > 0 ? "" : "looks away from all there is: turn its target";
}

}  // namespace

void warn_of_empty_pictures(const Shot& shot) {
  if (!shines(shot))
    log_warning("shot", fmt::format("{}: there is no light, so that every frame is black. Add a "
                                    "[[light]]",
                                    shot.file.string()));
  const Imath::Box3d all = extent_of_scene(shot);
  constexpr int most_looks = 200;
  const Timeline& t = shot.timeline;
  const int step = std::max(1, (t.last - t.first) / most_looks);
  std::string why;
  for (int frame = t.first; frame <= t.last; frame += step) {
    why = why_empty(shot, all, frame);
    if (why.empty()) return;
  }
  log_warning("shot", fmt::format("{}: the camera {}", shot.file.string(), why));
}

}  // namespace drench
