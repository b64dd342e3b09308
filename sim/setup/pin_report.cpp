#include "sim/setup/pin_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>

#include "sim/setup/scene.h"

namespace drench::sim {

namespace {

using Group = ClothPins::Group;

/// Some of many, evenly.
std::vector<size_t> sample(size_t count, size_t most) {
  std::vector<size_t> some;
  const size_t n = std::min(count, most);
  for (size_t k = 0; k < n; ++k) some.push_back(n == 1 ? 0 : k * (count - 1) / (n - 1));
  return some;
}

/// Vertices of a pin, over time.
struct Held {
  const Group* moving = nullptr;  // nullptr: it stands
  size_t pin = 0;                 // of its sheet
  std::vector<int> node;
  std::vector<V3d> start;  // m, local
};

struct Looking {
  const Shot& shot;
  Scene& scene;

  double begin() const { return -shot.preroll; }
  double end() const { return (shot.timeline.last - shot.timeline.first) / shot.timeline.fps; }
  double frame_at(double time) const { return shot.timeline.first + time * shot.timeline.fps; }
  V3d place(const Held& held, size_t k, double time) const {
    return held.moving ? scene.pins.place(*held.moving, k, scene.obstacles, time) : held.start[k];
  }

  /// The pins of a sheet that hold; not those on what deforms, whose files are many.
  std::vector<Held> held_of(size_t sheet) const {
    std::vector<Held> all;
    const HostVec& x = scene.start.cloth_position;
    for (size_t k = 0; k < shot.cloth[sheet].pin.size(); ++k) {
      Held held;
      held.pin = k, held.node = scene.sheet[sheet].group[k];
      for (const Group& g : scene.pins.groups())
        if (g.cloth == int(sheet) && g.pin == int(k)) held.moving = &g;
      if (held.moving && (held.moving->stiffness > 0 || !held.moving->on.empty())) continue;
      for (const int node : held.node) {
        const auto v = size_t(scene.first_vertex[sheet] + node);
        held.start.push_back({x.x[v], x.y[v], x.z[v]});
      }
      all.push_back(std::move(held));
    }
    return all;
  }

  /// m, along the sheet at rest, at least the shortest way: along edges of a mesh.
  std::vector<double> ways(size_t s, int from) const {
    const Sheet& sheet = scene.sheet[s];
    const size_t n = sheet.point.size();
    std::vector<double> way(n, 1e30);
    const auto rest = [&](int node) { return sheet.rest[sheet.point[size_t(node)]]; };
    if (shot.cloth[s].mesh_file.empty()) {
      for (size_t v = 0; v < n; ++v) way[v] = (rest(int(v)) - rest(from)).length();
      return way;
    }
    std::vector<std::vector<int>> beside(n);
    for (const auto& t : sheet.triangle) {
      for (int c = 0; c < 3; ++c) {
        const int a = sheet.node[t[c]], b = sheet.node[t[(c + 1) % 3]];
        beside[size_t(a)].push_back(b), beside[size_t(b)].push_back(a);
      }
    }
    using Reached = std::pair<double, int>;
    std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
    next.push({way[size_t(from)] = 0, from});
    while (!next.empty()) {
      const auto [so_far, v] = next.top();
      next.pop();
      if (so_far > way[size_t(v)]) continue;
      for (const int w : beside[size_t(v)]) {
        const double there = so_far + (rest(v) - rest(w)).length();
        if (there < way[size_t(w)]) next.push({way[size_t(w)] = there, w});
      }
    }
    return way;
  }

