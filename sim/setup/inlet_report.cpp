#include "sim/setup/inlet_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/shot/source_check.h"

namespace drench::sim {

namespace {

using Blocked = InletPlace::Blocked;

/// On a wall may start what leaves it, not what goes along it: that would be pressed off, into what
/// starts a spacing before it. Open sides drop what is more than a spacing beyond.
Blocked by_domain(const Shot& shot, const V3d& p, const V3d& along) {
  const double a = shot.fluid.spacing;
  for (int k = 0; k < 3; ++k) {
    const Axis axis = shot.domain.axis[size_t(k)];
    const double below = shot.domain.min[k] - p[k], above = p[k] - shot.domain.max[k],
                 beyond = std::max(below, above), leaves = below > above ? along[k] : -along[k];
    if (axis == Axis::walls && beyond > (leaves > 0.1 ? 0.25 : -1e-6) * a) return Blocked::by_wall;
    if (axis == Axis::open && beyond > a) return Blocked::by_open_side;
  }
  return Blocked::no;
}

InletPlace looked_at(const Shot& shot, ObstacleSet& obstacles, const V3d& p, const V3d& along,
                     double time) {
  InletPlace place;
  place.blocked = by_domain(shot, p, along);
  if (place.blocked != Blocked::no) return place;
  place.obstacle = obstacle_in_the_way(obstacles, p, time, shot.fluid.spacing);
  if (place.obstacle >= 0) place.blocked = Blocked::by_obstacle;
  return place;
}

/// What holds back the places of an emitter, over all looks.
struct Count {
  size_t places = 0, wall = 0, open_side = 0, sink = 0;
  std::vector<size_t> obstacle;

