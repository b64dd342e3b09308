#include "sim/setup/scene_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/geometry/obstacle.h"
#include "sim/setup/inlet_report.h"
#include "sim/setup/room.h"
#include "sim/setup/scene.h"
#include "sim/stable_step.h"

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
  const auto add = [&](const char* text) {
    where += (where.empty() ? "" : ", or ") + std::string(text);
  };
  if (source.outside > 0) add("beyond the domain's open sides");
  if (source.drained > 0) add("in a sink, which takes them at once");
  return where;
}

// ---- estimates ----

/// Bytes a particle of all columns, measured at a million of water in a block and at 65,536 on a
/// sheet (docs/benchmarks).
double bytes_a_particle(const Parameters& p, const Scene& scene) {
  return scene.cloth.triangles() > 0 ? 719 : p.incompressible ? 359 : 165;
}
/// Springs, rows and the implicit step of a sheet, of a triangle.
constexpr double bytes_a_triangle = 700;

/// Of the scheme that adapts its step.
double adaptive_steps_a_frame(const Shot& shot, Scene& scene) {
  const double frame = 1 / shot.timeline.fps;
  Limits limits;
  // A tenth of the sound speed is sqrt(g H + v^2 / 2): the fall through all of H ends at sqrt(2) of
  // it.
  if (scene.parameters.incompressible)
    limits.max_speed = float(std::sqrt(2.0) * 0.1 * double(scene.parameters.sound_speed));
  const double dt = stable_step(scene.parameters, limits).dt;
  const double moves = scene.obstacles.limit(0, std::min(dt, frame));
  return std::ceil(frame / std::min(frame, scene.pins.limit(0, moves)));
}

/// Says so if the shot asks for many more steps than its physics does.
void estimate_steps(const Shot& shot, Scene& scene) {
  constexpr double many_times = 20;
  SceneReport& report = scene.report;
  const double adaptive = adaptive_steps_a_frame(shot, scene);
  report.steps_a_frame =
      shot.time_step > 0 ? std::ceil(1 / (shot.timeline.fps * shot.time_step)) : adaptive;
  report.preroll = shot.preroll;
  report.preroll_steps = report.steps_a_frame * shot.preroll * shot.timeline.fps;
  if (report.steps_a_frame > many_times * adaptive)
    report.notes.push_back(
        fmt::format("shot.time_step is {:g} s, {:.0f} steps a frame; without it there are some "
                    "{:.0f}. Leave it "
                    "out, or look at its unit",
                    shot.time_step, report.steps_a_frame, adaptive));
}

/// @throws Error if there is never anything: no fluid, no cloth.
void check_anything_starts(const Shot& shot, const SceneReport& report) {
  const bool never = std::all_of(report.inlet.begin(), report.inlet.end(),
                                 [](const InletReport& inlet) { return !inlet.in_time; });
  if (report.inlet.empty() || !shot.cloth.empty() || report.particles > 0 || !never) return;
  throw Error(fmt::format(
      "{}: there is never any fluid: {} sends its first layer after the last frame or after its "
      "stop. Change its start and stop, which count from the start of the simulation, pre-roll "
      "included, or give the shot more frames",
      shot.file.string(), report.inlet.front().name));
}

}  // namespace

size_t SourceReport::in_obstacles() const {
  size_t sum = 0;
  for (const ObstacleLoss& one : lost) sum += one.particles;
  return sum;
}

size_t SourceReport::gone() const { return in_obstacles() + outside + drained; }

double SourceReport::rounding(double spacing) const {
  return volume > 0 ? double(asked) * spacing * spacing * spacing / volume - 1 : 0;
}

bool lies_beyond(const Domain& domain, double spacing, const ObstacleSet& solids, int k) {
  const Obstacle& shape = solids.obstacle(k);
  const Pose pose = obstacle_pose(shape, 0);
  const bool plane = shape.type == ObstacleType::plane;
  V3d low(1e30), high(-1e30);
  double lowest = 1e30;  // over the plane
  for (int corner = 0; corner < 8; ++corner) {
    V3d of_domain, own;
    for (int c = 0; c < 3; ++c) {
      of_domain[c] = corner >> c & 1 ? domain.max[c] : domain.min[c];
      own[c] = corner >> c & 1 ? solids.high(k)[c] : solids.low(k)[c];
    }
    lowest = std::min(lowest, pose.to_own(of_domain).y);
    const V3d at = pose.to_world(own);
    for (int c = 0; c < 3; ++c)
      low[c] = std::min(low[c], at[c]), high[c] = std::max(high[c], at[c]);
  }
  if (plane) return lowest > 0;
  for (int c = 0; c < 3; ++c) {
    if (domain.axis[size_t(c)] == Axis::periodic) continue;
    // Fluid is dropped a spacing beyond an open side.
    const double more = domain.axis[size_t(c)] == Axis::open ? spacing : 0;
    if (high[c] < domain.min[c] - more || low[c] > domain.max[c] + more) return true;
  }
  return false;
}

