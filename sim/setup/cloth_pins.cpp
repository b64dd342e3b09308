#include "sim/setup/cloth_pins.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/shot/probe_check.h"
#include "sim/passes/coupling/geometry.h"
#include "sim/setup/scene.h"

namespace drench::sim {

namespace {

/// A frame on a triangle: along its first side, across it, and its unit normal.
std::array<V3d, 3> axes_of(const std::array<V3d, 3>& corner) {
  const V3d along = (corner[1] - corner[0]).normalized(),
            normal = along.cross(corner[2] - corner[0]).normalized();
  return {along, normal.cross(along), normal};
}

V3d foot_on(const std::array<V3d, 3>& corner, const ClothPins::OnTriangle& at) {
  return corner[0] + (corner[1] - corner[0]) * at.weight[0] +
         (corner[2] - corner[0]) * at.weight[1];
}

cpu::Vec3<double> vec(const V3d& v) { return {v.x, v.y, v.z}; }

/// The nearest place of an obstacle's surface to one of its own coordinates.
ClothPins::OnTriangle nearest_on(ObstacleSet& obstacles, int obstacle, const V3d& own,
                                 double frame) {
  ClothPins::OnTriangle best;
  double least = 1e300;
  for (size_t t = 0; t < obstacles.triangles(obstacle); ++t) {
    const std::array<V3d, 3> c = obstacles.triangle_at(obstacle, t, frame);
    const auto found = cpu::closest_point(vec(own), vec(c[0]), vec(c[1]), vec(c[2]));
    if (found.distance2 >= least || (c[1] - c[0]).cross(c[2] - c[0]).length() == 0) continue;
    least = found.distance2;
    best = {t, {found.wb, found.wc}, {}};
  }
  const std::array<V3d, 3> corner = obstacles.triangle_at(obstacle, best.triangle, frame),
                           axis = axes_of(corner);
  const V3d off = own - foot_on(corner, best);
  for (size_t k = 0; k < 3; ++k) best.off[k] = axis[k].dot(off);
  return best;
}

void bound(ClothPins::Group& group) {
  group.low = V3d(1e30), group.high = V3d(-1e30);
  for (const V3d& p : group.own) {
    for (int k = 0; k < 3; ++k)
      group.low[k] = std::min(group.low[k], p[k]), group.high[k] = std::max(group.high[k], p[k]);
  }
}

V3d middle_of(const std::vector<V3d>& places) {
  V3d low(1e30), high(-1e30);
  for (const V3d& p : places) {
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  }
  return (low + high) / 2;
}

/// What the keys of `position` change by since the start: differences of places far from the origin
/// would depend on where the shot stands.
void count_from_start(Animated<V3d>& position, double frame) {
  const V3d start = position.at(frame);
  for (auto& [at, value] : position.keys) value -= start;
}

}  // namespace

ClothPins::ClothPins(const Shot& shot, Scene& scene)
    : timeline_(shot.timeline), spacing_(shot.fluid.spacing), begin_(-shot.preroll) {
  for (size_t s = 0; s < shot.cloth.size(); ++s)
    for (size_t k = 0; k < shot.cloth[s].pin.size(); ++k)
      if (!shot.cloth[s].pin[k].stands()) group_.push_back(group_of(shot, scene, s, k));
  HostVec& speed = scene.start.cloth_velocity;
  for (const Group& g : group_) {
    scene.cloth.pin_vertex.insert(scene.cloth.pin_vertex.end(), g.vertex.begin(), g.vertex.end());
    const Moments at = moments(g, begin_, moment_length());
    for (size_t k = 0; k < g.vertex.size() && g.moves && g.stiffness == 0; ++k) {
      const V3d u = velocity(g, k, scene.obstacles, at);
      const auto v = size_t(g.vertex[k]);
      speed.x[v] = float(u.x), speed.y[v] = float(u.y), speed.z[v] = float(u.z);
    }
  }
}

ClothPins::Group ClothPins::group_of(const Shot& shot, Scene& scene, size_t sheet,
                                     size_t index) const {
  const ClothPin& pin = shot.cloth[sheet].pin[index];
  const double frame = film_frame(begin_);
  const HostVec& x = scene.start.cloth_position;
  Group g;
  g.cloth = int(sheet), g.pin = int(index), g.moves = pin.moves(), g.stiffness = pin.stiffness;
  g.release = pin.lets_go() ? pin.release - shot.preroll : 1e30;
  for (const int node : scene.sheet[sheet].group[index]) {
    const auto v = size_t(scene.first_vertex[sheet] + node);
    g.vertex.push_back(int(v)), g.start.push_back({x.x[v], x.y[v], x.z[v]});
  }
  if (pin.on.empty()) {
    g.carrier.position = pin.position, g.carrier.rotation_deg = pin.rotation_deg;
    g.pivot = middle_of(g.start);
    for (int c = 0; c < 3 && pin.pivot; ++c) g.pivot[c] = scene.frame.to_local(c, (*pin.pivot)[c]);
  } else {
    g.obstacle = *obstacle_named(shot, pin.on);
    g.carrier = shot.obstacle[size_t(g.obstacle)];
    const V3d at = g.carrier.position.at(frame);
    for (int c = 0; c < 3; ++c) g.pivot[c] = snapped(at[c] - scene.frame.origin[c]);
  }
  count_from_start(g.carrier.position, frame);
  const Pose pose = obstacle_pose(g.carrier, frame);
  for (const V3d& p : g.start) g.own.push_back(pose.to_own(p - g.pivot));
  bound(g);
  if (g.obstacle >= 0 && scene.obstacles.deforms(g.obstacle)) {
    for (const V3d& own : g.own)
      g.on.push_back(nearest_on(scene.obstacles, g.obstacle, own, frame));
  }
  return g;
}

ClothPins::Moment ClothPins::moment(const Group& g, double time) const {
  const double frame = film_frame(time);
  return {frame, obstacle_pose(g.carrier, frame)};
}

ClothPins::Moments ClothPins::moments(const Group& g, double time, double h) const {
  return {{moment(g, time), moment(g, time + h), moment(g, time + 2 * h)}, h};
}

V3d ClothPins::place(const Group& g, size_t k, ObstacleSet& obstacles, double time) const {
  return place(g, k, obstacles, moment(g, time));
}

V3d ClothPins::place(const Group& g, size_t k, ObstacleSet& obstacles, const Moment& when) const {
  if (!g.moves) return g.start[k];
  V3d own = g.own[k];
  if (!g.on.empty()) {
    const OnTriangle& at = g.on[k];
    const std::array<V3d, 3> corner = obstacles.triangle_at(g.obstacle, at.triangle, when.frame),
                             axis = axes_of(corner);
    own = foot_on(corner, at) + axis[0] * at.off[0] + axis[1] * at.off[1] + axis[2] * at.off[2];
  }
  return g.pivot + when.pose.to_world(own);
}

V3d ClothPins::velocity(const Group& g, size_t k, ObstacleSet& obstacles,
                        const Moments& now) const {
  const auto at = [&](int n) { return place(g, k, obstacles, now.at[n]); };
  return (at(1) * 4 - at(0) * 3 - at(2)) / (2 * now.h);
}

double ClothPins::snapped(double x) const {
  const double step = spacing_ / (1 << 20);
  return std::round(x / step) * step;
}

PinsNow ClothPins::over(ObstacleSet& obstacles, double start, double end) const {
  PinsNow now;
  // Within the step, so that of a sequence no other frame's mesh is asked for.
  const double h = start < end ? -std::min(moment_length(), 0.25 * (end - start)) : moment_length();
  for (const Group& g : group_) {
    const bool holds = start < g.release;
    const Moments at = moments(g, end, h);
    for (size_t k = 0; k < g.vertex.size(); ++k) {
      V3d x = holds ? place(g, k, obstacles, at.at[0]) : g.start[k], u(0);
      for (int c = 0; c < 3 && g.obstacle >= 0; ++c) x[c] = snapped(x[c]);
      if (holds && g.moves && g.stiffness == 0) u = velocity(g, k, obstacles, at);
      const float high[3] = {float(x.x), float(x.y), float(x.z)};
      now.place.push(high[0], high[1], high[2]);
      now.low.push(float(x.x - high[0]), float(x.y - high[1]), float(x.z - high[2]));
      now.velocity.push(float(u.x), float(u.y), float(u.z));
      now.pull.push_back(holds ? float(g.stiffness) : -1.f);
    }
  }
  return now;
}

double ClothPins::stop(double time, double end) const {
  for (const Group& g : group_)
    if (g.release > time) end = std::min(end, g.release);
  return end;
}

double ClothPins::travel(const Group& g, double begin, double end) const {
  const Pose from = obstacle_pose(g.carrier, film_frame(begin)),
             to = obstacle_pose(g.carrier, film_frame(end));
  double farthest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    V3d own;
    for (int k = 0; k < 3; ++k) own[k] = corner >> k & 1 ? g.high[k] : g.low[k];
    farthest = std::max(farthest, (to.to_world(own) - from.to_world(own)).length());
  }
  return farthest;
}

double ClothPins::limit(double time, double dt) const {
  const double most = 0.4 * spacing_;
  for (const Group& g : group_) {
    if (!g.moves || g.stiffness > 0 || time >= g.release) continue;
    for (int tries = 0; tries < 40; ++tries) {  // a shorter step may have another mean speed
      const double moved = travel(g, time, time + dt);
      if (moved <= most) break;
      dt *= std::max(0.5, 0.999 * most / moved);
    }
  }
  return dt;
}

double ClothPins::fastest() const {
  double speed = 0;
  const double part = 0.25 / timeline_.fps,
               last = (timeline_.last - timeline_.first) / timeline_.fps;
  for (const Group& g : group_) {
    for (double t = begin_; g.moves && t < std::min(last, g.release); t += part)
      speed = std::max(speed, travel(g, t, t + part) / part);
  }
  return speed;
}

}  // namespace drench::sim