  void add(const InletPlace& place) {
    ++places;
    wall += place.blocked == Blocked::by_wall, open_side += place.blocked == Blocked::by_open_side;
    if (place.blocked == Blocked::by_obstacle) ++obstacle[size_t(place.obstacle)];
  }
  size_t blocked() const {
    size_t sum = wall + open_side + sink;
    for (const size_t n : obstacle) sum += n;
    return sum;
  }
};

std::string where_of(const Shot& shot, const Count& count) {
  const auto most = std::max_element(count.obstacle.begin(), count.obstacle.end());
  const size_t by_obstacle = most == count.obstacle.end() ? 0 : *most;
  const size_t largest = std::max({by_obstacle, count.wall, count.open_side, count.sink});
  if (largest == 0) return "";
  if (largest == count.wall) return "beyond the domain's walls";
  if (largest == count.open_side) return "beyond the domain's open sides";
  if (largest == count.sink) return "in a sink";
  return fmt::format("inside obstacle \"{}\" or nearer to it than half a spacing",
                     shot.obstacle[size_t(most - count.obstacle.begin())].name);
}

/// Of a sink that is there for all of the emitter's time.
bool lies_in_sink(const Shot& shot, Scene& scene, const FluidEmitter& emitter, const V3d& p,
                  double time) {
  for (int k = 0; k < scene.sinks.count(); ++k) {
    const Sink& sink = shot.sink[size_t(k)];
    if (sink.start > emitter.start || sink.stop < emitter.stop) continue;
    if (scene.sinks.distance_to(k, p, time) < 0) return true;
  }
  return false;
}

void look_at_layer(const Shot& shot, Scene& scene, const FluidEmitter& emitter, double time,
                   Count& count) {
  const EmitterLayer layer = emitter_layer(emitter, shot.fluid.spacing);
  const Inlet inlet =
      inlet_at(emitter, shot.timeline, shot.timeline.first + time * shot.timeline.fps);
  for (const auto& place : layer.place) {
    const V3d p = inlet.at(place);
    const InletPlace found = inlet_place(shot, scene.obstacles, p, inlet.along(), time);
    count.add(found);
    count.sink += found.blocked == Blocked::no && lies_in_sink(shot, scene, emitter, p, time);
  }
}

void look(const Shot& shot, Scene& scene, size_t e, double time, Count& count) {
  const FluidEmitter& emitter = shot.fluid.emitter[e];
  if (emitter.type != EmitterType::mesh) return look_at_layer(shot, scene, emitter, time, count);
  const auto mesh = std::find_if(scene.mesh_emitter.begin(), scene.mesh_emitter.end(),
                                 [e](const MeshEmitter& m) { return m.index() == e; });
  for (const V3d& p : mesh->places(time)) {
    InletPlace place;
    place.obstacle = obstacle_in_the_way(scene.obstacles, p, time, shot.fluid.spacing);
    if (place.obstacle >= 0) place.blocked = Blocked::by_obstacle;
    count.add(place);
  }
}

/// Looks after the first, evenly over the emitter's time. One look is two level sets of each
/// obstacle that deforms: too many for every frame.
int looks_of(const Shot& shot, const InletReport& report, double seconds) {
  constexpr double most_looks = 500;
  const bool deforms = std::any_of(shot.obstacle.begin(), shot.obstacle.end(), [](const auto& o) {
    return o.type == ObstacleType::mesh && is_sequence(o.mesh_file);
  });
  if (report.fixed || deforms) return 0;
  return int(std::clamp(std::ceil(seconds * shot.timeline.fps), 1.0, most_looks));
}

}  // namespace

InletPlace inlet_place(const Shot& shot, ObstacleSet& obstacles, const V3d& point, const V3d& along,
                       double time) {
  const InletPlace here = looked_at(shot, obstacles, point, along, time);
  if (here.blocked == Blocked::no) return here;
  for (int k = 1; k <= 4; ++k) {
    const double ahead = 0.25 * k * shot.fluid.spacing;
    InletPlace place = looked_at(shot, obstacles, point + along * ahead, along, time);
    place.ahead = ahead;
    if (place.blocked == Blocked::no) return place;
  }
  return here;
}

InletReport report_of_inlet(const Shot& shot, Scene& scene, size_t e) {
  const FluidEmitter& emitter = shot.fluid.emitter[e];
  const Timeline& t = shot.timeline;
  const double a = shot.fluid.spacing, begin = std::max(emitter.start, 0.0) - shot.preroll,
               end = std::min(emitter.stop - shot.preroll, (t.last - t.first) / t.fps);
  const EmitterLayer layer = emitter_layer(emitter, a);
  const bool of_mesh = emitter.type == EmitterType::mesh;
  const double first = begin + (of_mesh ? 0 : 0.5 * layer.interval);  // see Simulator
  InletReport report;
  report.name = fmt::format("fluid.emitter[{}]", e);
  report.in_time = first < end;
  report.fixed = emitter.center.keys.size() < 2 && emitter.direction.keys.size() < 2 &&
                 emitter.rotation_deg.keys.size() < 2 && !scene.obstacles.any_moves() &&
                 !scene.sinks.any_moves();
  if (!report.in_time) return report;
  const int looks = looks_of(shot, report, end - begin);
  Count count{0, 0, 0, 0, std::vector<size_t>(shot.obstacle.size(), 0)};
  for (int k = 0; k <= looks; ++k)
    look(shot, scene, e, begin + (looks > 0 ? (end - begin) * k / looks : 0), count);
  if (count.places > 0) report.blocked = double(count.blocked()) / double(count.places);
  report.where = where_of(shot, count);
  report.emitted = (1 - report.blocked) *
                   (of_mesh ? double(count.places) / (looks + 1)
                            : inlet_area(emitter) * emitter.speed * (end - begin) / (a * a * a));
  if (!report.never() || !report.fixed) return report;
  throw Error(
      fmt::format("{}: {} can never send a particle: it is {} through the whole shot. Move it "
                  "more than half a spacing ({:.3g} m) out, or remove it",
                  shot.file.string(), report.name, report.where, 0.5 * a));
}

}  // namespace drench::sim
