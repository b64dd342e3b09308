#include "pipeline/contract/shot/unit_check.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/contract/log.h"

namespace drench {

namespace {

constexpr double thickest = 0.03;  // m: felt has 0.005
constexpr double heaviest = 60;    // kg/m^2: a sheet of lead 5 mm thick
constexpr double fastest = 100;    // m/s

class UnitCheck {
 public:
  explicit UnitCheck(const Shot& shot) : shot_(shot) {}

  void warn() const {
    const Camera& camera = shot_.camera;
    keys("camera.position", camera.position), keys("camera.target", camera.target);
    keys("camera.fov_deg", camera.fov_deg), keys("wind.velocity", shot_.wind.velocity);
    for (size_t i = 0; i < shot_.fluid.emitter.size(); ++i) {
      const FluidEmitter& emitter = shot_.fluid.emitter[i];
      const std::string name = fmt::format("fluid.emitter[{}].", i);
      keys(name + "center", emitter.center), keys(name + "direction", emitter.direction);
      keys(name + "rotation_deg", emitter.rotation_deg);
    }
    for (const Obstacle& obstacle : shot_.obstacle) {
      moves(fmt::format("obstacle \"{}\": ", obstacle.name), obstacle.position,
            obstacle.rotation_deg);
      size_of(obstacle);
    }
    for (const Sink& sink : shot_.sink)
      moves(fmt::format("sink \"{}\": ", sink.shape.name), sink.shape.position,
            sink.shape.rotation_deg);
    for (const Cloth& cloth : shot_.cloth) sheet(cloth);
  }

 private:
  void say(const std::string& text) const {
    log_warning("shot", fmt::format("{}: {}", shot_.file.string(), text));
  }

  template <class T>
  void keys(const std::string& name, const Animated<T>& value) const {
    const double start = shot_.timeline.first - shot_.preroll * shot_.timeline.fps;
    const double last = value.keys.back().first;
    if (value.keys.size() < 2 || last > start) return;
    say(
        fmt::format("{}: the last key is at frame {:g} and the simulation starts at {:g}, so that "
                    "nothing changes. Keys are in frames: s seconds after the first frame is {} + "
                    "{:g} s",
                    name, last, start, shot_.timeline.first, shot_.timeline.fps));
  }

  void speed(const std::string& name, const Animated<V3d>& position) const {
    for (size_t k = 1; k < position.keys.size(); ++k) {
      const auto& [from, before] = position.keys[k - 1];
      const auto& [to, after] = position.keys[k];
      const double speed = (after - before).length() * shot_.timeline.fps / (to - from);  // m/s
      if (!(speed > fastest)) continue;
      return say(
          fmt::format("{}: moves at {:.3g} m/s between frames {:g} and {:g}, which the step "
                      "follows, however short it gets. Keys are in frames and metres",
                      name, speed, from, to));
    }
  }

  void moves(const std::string& name, const Animated<V3d>& position,
             const Animated<V3d>& rotation) const {
    keys(name + "position", position), keys(name + "rotation_deg", rotation);
    speed(name + "position", position);
  }

  void size_of(const Obstacle& obstacle) const {
    const bool ball = obstacle.type == ObstacleType::sphere;
    if (!shot_.fluid.present() || (!ball && obstacle.type != ObstacleType::box)) return;
    const V3d& size = obstacle.size;
    const double width = ball ? 2 * obstacle.radius : std::max({size.x, size.y, size.z});
    if (width >= shot_.fluid.spacing) return;
    say(
        fmt::format("obstacle \"{}\" is {:g} m wide and fluid.spacing is {:g} m: the fluid hardly "
                    "feels it. It takes two spacings and more",
                    obstacle.name, width, shot_.fluid.spacing));
  }

  void sheet(const Cloth& cloth) const {
    const std::string name = fmt::format("cloth \"{}\"", cloth.name);
    if (cloth.thickness > thickest)
      say(
          fmt::format("{} has a thickness of {:g} m, and fabrics have 0.0001 to 0.005. If "
                      "millimetres were meant, write thickness = {:g}",
                      name, cloth.thickness, 1e-3 * cloth.thickness));
    if (cloth.areal_density > heaviest)
      say(
          fmt::format("{} has an areal_density of {:g} kg/m^2, and fabrics have 0.02 to 2. If "
                      "grams were meant, write areal_density = {:g}",
                      name, cloth.areal_density, 1e-3 * cloth.areal_density));
    for (size_t k = 0; k < cloth.pin.size(); ++k)
      moves(fmt::format("{}, pin {}: ", name, k), cloth.pin[k].position, cloth.pin[k].rotation_deg);
  }

  const Shot& shot_;
};

}  // namespace

void warn_of_units(const Shot& shot) { UnitCheck(shot).warn(); }

}  // namespace drench