std::string guess_of_unit(const Domain& domain, const V3d& low, const V3d& high,
                          std::string_view remedy) {
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
    if (longest * scale > 2 * width) continue;
    return fmt::format("{}: are these {}? {} {}", sizes, unit, remedy, scale);
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
    const bool seen = obstacle.visible && obstacle.matte != Matte::none;  // a prop for a plate
    if (apart && !is_sequence(obstacle.mesh_file) && !(seen && guess.empty())) {
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

std::string guess_of_unit(const Domain& domain, const Cloth& cloth, const Sheet& sheet) {
  if (cloth.mesh_file.empty()) return "";
  V3d low(1e30), high(-1e30);
  for (const V3d& p : sheet.position) {
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  }
  return guess_of_unit(domain, low, high, "Scale the file by");
}

void note_cloth(const Shot& shot, Scene& scene) {
  for (size_t s = 0; s < scene.sheet.size(); ++s) {
    const Cloth& cloth = shot.cloth[s];
    scene.report.sheet.push_back(
        {.name = cloth.name,
         .fabric = cloth.model == ClothModel::shell ? cloth.fabric : std::string(),
         .triangles = scene.sheet[s].triangle.size()});
    const std::string guess = guess_of_unit(shot.domain, cloth, scene.sheet[s]);
    if (guess.empty()) continue;
    scene.report.notes.push_back(
        fmt::format("cloth \"{}\" is much larger than the domain: {}", cloth.name, guess));
  }
}

void note_sinks(const Shot& shot, Scene& scene) {
  const Timeline& t = shot.timeline;
  for (int k = 0; k < scene.sinks.count(); ++k) {
    const Obstacle& shape = scene.sinks.obstacle(k);
    const std::string guess =
        shape.type == ObstacleType::mesh
            ? guess_of_unit(shot.domain, scene.sinks.low(k), scene.sinks.high(k))
            : "";
    if (!guess.empty()) {
      scene.report.notes.push_back(
          fmt::format("sink \"{}\" is much larger than the domain: {}", shape.name, guess));
    }
    const double begin = shot.sink[size_t(k)].start - shot.preroll;
    if (begin >= (t.last - t.first) / t.fps && begin > -shot.preroll) {
      scene.report.notes.push_back(fmt::format(
          "sink \"{}\" takes nothing: it starts after the last frame. Change its start, which "
          "counts from the start of the simulation, pre-roll included",
          shape.name));
    } else if (!scene.sinks.moves(k) &&
               lies_beyond(shot.domain, shot.fluid.spacing, scene.sinks, k)) {
      scene.report.notes.push_back(fmt::format(
          "sink \"{}\" takes nothing: it lies wholly beyond the domain. Look at its position",
          shape.name));
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
        shot.file.string(), source.name, amount(double(source.gone()), shot.fluid.spacing),
        where_of(source), notes));
  }
}

void complete_report(const Shot& shot, Scene& scene) {
  SceneReport& report = scene.report;
  report.spacing = shot.fluid.spacing;
  for (const SourceReport& source : report.source) report.particles += source.kept;
  report.particles_at_end = double(report.particles);
  for (size_t e = 0; e < shot.fluid.emitter.size(); ++e) {
    report.inlet.push_back(report_of_inlet(shot, scene, e));
    report.particles_at_end += report.inlet.back().emitted;
  }
  check_anything_starts(shot, report);
  if (!report.inlet.empty())
    report.particles_at_end =
        std::min(report.particles_at_end, room_of(shot, scene, Counted::standing, -shot.preroll));
  report.particles_at_end = std::max(report.particles_at_end, double(report.particles));
  report.cloth_triangles = size_t(scene.cloth.triangles());
  report.obstacle_triangles = scene.obstacles.triangles() + scene.sinks.triangles();
  // Level sets are kept by the scene and by the solver.
  report.memory = report.particles_at_end * bytes_a_particle(scene.parameters, scene) +
                  double(report.cloth_triangles) * bytes_a_triangle +
                  2 * double(scene.obstacles.level_set_bytes() + scene.sinks.level_set_bytes());
  estimate_steps(shot, scene);
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
    const double gone = double(source.gone());
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
          "{} sends nothing: its first layer would leave after the last frame or after its stop. "
          "Change its start and stop, which count from the start of the simulation, pre-roll "
          "included",
          inlet.name));
    } else if (inlet.blocked >= 1) {
      all.push_back(
          fmt::format("{} probably sends nothing: in every frame that was looked at all "
                      "of it is {}. Move it out of there",
                      inlet.name, inlet.where));
    } else if (inlet.blocked >= worth_a_word) {
      all.push_back(
          fmt::format("{:.0f} % of {} sends nothing: it is {}. Move it, or make it "
                      "smaller, for the flow that was asked for",
                      100 * inlet.blocked, inlet.name, inlet.where));
    }
  }
  all.insert(all.end(), report.notes.begin(), report.notes.end());
  return all;
}

}  // namespace drench::sim
