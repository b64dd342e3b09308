#include "surfacing/foam_walls.h"

#include <algorithm>
#include <cmath>

namespace drench::surfacing {
namespace {

constexpr double level_set_voxel = 0.5, level_set_band = 2;  // spacings

/// Trilinear sample, m; plus or minus the band beyond it.
float sample(const LevelSet& set, const V3f& own) {
  int at[3], corner[3];
  float f[3];
  for (int k = 0; k < 3; ++k) {
    const float x = own[k] / set.voxel, cell = std::floor(x);
    const float index = cell - float(LevelSet::side * set.low[k]);
    if (!(index >= 0) || index >= float(LevelSet::side * set.blocks[k])) return set.band;
    at[k] = int(index) / LevelSet::side, corner[k] = int(index) % LevelSet::side;
    f[k] = x - cell;
  }
  const int block = set.block[size_t((at[2] * set.blocks[1] + at[1]) * set.blocks[0] + at[0])];
  if (block < 0) return block == LevelSet::outside ? set.band : -set.band;
  float sum = 0;
  for (int k = 0; k < 8; ++k) {
    const int x = k & 1, y = k >> 1 & 1, z = k >> 2;
    const float weight = (x ? f[0] : 1 - f[0]) * (y ? f[1] : 1 - f[1]) * (z ? f[2] : 1 - f[2]);
    const int index = ((corner[2] + z) * 9 + corner[1] + y) * 9 + corner[0] + x;
    sum += weight * set.value[size_t(LevelSet::corners) * size_t(block) + size_t(index)];
  }
  return sum;
}

struct OwnDistance {
  float value;
  V3f normal;
};

OwnDistance to_box(const V3f& own, const V3f& half) {
  V3f beyond, out, normal(0);
  int nearest = 0;
  for (int k = 0; k < 3; ++k) {
    beyond[k] = std::abs(own[k]) - half[k];
    out[k] = std::max(beyond[k], 0.f);
    if (beyond[k] > beyond[nearest]) nearest = k;
  }
  if (beyond[nearest] <= 0) {
    normal[nearest] = std::copysign(1.f, own[nearest]);
    return {beyond[nearest], normal};
  }
  const float length = out.length();
  for (int k = 0; k < 3; ++k) normal[k] = std::copysign(out[k] / length, own[k]);
  return {length, normal};
}

OwnDistance to_mesh(const V3f& own, const LevelSet& set) {
  const float e = 0.5f * set.voxel;
  V3f slope;
  for (int k = 0; k < 3; ++k) {
    V3f step(0);
    step[k] = e;
    slope[k] = sample(set, own + step) - sample(set, own - step);
  }
  const float size = slope.length();
  return {sample(set, own), size > 0 ? slope / size : V3f(0)};
}

Pose between(const Pose& before, const Pose& after, float s) {
  Pose pose;
  pose.position = before.position * (1 - double(s)) + after.position * double(s);
  for (int k = 0; k < 3; ++k)
    pose.axis[k] = (before.axis[k] * (1 - double(s)) + after.axis[k] * double(s)).normalized();
  return pose;
}

}  // namespace

FoamWalls::FoamWalls(const Shot& shot, int frame, const LevelSetMaker& level_set) : shot_(shot) {
  for (const Obstacle& obstacle : shot.obstacle) {
    Solid solid{&obstacle, obstacle_pose(obstacle, frame - 1), obstacle_pose(obstacle, frame), {}};
    if (obstacle.type == ObstacleType::mesh)
      solid.level_set =
          level_set(read_obstacle_mesh(shot, obstacle, frame, read_sequence_shape(shot, obstacle)),
                    level_set_voxel * shot.fluid.spacing, level_set_band * shot.fluid.spacing,
                    bounds_in_own_space(shot, obstacle, frame - 1, frame));
    solids_.push_back(std::move(solid));
  }
}

FoamWalls::Distance FoamWalls::distance(const Solid& solid, const Pose& pose,
                                        const V3f& position) const {
  const V3f own(pose.to_own(V3d(position)));
  OwnDistance found{own.y, V3f(0, 1, 0)};
  switch (solid.obstacle->type) {
    case ObstacleType::plane:
      break;
    case ObstacleType::box:
      found = to_box(own, V3f(solid.obstacle->size) * 0.5f);
      break;
    case ObstacleType::sphere: {
      const float length = own.length();
      found = {length - float(solid.obstacle->radius), length > 0 ? own / length : V3f(0, 1, 0)};
      break;
    }
    case ObstacleType::mesh:
      found = to_mesh(own, solid.level_set);
  }
  return {found.value, V3f(pose.to_world(V3d(found.normal)) - pose.position)};
}

/// Puts `position` just inside the solid where the path first enters it.
void FoamWalls::stop_at(const Solid& solid, const Pose& pose, const V3f& from, V3f& position,
                        float radius) const {
  const V3f displacement = position - from;
  const auto inside = [&](float t) {
    return distance(solid, pose, from + displacement * t).value < radius;
  };
  float low = 0, high = 0.5f;
  if (!inside(high)) low = 0.5f, high = 1;
  if (!inside(high) || inside(low)) return;
  for (int k = 0; k < 12; ++k) {
    const float middle = 0.5f * (low + high);
    (inside(middle) ? high : low) = middle;
  }
  position = from + displacement * high;
}

FoamWalls::Touch FoamWalls::keep_out(const V3f& from, V3f& position, float radius, float s) const {
  Touch touch;
  for (const Solid& solid : solids_) {
    const Pose pose = between(solid.before, solid.after, s);
    stop_at(solid, pose, from, position, radius);
    const Distance d = distance(solid, pose, position);
    if (!(d.value < radius)) continue;
    const V3d own = pose.to_own(V3d(position));
    touch.met = true;
    touch.normal = d.normal;
    touch.velocity =
        V3f((solid.after.to_world(own) - solid.before.to_world(own)) * shot_.timeline.fps);
    position += d.normal * (radius - d.value);
  }
  const Domain& domain = shot_.domain;
  for (int axis = 0; axis < 3; ++axis) {
    const float low = float(domain.min[axis]), high = float(domain.max[axis]);
    if (domain.axis[axis] == Axis::periodic)
      position[axis] -= (high - low) * std::floor((position[axis] - low) / (high - low));
    if (domain.axis[axis] != Axis::walls) continue;
    const float inner = std::min(radius, 0.5f * (high - low));
    const float held = std::clamp(position[axis], low + inner, high - inner);
    if (held == position[axis]) continue;
    touch = {true, V3f(0),
             V3f(domain.wall_velocity.all()[size_t(2 * axis + (held < position[axis]))])};
    touch.normal[axis] = held < position[axis] ? -1.f : 1.f;
    position[axis] = held;
  }
  return touch;
}

bool FoamWalls::lost(const V3f& position) const {
  for (int axis = 0; axis < 3; ++axis)
    if (shot_.domain.axis[axis] == Axis::open &&
        !(position[axis] >= float(shot_.domain.min[axis]) &&
          position[axis] <= float(shot_.domain.max[axis])))
      return true;
  return false;
}

}  // namespace drench::surfacing
