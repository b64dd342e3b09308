#include "pipeline/contract/shot/light_check.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/log.h"

namespace drench {

namespace {

bool lies_in_front(const Imath::Box3d& box, const V3d& center, const V3d& normal) {
  V3d farthest;
  for (int k = 0; k < 3; ++k) farthest[k] = normal[k] > 0 ? box.max[k] : box.min[k];
  return (farthest - center).dot(normal) > 0;
}

/// Whether all light of a sun that comes from below meets the ground first.
bool is_hidden_by(const Ground& ground, const Shot& shot, const V3d& direction) {
  if (!ground.present || !(direction.y > 0)) return false;
  const V3d& top = shot.domain.max;
  const double reach =
      std::max({std::abs(top.x - ground.center.x), std::abs(top.z - ground.center.z),
                std::abs(shot.domain.min.x - ground.center.x),
                std::abs(shot.domain.min.z - ground.center.z)});
  const double along = std::hypot(direction.x, direction.z) / direction.y;
  return reach + along * std::max(0.0, top.y - ground.height) < ground.half_size;
}

/// Why nothing is seen of a light; empty if something may be.
std::string why_useless(const Shot& shot, const Light& light) {
  if (light.radiance == V3f(0)) return "is black: give it a radiance";
  if (light.type == LightType::environment) return "";
  const Ground& ground = shot.ground;
  if (light.type == LightType::sun)
    return is_hidden_by(ground, shot, light.direction)
               ? "shines up from under the ground: direction is the way its light travels"
               : "";
  const double top = light.type == LightType::rectangle
                         ? light.center.y + std::abs(light.u.y) + std::abs(light.v.y)
                         : light.center.y + light.radius;
  const V3d beside = light.center - ground.center;
  const bool over_ground = std::max(std::abs(beside.x), std::abs(beside.z)) < ground.half_size;
  if (ground.present && over_ground && top < ground.height)
    return "stands under the ground: raise its center";
  if (light.type == LightType::sphere) return "";
  const V3d normal = light.type == LightType::rectangle ? light.u.cross(light.v) : light.direction;
  const bool sees_ground = ground.present && normal.y < 0;
  Imath::Box3d all = extent_of_scene(shot);  // and who may look at it
  for (const auto& [frame, position] : shot.camera.position.keys) all.extendBy(position);
  if (sees_ground || lies_in_front(all, light.center, normal)) return "";
  return light.type == LightType::rectangle
             ? "shines away from all there is, along u x v: exchange u and v"
             : "shines away from all there is: turn its direction";
}

}  // namespace

Imath::Box3d extent_of_scene(const Shot& shot) {
  constexpr double far = 1e6;
  Imath::Box3d box(shot.domain.min, shot.domain.max);
  for (int k = 0; k < 3; ++k) {
    if (shot.domain.axis[size_t(k)] != Axis::open && shot.cloth.empty()) continue;
    box.min[k] = -far, box.max[k] = far;
  }
  for (const Obstacle& obstacle : shot.obstacle) {
    const bool bounded =
        obstacle.position.keys.size() < 2 &&
        (obstacle.type == ObstacleType::box || obstacle.type == ObstacleType::sphere);
    const double reach = !bounded                                ? far
                         : obstacle.type == ObstacleType::sphere ? obstacle.radius
                                                                 : obstacle.size.length() / 2;
    box.extendBy(obstacle.position.at(shot.timeline.first) - V3d(reach));
    box.extendBy(obstacle.position.at(shot.timeline.first) + V3d(reach));
  }
  return box;
}

void warn_of_useless_lights(const Shot& shot, const ShotSources& sources) {
  for (size_t i = 0; i < shot.light.size(); ++i) {
    const std::string why = why_useless(shot, shot.light[i]);
    if (why.empty()) continue;
    log_warning("shot", fmt::format("{}: light \"{}\" {}", sources.at(fmt::format("light[{}]", i)),
                                    shot.light[i].name, why));
  }
}

}  // namespace drench
