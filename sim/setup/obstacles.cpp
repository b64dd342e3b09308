#include "sim/setup/obstacles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "pipeline/contract/error.h"
#include "sim/passes/obstacle/obstacle_distance.h"
#include "sim/setup/scene.h"
#include "sim/setup/scene_report.h"

namespace drench::sim {

namespace {

constexpr double voxel = 0.5, band = 2.0;  // of level sets, in spacings
constexpr double far_off = 1e30;

void bound(const TriangleMesh& mesh, V3d& low, V3d& high) {
  for (const V3f& p : mesh.position) {
    for (int k = 0; k < 3; ++k)
      low[k] = std::min(low[k], double(p[k])), high[k] = std::max(high[k], double(p[k]));
  }
}

V3d corner_of(const V3d& low, const V3d& high, int corner) {
  return {corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y, corner & 4 ? high.z : low.z};
}

/// Speed of rigid motion is greatest at a corner of the bounds.
double corner_travel(const Obstacle& obstacle, const V3d& low, const V3d& high, double begin,
                     double end) {
  const Pose from = obstacle_pose(obstacle, begin), to = obstacle_pose(obstacle, end);
  double farthest = 0;
  for (int c = 0; c < 8; ++c) {
    const V3d own = corner_of(low, high, c);
    farthest = std::max(farthest, (to.to_world(own) - from.to_world(own)).length());
  }
  return farthest;
}

TriangleMesh mixed(const TriangleMesh& a, const TriangleMesh& b, double share) {
  TriangleMesh mesh = a;
  for (size_t k = 0; k < mesh.position.size(); ++k)
    mesh.position[k] = V3f(V3d(a.position[k]) * (1 - share) + V3d(b.position[k]) * share);
  return mesh;
}

cpu::FieldView host_view(const LevelSet& set) {
  cpu::FieldView view = cpu::field_view(set);
  view.block = set.block.data(), view.value = set.value.data();
  return view;
}

bool moves_in_step(const ObstaclePlacement& p) {
  return !std::equal(std::begin(p.centre[0]), std::end(p.centre[0]), std::begin(p.centre[1])) ||
         !std::equal(std::begin(p.axis[0]), std::end(p.axis[0]), std::begin(p.axis[1])) ||
         (p.deform > 0 && p.blend[0] != p.blend[1]);
}

bool has_keys(const Obstacle& obstacle) {
  return obstacle.position.keys.size() > 1 || obstacle.rotation_deg.keys.size() > 1;
}

}  // namespace

ObstacleSet::ObstacleSet(const Shot& shot, const LocalFrame& frame, LevelSetMaker make_level_set)
    : ObstacleSet(Solids::obstacles, shot, shot.obstacle, {}, frame, std::move(make_level_set)) {}

ObstacleSet::ObstacleSet(Solids role, const Shot& shot, const std::vector<Obstacle>& solids,
                         std::vector<Window> window, const LocalFrame& frame,
                         LevelSetMaker make_level_set)
    : role_(role),
      window_(std::move(window)),
      shot_(shot),
      origin_(frame.origin[0], frame.origin[1], frame.origin[2]),
      snap_(frame.spacing / (1 << 20)),
      make_level_set_(std::move(make_level_set)) {
  for (const Obstacle& obstacle : solids) {
    Entry entry;
    entry.obstacle = obstacle;
    entry.high = obstacle.type == ObstacleType::box ? obstacle.size * 0.5 : V3d(obstacle.radius);
    if (obstacle.type == ObstacleType::plane) {  // what of it the domain may hold
      entry.high = V3d((shot.domain.max - shot.domain.min).length());
    }
    entry.low = -entry.high;
    if (obstacle.type == ObstacleType::mesh) {
      if (!make_level_set_) throw std::logic_error("ObstacleSet: a mesh, but no make_level_set");
      entry.deforms = is_sequence(obstacle.mesh_file);
      entry.shape = read_sequence_shape(shot, obstacle);
      read_meshes(entry, shot.timeline.first);
    }
    obstacle_.push_back(std::move(entry));
  }
}

void ObstacleSet::read_meshes(Entry& entry, int frame) {
  const Obstacle& o = entry.obstacle;
  if (entry.mesh_frame && (*entry.mesh_frame == frame || !entry.deforms)) return;
  if (entry.mesh_frame && *entry.mesh_frame + 1 == frame) {
    entry.before = std::move(entry.after);
  } else {
    entry.before = read_obstacle_mesh(shot_, o, frame, entry.shape);
  }
  if (entry.deforms) {
    entry.after = read_obstacle_mesh(shot_, o, frame + 1, entry.shape);
    check_same_topology(entry.before, entry.after, o);
  }
  entry.mesh_frame = frame;
  entry.low = V3d(far_off), entry.high = V3d(-far_off);
  bound(entry.before, entry.low, entry.high);
  bound(entry.after, entry.low, entry.high);
}

LevelSet ObstacleSet::level_set(const Entry& entry, const TriangleMesh& mesh) const {
  const double a = shot_.fluid.spacing;
  const Timeline& t = shot_.timeline;
  const LevelSetBounds bounds =
      bounds_in_own_space(shot_, entry.obstacle, t.first - shot_.preroll * t.fps, t.last);
  try {
    return make_level_set_(mesh, voxel * a, band * a, bounds);
  } catch (const Error& error) {
    const std::string guess = guess_of_unit(shot_.domain, entry.low, entry.high);
    throw Error(fmt::format("{}: {} \"{}\": {}{}", shot_.file.string(),
                            role_ == Solids::sinks ? "sink" : "obstacle", entry.obstacle.name,
                            error.what(), guess.empty() ? "" : ": " + guess));
  }
}

const ObstacleSet::Bracket& ObstacleSet::bracket_at(Entry& entry, double frame) {
  frame += 1e-9;  // what lands on the end of one begins the next, whatever the rounding
  std::optional<Bracket>& now = entry.bracket;
  if (now && (!entry.deforms || (frame >= now->begin && frame < now->end))) return *now;
  if (!entry.deforms) {
    now.emplace();
    now->begin = -far_off, now->end = far_off;
    now->set[0] = level_set(entry, entry.before);
    return *now;
  }
  const int whole = int(std::floor(frame));
  read_meshes(entry, whole);
  double farthest = 0;
  for (size_t k = 0; k < entry.before.position.size(); ++k) {
    farthest =
        std::max(farthest, double((entry.after.position[k] - entry.before.position[k]).length()));
  }
  const double parts = std::clamp(std::ceil(farthest / shot_.fluid.spacing), 1.0, 256.0);
  const double part = std::min(std::floor((frame - whole) * parts), parts - 1);
  Bracket next;
  next.begin = whole + part / parts,
  next.end = part + 1 < parts ? whole + (part + 1) / parts : whole + 1;
  next.travel = farthest / parts;
  if (now && now->end == next.begin) {
    next.set[0] = std::move(now->set[1]);
  } else {
    next.set[0] = level_set(entry, mixed(entry.before, entry.after, part / parts));
  }
  next.set[1] = level_set(entry, mixed(entry.before, entry.after, (part + 1) / parts));
  now = std::move(next);
  return *now;
}

double ObstacleSet::travel(Entry& entry, double begin, double end) {
  double farthest = 0;
  if (entry.deforms) {
    const Bracket& bracket = bracket_at(entry, begin);
    farthest = bracket.travel * (end - begin) / (bracket.end - bracket.begin);
  }
  if (!has_keys(entry.obstacle)) return farthest;
  return farthest + corner_travel(entry.obstacle, entry.low, entry.high, begin, end);
}

double ObstacleSet::stop(double time, double end) {
  const Timeline& t = shot_.timeline;
  for (Entry& entry : obstacle_) {
    if (entry.deforms)
      end = std::min(end, (bracket_at(entry, film_frame(time)).end - t.first) / t.fps);
  }
  return end;
}

double ObstacleSet::limit(double time, double dt) {
  const double most = 0.4 * shot_.fluid.spacing;
  for (Entry& entry : obstacle_) {
    if (!entry.deforms && !has_keys(entry.obstacle)) continue;
    const double begin = film_frame(time);
    for (int tries = 0; tries < 40; ++tries) {  // a shorter step may have another mean speed
      const double moved = travel(entry, begin, film_frame(time + dt));
      if (moved <= most) break;
      dt *= std::max(0.5, 0.999 * most / moved);
    }
  }
  return dt;
}

double ObstacleSet::fastest() const {
  double speed = 0;
  for (const Entry& entry : obstacle_) {
    if (!has_keys(entry.obstacle)) continue;
    constexpr double part = 0.25;  // frames
    for (double f = shot_.timeline.first; f < shot_.timeline.last; f += part) {
      const double moved = corner_travel(entry.obstacle, entry.low, entry.high, f, f + part);
      speed = std::max(speed, moved / part * shot_.timeline.fps);
    }
  }
  return speed;
}

ObstaclePlacement ObstacleSet::placement(Entry& entry, double begin, double end) {
  const Obstacle& o = entry.obstacle;
  ObstaclePlacement p;
  p.shape = ObstacleShape(int(o.type));
  for (int k = 0; k < 3; ++k) p.half[k] = float(entry.high[k]);
  // A level set has convex corners rounded off by up to half a voxel.
  const bool field = p.shape == ObstacleShape::field;
  p.clearance = float((field ? 0.5 * voxel : 0.1) * shot_.fluid.spacing);
  p.friction = float(o.friction);
  p.wetting = float(wetting_of(o.contact_angle_deg));
  p.no_slip = holds_fluid(shot_, o.slip) ? 1.f : 0.f;
  if (entry.deforms) {
    const Bracket& bracket = *entry.bracket;
    const double length = bracket.end - bracket.begin;
    p.deform = float(bracket.travel);
    p.blend[0] = float(std::clamp((begin - bracket.begin) / length, 0.0, 1.0));
    p.blend[1] = float(std::clamp((end - bracket.begin) / length, 0.0, 1.0));
  }
  V3d low(far_off), high(-far_off);
  for (int when = 0; when < 2; ++when) {
    const Pose pose = obstacle_pose(o, when ? end : begin);
    for (int k = 0; k < 3; ++k) {
      const double local = pose.position[k] - origin_[k];
      p.centre[when][k] = float(std::round(local / snap_) * snap_);
      for (int c = 0; c < 3; ++c) p.axis[when][3 * k + c] = float(pose.axis[k][c]);
    }
    for (int c = 0; c < 8; ++c) {
      const V3d at = pose.to_world(corner_of(entry.low, entry.high, c)) - origin_;
      for (int k = 0; k < 3; ++k)
        low[k] = std::min(low[k], at[k]), high[k] = std::max(high[k], at[k]);
    }
  }
  for (int k = 0; k < 3; ++k) {
    const bool everywhere = o.type == ObstacleType::plane;
    p.low[k] = float(everywhere ? -far_off : low[k] - 0.01 * shot_.fluid.spacing);
    p.high[k] = float(everywhere ? far_off : high[k] + 0.01 * shot_.fluid.spacing);
  }
  return p;
}

void ObstacleSet::extend_behind_walls(const Obstacle& box, double begin, double end,
                                      ObstaclePlacement& p) const {
  const double a = shot_.fluid.spacing, more = 4 * a;
  const Pose pose[2] = {obstacle_pose(box, begin), obstacle_pose(box, end)};
  for (int k = 0; k < 3; ++k) {
    if (shot_.domain.axis[size_t(k)] != Axis::walls) continue;
    for (int own = 0; own < 3; ++own) {
      const double half = 0.5 * box.size[own];
      // Of the face that looks down the axis, and of that which looks up: how far before its wall.
      double low = -far_off, high = -far_off;
      bool along = true;
      for (const Pose& at : pose) {
        along &= std::abs(at.axis[own][k]) > 1 - 1e-6;
        low = std::max(low, at.position[k] - half - shot_.domain.min[k]);
        high = std::max(high, shot_.domain.max[k] - at.position[k] - half);
      }
      if (!along) continue;
      for (const double side : {-1., 1.}) {
        if ((side < 0 ? low : high) > 0.5 * a) continue;
        p.half[own] += float(0.5 * more);
        for (int when = 0; when < 2; ++when) p.centre[when][k] += float(side * 0.5 * more);
      }
    }
  }
}

void ObstacleSet::place(Solver& solver, double start, double end) {
  std::vector<ObstaclePlacement> all;
  for (size_t k = 0; k < obstacle_.size(); ++k) {
    Entry& entry = obstacle_[k];
    const double begin = film_frame(start);
    if (entry.obstacle.type == ObstacleType::mesh) {
      bracket_at(entry, begin);
      for (int s = 0; s < 2 && !entry.bracket->loaded; ++s)
        solver.load_level_set(role_, int(k), s, entry.bracket->set[entry.deforms ? s : 0]);
      entry.bracket->loaded = true;
    }
    ObstaclePlacement own = placement(entry, begin, film_frame(end));
    own.of = int(k);
    if (own.shape == ObstacleShape::box && role_ == Solids::obstacles)
      extend_behind_walls(entry.obstacle, begin, film_frame(end), own);
    const double middle = 0.5 * (start + end);
    const bool there = window_.empty() || (middle >= window_[k].start && middle < window_[k].stop);
    for (int c = 0; c < 3 && !there; ++c) own.low[c] = float(far_off), own.high[c] = -far_off;
    for (const ObstacleImages::Image& image : images_.of(own, extent(entry, own)))
      all.push_back(image.placement);
  }
  moving_.clear();
  for (const ObstaclePlacement& p : all)
    if (moves_in_step(p))
      moving_.push_back(
          {{p.low[0], p.low[1], p.low[2]}, {p.high[0], p.high[1], p.high[2]}, p.clearance});
  if (!all.empty()) solver.place(role_, all);
}

V3d ObstacleSet::extent(const Entry& entry, const ObstaclePlacement& placement) const {
  V3d size(0);
  for (int k = 0; k < 3; ++k) {
    for (int own = 0; own < 3; ++own) {
      size[k] +=
          std::abs(double(placement.axis[1][3 * own + k])) * (entry.high[own] - entry.low[own]);
    }
  }
  return size;
}

double ObstacleSet::distance_to(int obstacle, const V3d& point, double time) {
  const double frame = film_frame(time);
  const V3d place = images_.wrapped(point - origin_) + origin_;
  Entry& entry = obstacle_[size_t(obstacle)];
  if (entry.obstacle.type == ObstacleType::mesh) bracket_at(entry, frame);
  const ObstaclePlacement given = placement(entry, frame, frame);
  double least = far_off;
  for (const auto& [placement, shift] : images_.of(given, extent(entry, given))) {
    cpu::ObstacleView view{placement, {}};
    if (entry.bracket) {
      view.field[0] = host_view(entry.bracket->set[0]);
      view.field[1] = host_view(entry.bracket->set[entry.deforms ? 1 : 0]);
    }
    const V3d own = obstacle_pose(entry.obstacle, frame).to_own(place - shift);
    least = std::min(
        least, double(view.distance({float(own.x), float(own.y), float(own.z)}, view.blend[1])));
  }
  return least;
}

ObstacleSet::Nearest ObstacleSet::nearest(const V3d& point, double time) {
  Nearest nearest;
  for (int k = 0; k < count(); ++k) {
    const double distance = distance_to(k, point, time);
    if (distance < nearest.distance) nearest = {distance, k};
  }
  return nearest;
}

std::array<V3d, 3> ObstacleSet::triangle_at(int obstacle, size_t triangle, double frame) {
  Entry& entry = obstacle_[size_t(obstacle)];
  // The end of a frame's motion is known without the next one's.
  const bool known =
      entry.mesh_frame && frame >= *entry.mesh_frame && frame <= *entry.mesh_frame + 1;
  if (entry.deforms && !known) read_meshes(entry, int(std::floor(frame)));
  const double share = entry.deforms ? frame - *entry.mesh_frame : 0;
  const auto& t = entry.before.triangle[triangle];
  std::array<V3d, 3> corner;
  for (int c = 0; c < 3; ++c) {
    const auto v = size_t(t[c]);
    corner[size_t(c)] = V3d(entry.before.position[v]);
    if (entry.deforms)
      corner[size_t(c)] += (V3d(entry.after.position[v]) - corner[size_t(c)]) * share;
  }
  return corner;
}

bool ObstacleSet::moves(int obstacle) const {
  const Entry& entry = obstacle_[size_t(obstacle)];
  return entry.deforms || has_keys(entry.obstacle);
}

bool ObstacleSet::any_moves() const {
  for (int k = 0; k < count(); ++k)
    if (moves(k)) return true;
  return false;
}

size_t ObstacleSet::triangles() const {
  size_t sum = 0;
  for (const Entry& entry : obstacle_) sum += entry.before.triangle.size();
  return sum;
}

size_t ObstacleSet::level_set_bytes() const {
  size_t sum = 0;
  for (const Entry& entry : obstacle_) {
    if (!entry.bracket) continue;
    for (const LevelSet& set : entry.bracket->set)
      sum += set.block.size() * sizeof(int) + set.value.size() * sizeof(float);
  }
  return sum;
}

ObstacleSet sinks_of(const Shot& shot, const LocalFrame& frame, LevelSetMaker make_level_set) {
  std::vector<Obstacle> shapes;
  std::vector<ObstacleSet::Window> windows;
  for (const Sink& sink : shot.sink) {
    shapes.push_back(sink.shape);
    windows.push_back({sink.start - shot.preroll, sink.stop - shot.preroll});
  }
  return {Solids::sinks, shot, shapes, windows, frame, std::move(make_level_set)};
}

}  // namespace drench::sim