  void note(const std::string& text) const { scene.report.notes.push_back(text); }
};

double release_of(const Held& held) { return held.moving ? held.moving->release : 1e30; }

/// How far two pins of a sheet come apart at most.
struct Stretch {
  double ratio = 0, apart = 0, way = 0, time = 0;  // 1, m, m, s
};

Stretch widest(const Looking& look, size_t s, const Held& a, const Held& b) {
  Stretch worst;
  const double step = 1 / look.shot.timeline.fps,
               end = std::min({look.end(), release_of(a), release_of(b)});
  constexpr size_t most = 12;
  for (const size_t i : sample(a.node.size(), most)) {
    const std::vector<double> way = look.ways(s, a.node[i]);
    for (const size_t j : sample(b.node.size(), most)) {
      const double rest = way[size_t(b.node[j])];
      if (!(rest > 0) || rest > 1e29) continue;
      for (double t = look.begin(); t < end + 0.5 * step; t += step) {
        const double apart = (look.place(a, i, t) - look.place(b, j, t)).length();
        if (apart > worst.ratio * rest) worst = {apart / rest, apart, rest, t};
      }
    }
  }
  return worst;
}

void note_stretch(const Looking& look, size_t s) {
  const Cloth& cloth = look.shot.cloth[s];
  const bool shell = cloth.model == ClothModel::shell;
  const double most = shell ? cloth.stretch_limit : 2;
  const std::vector<Held> held = look.held_of(s);
  for (size_t i = 0; i < held.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const auto moves = [](const Held& one) { return one.moving && one.moving->moves; };
      if (!moves(held[i]) && !moves(held[j])) continue;
      const Stretch at = widest(look, s, held[j], held[i]);
      if (at.ratio <= most * (1 + 1e-6)) continue;
      look.note(fmt::format(
          "cloth \"{}\": pins {} and {} pull it to {:.3g} times its length at frame {:.0f}, {:.3g} "
          "m "
          "of sheet over {:.3g} m; {} {:.4g}. Move them less far apart, let one go (release), or "
          "make it soft (stiffness)",
          cloth.name, held[j].pin + 1, held[i].pin + 1, at.ratio, look.frame_at(at.time), at.way,
          at.apart, shell ? "it stiffens beyond its stretch_limit," : "no fabric bears more than",
          most));
    }
  }
}

/// What a place beyond walls or in an obstacle is through; empty if it is free.
std::string what_is_at(const Looking& look, const V3d& place, double time) {
  const Domain& domain = look.shot.domain;
  const double a = look.shot.fluid.spacing;
  for (int k = 0; k < 3; ++k) {
    if (domain.axis[size_t(k)] != Axis::walls) continue;
    if (place[k] < domain.min[k] - 0.5 * a || place[k] > domain.max[k] + 0.5 * a)
      return fmt::format("beyond the domain's wall in {}", "xyz"[k]);
  }
  ObstacleSet& obstacles = look.scene.obstacles;
  for (int k = 0; k < obstacles.count(); ++k) {
    if (!obstacles.deforms(k) && obstacles.distance_to(k, place, time) < -0.25 * a)
      return fmt::format("into obstacle \"{}\"", obstacles.obstacle(k).name);
  }
  return "";
}

void note_ways_through(const Looking& look, const Group& g) {
  if (!g.moves || g.obstacle >= 0) return;
  const LocalFrame& frame = look.scene.frame;
  const V3d origin(frame.origin[0], frame.origin[1], frame.origin[2]);
  const double step = 1 / look.shot.timeline.fps, end = std::min(look.end(), g.release);
  const auto at = [&](size_t k, double t) {
    return look.scene.pins.place(g, k, look.scene.obstacles, t) + origin;
  };
  for (const size_t k : sample(g.vertex.size(), 16)) {
    if (!what_is_at(look, at(k, look.begin()), look.begin()).empty()) continue;
    for (double t = look.begin(); t < end + 0.5 * step; t += step) {
      const V3d p = at(k, t);
      const std::string what = what_is_at(look, p, t);
      if (what.empty()) continue;
      return look.note(fmt::format(
          "cloth \"{}\": pin {} takes a vertex {} at frame {:.0f}, to ({:.4g}, {:.4g}, {:.4g}) m: "
          "pins go through what stops the rest of the sheet. Look at its position and rotation_deg",
          look.shot.cloth[size_t(g.cloth)].name, g.pin + 1, what, look.frame_at(t), p.x, p.y, p.z));
    }
  }
}

}  // namespace

void note_pins(const Shot& shot, Scene& scene) {
  const Looking look{shot, scene};
  for (size_t s = 0; s < shot.cloth.size(); ++s) note_stretch(look, s);
  for (const Group& g : scene.pins.groups()) note_ways_through(look, g);
}

}  // namespace drench::sim
