#include "pipeline/contract/shot/view_check.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

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

/// Radius of a ball around an obstacle's position that holds it; infinite where only its file
/// tells.
double reach_of(const Obstacle& obstacle) {
  if (obstacle.type == ObstacleType::sphere) return obstacle.radius;
  if (obstacle.type == ObstacleType::box) return obstacle.size.length() / 2;
  return std::numeric_limits<double>::infinity();
}

/// Whether a ball lies wholly beside what the camera sees, by the corner of the picture.
bool is_beside(const Shot& shot, double frame, const V3d& center, double radius) {
  const V3d eye = shot.camera.position.at(frame), view = shot.camera.target.at(frame) - eye,
            to = center - eye;
  const double distance = to.length();
  if (!(distance > radius) || !(view.length() > 0)) return false;
  const double half_width = std::tan(shot.camera.fov_deg.at(frame) * std::numbers::pi / 360),
               half_height = half_width * shot.render.height / shot.render.width,
               corner = std::atan(std::hypot(half_width, half_height)),
               between = std::acos(std::clamp(to.dot(view) / (distance * view.length()), -1., 1.));
  return between > corner + std::asin(radius / distance);
}

/// Whether the camera looks past the domain, all sheets and all obstacles, as far as the shot tells
/// where they are.
bool looks_past_all(const Shot& shot, double frame) {
  const V3d low = shot.domain.min, high = shot.domain.max;
  if (!is_beside(shot, frame, (low + high) / 2, (high - low).length() / 2)) return false;
  for (const Cloth& cloth : shot.cloth) {
    if (!cloth.mesh_file.empty()) return false;
    const V3d half = (cloth.u + cloth.v) / 2;
    if (!is_beside(shot, frame, cloth.corner + half, cloth.u.length() + cloth.v.length()))
      return false;
  }
  return std::all_of(shot.obstacle.begin(), shot.obstacle.end(), [&](const Obstacle& obstacle) {
    return !obstacle.visible ||
           is_beside(shot, frame, obstacle.position.at(frame), reach_of(obstacle));
  });
}

/// Whether the whole domain is a dot in the picture.
bool is_far_off(const Shot& shot, double frame) {
  constexpr double dot = 4;  // pixels
  const V3d low = shot.domain.min, high = shot.domain.max, eye = shot.camera.position.at(frame);
  const double distance = ((low + high) / 2 - eye).length(), size = (high - low).length(),
               width =
                   2 * distance * std::tan(shot.camera.fov_deg.at(frame) * std::numbers::pi / 360);
  return size * shot.render.width < dot * width;
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
  if (is_far_off(shot, frame))
    return "is so far off that the domain is a dot: are its position and target in metres?";
  const Ground& ground = shot.ground;
  if (ground.present) {
    const V3d beside = eye - ground.center;
    const bool over = std::max(std::abs(beside.x), std::abs(beside.z)) < ground.half_size;
    return over && eye.y < ground.height ? "stands under the ground: raise it" : "";
  }
  V3d farthest;
  for (int k = 0; k < 3; ++k) farthest[k] = view[k] > 0 ? all.max[k] : all.min[k];
  if (!((farthest - eye).dot(view) > 0)) return "looks away from all there is: turn its target";
  return looks_past_all(shot, frame) ? "looks past all there is: turn its target" : "";
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
