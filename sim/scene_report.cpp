#include "sim/scene_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/source_check.h"
#include "sim/room.h"
#include "sim/scene.h"

namespace drench::sim {

namespace {

constexpr double worth_a_word = 0.05;  // share of a source or inlet
constexpr double worth_a_word_of_rounding = 0.2;

/// "2400 particles (0.3 litres)".
std::string amount(double particles, double spacing) {
  const double litres = particles * spacing * spacing * spacing * 1000;
  return fmt::format("{:.0f} particles ({:.3g} litres)", particles, litres);
}

std::string names_of(const std::vector<ObstacleLoss>& lost) {
  std::string names;
  for (const ObstacleLoss& one : lost)
    names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", one.obstacle);
  return names;
}

/// What took a source's fluid: "inside obstacle \"hull\"", "beyond the domain's open sides".
std::string where_of(const SourceReport& source) {
  std::string where;
  if (!source.lost.empty()) {
    where = fmt::format("inside obstacle{} {} or within half a spacing of {}",
                        source.lost.size() > 1 ? "s" : "", names_of(source.lost),
                        source.lost.size() > 1 ? "them" : "it");
  }
  if (source.outside > 0)
    where += std::string(where.empty() ? "" : ", or ") + "beyond the domain's open sides";
  return where;
}

// ---- emitters ----

/// What may hold back the places of an emitter at one time.
struct Blocked {
  size_t places = 0, blocked = 0;
  std::vector<size_t> by;  // each obstacle

  void add(int obstacle) { ++blocked, ++by[size_t(obstacle)]; }
};

class InletLook {
 public:
  InletLook(const Shot& shot, Scene& scene) : shot_(shot), scene_(scene) {}
  InletReport of(size_t e);

 private:
  void look(size_t e, double time, Blocked& found);
  void look_at_layer(const FluidEmitter& emitter, double time, Blocked& found);
  bool beyond(const V3d& p) const;
  bool stands(size_t e) const;
  MeshEmitter& mesh_emitter(size_t e) const;

