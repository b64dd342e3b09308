#include "render/scene/rotation.h"

#include <algorithm>
#include <limits>

#include "render/scene/scene.h"

namespace drench::render {

namespace {

constexpr double time_step = 1e-3;  // frames; a velocity is that of obstacle_surface
constexpr int max_segments = 16;

V3d rotated(const Pose& from, const Pose& to, const V3d& v) {
  return to.to_world(from.to_own(v + from.position)) - to.position;
}

}  // namespace

RotationalMotion::RotationalMotion(const Obstacle& obstacle, int frame)
    : obstacle_(obstacle),
      frame_(frame),
      pose_(obstacle_pose(obstacle, frame)),
      before_(obstacle_pose(obstacle, frame - time_step)),
      after_(obstacle_pose(obstacle, frame + time_step)) {}

RotationalMotion::At::At(const RotationalMotion& motion, double frames)
    : motion_(motion),
      frames_(frames),
      pose_(obstacle_pose(motion.obstacle_, motion.frame_ + frames)) {}

V3f RotationalMotion::At::position(const V3f& p, const V3f& v) const {
  const V3d own = motion_.pose_.to_own(V3d(p));
  const V3d posed =
      (motion_.after_.to_world(own) - motion_.before_.to_world(own)) / (2 * time_step);
  return V3f(pose_.to_world(own) + rotated(motion_.pose_, pose_, V3d(v) - posed) * frames_);
}

V3f RotationalMotion::At::normal(const V3f& n) const {
  return V3f(rotated(motion_.pose_, pose_, V3d(n)));
}

/// As far as an arc's ends are off its tangent in the middle, its middle is off its chord; from n
/// chords an n^2-th of that.
int Scene::segments_of(const TriangleMesh& mesh, const RotationalMotion& motion) const {
  if (close_ == open_) return 0;
  const float per_frame = float(1 / fps_);
  float bend = 0;
  for (const double frames : {open_, close_}) {
    const RotationalMotion::At at(motion, frames);
    for (size_t k = 0; k < mesh.position.size(); ++k) {
      const V3f& p = mesh.position[k];
      const V3f step = mesh.velocity.empty() ? V3f(0) : mesh.velocity[k] * per_frame;
      const float off = (at.position(p, step) - p - step * float(frames)).length();
      const float distance = (p - camera_.open().position).length();
      bend = std::max(bend, off / std::max(distance, std::numeric_limits<float>::min()));
    }
  }
  bend *= camera_.pixels_per_radian();
  if (bend < visible_motion) return 0;
  return std::min(max_segments, int(std::ceil(std::sqrt(bend / visible_motion))));
}

void Scene::add_motion_keys(SceneObject& object, const TriangleMesh& mesh,
                            const RotationalMotion& motion, int segments) const {
  for (int k = 0; k <= segments; ++k) {
    const RotationalMotion::At at(motion, open_ + (close_ - open_) * k / segments);
    SceneObject::Key& key = object.key.emplace_back();
    for (size_t v = 0; v < mesh.position.size(); ++v) {
      const V3f velocity = mesh.velocity.empty() ? V3f(0) : mesh.velocity[v];
      key.position.push_back(at.position(mesh.position[v], velocity * float(1 / fps_)));
      key.normal.push_back(at.normal(object.normal[v]));
    }
    key.position.push_back(V3f(0));
  }
  object.position = object.key.front().position;
  object.position_close = object.key.back().position;
}

}  // namespace drench::render
