#include "pipeline/contract/shot/source_check.h"

#include <cmath>
#include <numbers>
#include <set>

#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/shot/check_base.h"

namespace drench {

namespace {

class SourceChecker {
 public:
  SourceChecker(const Shot& shot, const ShotSources& sources, std::string path)
      : shot_(shot), sources_(sources), path_(std::move(path)) {}

  void check(const FluidEmitter& emitter) const {
    check_window(emitter.start, emitter.stop);
    if (emitter.type == EmitterType::mesh) return check_mesh(emitter.mesh_file);
    if (emitter.type == EmitterType::disc) {
      check_positive("radius", emitter.radius, " m", "the inlet has no area");
      for (const double frame : frames_of(emitter.direction))
        check_direction("direction", emitter.direction.at(frame));
    } else {
      check_edges(emitter);
    }
    check_positive("speed", emitter.speed, " m/s", "nothing would flow");
    for (const double frame : frames_of(emitter.center)) check_inside(emitter.center.at(frame));
  }

  void check(const FluidVolume& volume) const { check_mesh(volume.mesh_file); }

  void check(const Sink& sink) const {
    const Obstacle& shape = sink.shape;
    if (!shot_.fluid.present()) {
      fail("", fmt::format("{} \"{}\" takes fluid away, but the shot has none. Add a [[fluid.box]] "
                           "or remove the [[sink]]",
                           path_, shape.name));
    }
    check_window(sink.start, sink.stop);
    if (shape.type == ObstacleType::plane) check_direction("normal", shape.normal);
    if (shape.type == ObstacleType::sphere)
      check_positive("radius", shape.radius, " m", "the sphere has no volume");
    for (int k = 0; k < 3 && shape.type == ObstacleType::box; ++k)
      check_positive("size", shape.size[k], " m", "the box has no volume");
    if (shape.type != ObstacleType::mesh) return;
    if (shape.mesh_file.empty()) fail("mesh", path_ + ".mesh is missing; add mesh = \"file.ply\"");
    check_single_file(shape.mesh_file);
  }

 private:
  [[noreturn]] void fail(const std::string& key, const std::string& text) const {
    throw Error(fmt::format("{}: {}", sources_.at(key.empty() ? path_ : path_ + "." + key), text));
  }

  static std::set<double> frames_of(const Animated<V3d>& track) {
    std::set<double> frames;
    for (const auto& [frame, value] : track.keys) frames.insert(frame);
    return frames;
  }

  void check_direction(const std::string& key, const V3d& v) const {
    if (v.length() > 1e-9) return;
    fail(key, fmt::format("{}.{} is {}, which has no direction; give it a length other than 0",
                          path_, key, text_of(v)));
  }

  void check_positive(const std::string& key, double value, std::string_view unit,
                      std::string_view why) const {
    if (value > 0) return;
    fail(key, fmt::format("{}.{} is {}{}; {}. Use a value above 0", path_, key, value, unit, why));
  }

  void check_edges(const FluidEmitter& emitter) const {
    const double u = emitter.u.length(), v = emitter.v.length();
    if (u > 1e-9 && v > 1e-9 && std::abs(emitter.u.dot(emitter.v)) < 1e-6 * u * v) return;
    fail("u", fmt::format("{0}.u is {1} and {0}.v is {2}; an inlet needs two half edges at right "
                          "angles, neither of length 0",
                          path_, text_of(emitter.u), text_of(emitter.v)));
  }

  void check_window(double start, double stop) const {
    if (start < stop) return;
    fail("start", fmt::format("{0}.start is {1} s and {0}.stop is {2} s; it would stop before it "
                              "starts. Exchange them",
                              path_, start, stop));
  }

  void check_inside(const V3d& center) const {
    const Domain& domain = shot_.domain;
    const double slack = 0.5 * shot_.fluid.spacing + 1e-9;
    for (int i = 0; i < 3; ++i) {
      if (domain.axis[size_t(i)] != Axis::walls) continue;
      if (center[i] >= domain.min[i] - slack && center[i] <= domain.max[i] + slack) continue;
      fail("center",
           fmt::format("{}.center is at {} m in {}, beyond the domain's walls at {} and {} "
                       "m. Move it, or widen [domain]",
                       path_, center[i], "xyz"[i], domain.min[i], domain.max[i]));
    }
  }

  void check_mesh(const std::filesystem::path& file) const {
    if (file.empty()) fail("mesh", path_ + ".mesh is empty; name a closed PLY or OBJ");
    check_single_file(file);
  }

  void check_single_file(const std::filesystem::path& file) const {
    if (!is_sequence(file)) return;
    fail("mesh", fmt::format("{}.mesh is {}, a sequence; only an [[obstacle]] may deform. Name one "
                             "file",
                             path_, file.string()));
  }

  const Shot& shot_;
  const ShotSources& sources_;
  std::string path_;
};

}  // namespace

double inlet_area(const FluidEmitter& emitter) {
  if (emitter.type == EmitterType::mesh) return 0;
  if (emitter.type == EmitterType::rectangle) return 4 * emitter.u.cross(emitter.v).length();
  return std::numbers::pi * emitter.radius * emitter.radius;
}

void check_sources(const Shot& shot, const ShotSources& sources) {
  const auto check_all = [&](const auto& objects, const char* section) {
    for (size_t i = 0; i < objects.size(); ++i)
      SourceChecker(shot, sources, fmt::format("{}[{}]", section, i)).check(objects[i]);
  };
  check_all(shot.fluid.emitter, "fluid.emitter");
  check_all(shot.fluid.volume, "fluid.volume");
  check_all(shot.sink, "sink");
  const bool felt = shot.wind.present && shot.wind.air_density > 0 && shot.wind.fluid_drag > 0;
  if (felt && shot.fluid.present() && !is_incompressible(shot)) {
    throw Error(fmt::format(
        "{}: wind.fluid_drag is {} but the shot's fluid is weakly compressible, which feels no "
        "wind. Use fluid.solver = \"incompressible\", or wind.fluid_drag = 0 for wind on cloth "
        "alone",
        sources.at("wind.fluid_drag"), shot.wind.fluid_drag));
  }
}

}  // namespace drench