  const Shot& shot_;
  Scene& scene_;
};

MeshEmitter& InletLook::mesh_emitter(size_t e) const {
  return *std::find_if(scene_.mesh_emitter.begin(), scene_.mesh_emitter.end(),
                       [e](const MeshEmitter& m) { return m.index() == e; });
}

bool InletLook::stands(size_t e) const {
  const FluidEmitter& emitter = shot_.fluid.emitter[e];
  return emitter.center.keys.size() < 2 && emitter.direction.keys.size() < 2 &&
         emitter.rotation_deg.keys.size() < 2;
}

/// Of sides that are open: what is more than a spacing beyond is dropped before it comes in.
bool InletLook::beyond(const V3d& p) const {
  const double a = shot_.fluid.spacing;
  for (int k = 0; k < 3; ++k) {
    if (shot_.domain.axis[size_t(k)] != Axis::open) continue;
    if (p[k] < shot_.domain.min[k] - a || p[k] > shot_.domain.max[k] + a) return true;
  }
  return false;
}

/// A layer is moved on from the inlet by up to a step's way, so that a place counts as blocked only
/// if it is so a spacing farther along, too.
void InletLook::look_at_layer(const FluidEmitter& emitter, double time, Blocked& found) {
  const double a = shot_.fluid.spacing;
  const EmitterLayer layer = emitter_layer(emitter, a);
  const Inlet inlet =
      inlet_at(emitter, shot_.timeline, shot_.timeline.first + time * shot_.timeline.fps);
  const double speed = inlet.velocity.length();
  const V3d along = speed > 0 ? inlet.velocity / speed : V3d(0);
  for (const auto& place : layer.place) {
    const V3d p = inlet.center + inlet.axis[0] * place[0] + inlet.axis[1] * place[1];
    ++found.places;
    if (beyond(p)) {
      ++found.blocked;
      continue;
    }
    int in_the_way = -1;
    for (int k = 0; k < 3; ++k) {
      in_the_way = obstacle_in_the_way(scene_.obstacles, p + along * (0.5 * k * a), time, a);
      if (in_the_way < 0) break;
    }
    if (in_the_way >= 0) found.add(in_the_way);
  }
}

void InletLook::look(size_t e, double time, Blocked& found) {
  const FluidEmitter& emitter = shot_.fluid.emitter[e];
  if (emitter.type != EmitterType::mesh) return look_at_layer(emitter, time, found);
  for (const V3d& p : mesh_emitter(e).places(time)) {
    ++found.places;
    const int obstacle = obstacle_in_the_way(scene_.obstacles, p, time, shot_.fluid.spacing);
    if (obstacle >= 0) found.add(obstacle);
  }
}

InletReport InletLook::of(size_t e) {
  const FluidEmitter& emitter = shot_.fluid.emitter[e];
  const Timeline& t = shot_.timeline;
  InletReport report;
  report.name = fmt::format("fluid.emitter[{}]", e);
  const double begin = std::max(emitter.start, 0.0) - shot_.preroll;
  const double end = std::min(emitter.stop - shot_.preroll, (t.last - t.first) / t.fps);
  report.in_time = begin < end || (t.first == t.last && begin <= end);
  report.fixed = stands(e) && !scene_.obstacles.any_moves();
  if (!report.in_time) return report;
  constexpr int most_looks = 500;
  const double frames = std::ceil((end - begin) * t.fps);
  // One look is two level sets of each obstacle that deforms: too many for every frame.
  const bool once =
      report.fixed ||
      std::any_of(shot_.obstacle.begin(), shot_.obstacle.end(), [](const Obstacle& o) {
        return o.type == ObstacleType::mesh && is_sequence(o.mesh_file);
      });
  const int looks = once ? 0 : int(std::clamp(frames, 1.0, double(most_looks)));
  Blocked found{0, 0, std::vector<size_t>(shot_.obstacle.size(), 0)};
  for (int k = 0; k <= looks; ++k)
    look(e, begin + (looks > 0 ? (end - begin) * k / looks : 0), found);
  if (found.places > 0) report.blocked = double(found.blocked) / double(found.places);
  const auto most = std::max_element(found.by.begin(), found.by.end());
  if (most != found.by.end() && *most > 0)
    report.obstacle = shot_.obstacle[size_t(most - found.by.begin())].name;
  const double a = shot_.fluid.spacing, clear = 1 - report.blocked;
  report.emitted = emitter.type == EmitterType::mesh
                       ? clear * double(found.places) / (looks + 1)
                       : clear * inlet_area(emitter) * emitter.speed * (end - begin) / (a * a * a);
  return report;
}

std::string where_of(const InletReport& inlet) {
  if (inlet.obstacle.empty()) return "beyond the domain's open sides";
  return fmt::format("inside obstacle \"{}\" or nearer to it than half a spacing", inlet.obstacle);
}

void check_inlet(const Shot& shot, const InletReport& inlet) {
  if (!inlet.in_time || !inlet.never() || !inlet.fixed) return;
  throw Error(fmt::format(
      "{}: {} can never send a particle: every place of it is {} through the whole shot. Move it "
      "more than half a spacing ({:.3g} m) out, or remove it",
      shot.file.string(), inlet.name, where_of(inlet), 0.5 * shot.fluid.spacing));
}

// ---- estimates ----

/// Bytes a particle of all columns, measured at a million of water in a block and at 65,536 on a
/// sheet (docs/benchmarks.md).
double bytes_a_particle(const Parameters& p, const Scene& scene) {
  return scene.cloth.triangles() > 0 ? 719 : p.incompressible ? 359 : 165;
}
/// Springs, rows and the implicit step of a sheet, of a triangle.
constexpr double bytes_a_triangle = 700;

double steps_a_frame(const Shot& shot, Scene& scene) {
  const double frame = 1 / shot.timeline.fps;
  if (shot.time_step > 0) return std::ceil(frame / shot.time_step);
  Limits limits;
  // A tenth of the sound speed is sqrt(g H + v^2 / 2): the fall through all of H ends at sqrt(2) of
  // it.
  if (scene.parameters.incompressible)
    limits.max_speed = float(std::sqrt(2.0) * 0.1 * double(scene.parameters.sound_speed));
  const double dt = stable_step(scene.parameters, limits).dt;
  return std::ceil(frame / std::min(frame, scene.obstacles.limit(0, std::min(dt, frame))));
}

}  // namespace

size_t SourceReport::in_obstacles() const {
  size_t sum = 0;
  for (const ObstacleLoss& one : lost) sum += one.particles;
  return sum;
}

double SourceReport::rounding(double spacing) const {
  return volume > 0 ? double(asked) * spacing * spacing * spacing / volume - 1 : 0;
}

std::string guess_of_unit(const Domain& domain, const V3d& low, const V3d& high) {
  const V3d size = high - low, room = domain.max - domain.min;
  const double longest = std::max({size.x, size.y, size.z});
  const double thinnest = std::min({size.x, size.y, size.z});
  const double width = std::max({room.x, room.y, room.z});
  // A wide ground under a small pool is thin beside it, or not as wide as this.
  const bool meant = longest < 50 * width && (longest < 10 * width || thinnest < 2 * width);
  if (meant) return "";
  const auto text = [](double m) {
    return m >= 100 ? fmt::format("{:.3g} km", m / 1000) : fmt::format("{:.3g} m", m);
  };
  const std::string sizes =
      fmt::format("the mesh is {} wide in a domain of {}", text(longest), text(width));
  for (const auto& [unit, scale] : {std::pair{"centimetres", 0.01}, {"millimetres", 0.001}}) {
    if (longest * scale > 3 * width) continue;
    return fmt::format("{}: are these {}? Set scale = {}", sizes, unit, scale);
  }
  return sizes + ": is its scale right?";
}

void note_meshes(const Shot& shot, Scene& scene) {
  const Timeline& t = shot.timeline;
  for (int k = 0; k < scene.obstacles.count() && shot.fluid.present(); ++k) {
    const Obstacle& obstacle = scene.obstacles.obstacle(k);
    if (obstacle.type != ObstacleType::mesh) continue;
    const V3d &low = scene.obstacles.low(k), &high = scene.obstacles.high(k);
    const LevelSetBounds near =
        bounds_in_own_space(shot, obstacle, t.first - shot.preroll * t.fps, t.last);
    bool apart = false;
    for (int c = 0; c < 3; ++c) apart |= low[c] > near.high[c] || high[c] < near.low[c];
    const std::string guess = guess_of_unit(shot.domain, low, high);
    if (apart && !is_sequence(obstacle.mesh_file)) {
      scene.report.notes.push_back(fmt::format(
          "obstacle \"{}\" meets no fluid: its mesh lies wholly beyond the domain in every frame. "
          "Look at its position and scale{}{}",
          obstacle.name, guess.empty() ? "" : ": ", guess));
    } else if (!guess.empty()) {
      scene.report.notes.push_back(
          fmt::format("obstacle \"{}\" is much larger than the domain, fluid meets only a part of "
                      "it: {}",
                      obstacle.name, guess));
    }
  }
}

void check_sources_start(const Shot& shot, const SceneReport& report) {
  for (const SourceReport& source : report.source) {
    if (source.kept > 0 || source.asked == 0) continue;
    std::string notes;
    for (const ObstacleLoss& one : source.lost) {
      for (const std::string& note : report.notes)
        if (note.find(fmt::format("\"{}\"", one.obstacle)) != std::string::npos)
          notes += ". " + note;
    }
    throw Error(fmt::format(
        "{}: all fluid of {} is lost: {} lie {}. Move it, or look at the size (scale) and the "
        "place of what is in its way{}",
        shot.file.string(), source.name,
        amount(double(source.in_obstacles() + source.outside), shot.fluid.spacing),
        where_of(source), notes));
  }
}

void complete_report(const Shot& shot, Scene& scene) {
  SceneReport& report = scene.report;
  report.spacing = shot.fluid.spacing;
  for (const SourceReport& source : report.source) report.particles += source.kept;
  InletLook look(shot, scene);
  report.particles_at_end = double(report.particles);
  for (size_t e = 0; e < shot.fluid.emitter.size(); ++e) {
    report.inlet.push_back(look.of(e));
    check_inlet(shot, report.inlet.back());
    report.particles_at_end += report.inlet.back().emitted;
  }
  if (!report.inlet.empty())
    report.particles_at_end = std::min(report.particles_at_end, room_of(shot, scene));
  report.particles_at_end = std::max(report.particles_at_end, double(report.particles));
  report.cloth_triangles = size_t(scene.cloth.triangles());
  report.obstacle_triangles = scene.obstacles.triangles() + scene.sinks.triangles();
  // Level sets are kept by the scene and by the solver.
  report.memory = report.particles_at_end * bytes_a_particle(scene.parameters, scene) +
                  double(report.cloth_triangles) * bytes_a_triangle +
                  2 * double(scene.obstacles.level_set_bytes() + scene.sinks.level_set_bytes());
  report.steps_a_frame = steps_a_frame(shot, scene);
}

std::vector<std::string> warnings_of(const SceneReport& report) {
  std::vector<std::string> all;
  for (const SourceReport& source : report.source) {
    const double rounding = source.rounding(report.spacing);
    if (std::abs(rounding) > worth_a_word_of_rounding) {
      all.push_back(
          fmt::format("{} asks for {:.3g} litres and its lattice holds {}, {:+.0f} %: sizes are "
                      "rounded to fluid.spacing. Use a smaller spacing, or a size that is a "
                      "multiple of it",
                      source.name, 1000 * source.volume,
                      amount(double(source.asked), report.spacing), 100 * rounding));
    }
    const double gone = double(source.in_obstacles() + source.outside);
    if (gone < worth_a_word * double(source.asked)) continue;
    all.push_back(fmt::format(
        "{} loses {} of {}, {:.0f} %: they would start {}. If that is not meant, move it, or look "
        "at the size (scale) and the place of what is in its way",
        source.name, amount(gone, report.spacing), source.asked, 100 * gone / double(source.asked),
        where_of(source)));
  }
  for (const InletReport& inlet : report.inlet) {
    if (!inlet.in_time) {
      all.push_back(fmt::format(
          "{} sends nothing: it starts after the last frame or stops before the first. Change its "
          "start and stop, which count from the start of the simulation, pre-roll included",
          inlet.name));
    } else if (inlet.blocked >= 1) {
      all.push_back(
          fmt::format("{} probably sends nothing: in every frame that was looked at all "
                      "of it is {}. Move it out of there",
                      inlet.name, where_of(inlet)));
    } else if (inlet.blocked >= worth_a_word) {
      all.push_back(
          fmt::format("{:.0f} % of {} sends nothing: it is {}. Move it, or make it "
                      "smaller, for the flow that was asked for",
                      100 * inlet.blocked, inlet.name, where_of(inlet)));
    }
  }
  all.insert(all.end(), report.notes.begin(), report.notes.end());
  return all;
}

}  // namespace drench::sim
