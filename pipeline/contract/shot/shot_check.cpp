#include "pipeline/contract/shot/shot_check.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/shot/check_base.h"
#include "pipeline/contract/shot/light_check.h"
#include "pipeline/contract/shot/picture_check.h"
#include "pipeline/contract/shot/pin_check.h"
#include "pipeline/contract/shot/printable.h"
#include "pipeline/contract/shot/probe_check.h"
#include "pipeline/contract/shot/seam_check.h"
#include "pipeline/contract/shot/source_check.h"

namespace drench {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double most_particles = 2e8;  // about 20 GB of state
constexpr double most_frames = 1e6;
constexpr double shortest_step = 1e-9;  // s; a day of them is a few ms
constexpr double least_cells = 2;       // spacings across the domain
constexpr double most_cells = 1e6;      // grid cells along one axis
constexpr double most_vertices = 4e6;   // of one sheet

class Checker : CheckBase {
 public:
  using CheckBase::CheckBase;

  void check() const {
    check_time();
    check_domain();
    check_frame();
    check_wall_velocity();
    check_fluid();
    for (size_t i = 0; i < shot_.cloth.size(); ++i) check_cloth(i);
    for (size_t i = 0; i < shot_.obstacle.size(); ++i) check_obstacle(i);
    check_obstacles_at_seams(shot_, sources_);
    check_sources(shot_, sources_);
    check_names();
    check_pins(shot_, sources_);
    check_probes(shot_, sources_);
    if (!shot_.fluid.present() && shot_.cloth.empty()) {
      fail("fluid",
           "the shot has neither fluid nor cloth, so there is nothing to simulate; add a "
           "[[fluid.box]] or a [[cloth]]");
    }
    check_particles();
    check_picture(shot_, sources_);
    warn_of_useless_lights(shot_, sources_);
  }

 private:
  void check_time() const {
    const Timeline& time = shot_.timeline;
    if (time.first > time.last) {
      fail("shot.frames", fmt::format("shot.frames is [{}, {}]; the first frame stands after the "
                                      "last. Write [{}, {}]",
                                      time.first, time.last, time.last, time.first));
    }
    const double count = double(time.last) - time.first + 1;
    if (count > most_frames) {
      fail("shot.frames", fmt::format("shot.frames is [{}, {}], {:.0f} frames; at most {:.0f} are "
                                      "allowed. Split the shot",
                                      time.first, time.last, count, most_frames));
    }
    if (shot_.time_step > 0 && shot_.time_step < shortest_step) {
      fail("shot.time_step",
           fmt::format("shot.time_step is {} s; a frame would not end: at least {} s. Use 0 for "
                       "the largest stable step",
                       shot_.time_step, shortest_step));
    }
  }

  void check_corners(const std::string& path, const V3d& min, const V3d& max) const {
    for (int i = 0; i < 3; ++i) {
      if (min[i] >= max[i]) {
        fail(path + ".min",
             fmt::format("{0}.min is {1} and {0}.max is {2}; in {3} min must be less than max. "
                         "Exchange or widen them",
                         path, text_of(min), text_of(max), "xyz"[i]));
      }
    }
  }

  void check_domain() const {
    const Domain& domain = shot_.domain;
    check_corners("domain", domain.min, domain.max);
    for (int i = 0; i < 3; ++i) {
      const double cells = (domain.max[i] - domain.min[i]) / shot_.fluid.spacing;
      if (shot_.fluid.present() && cells > most_cells) {
        fail("fluid.spacing",
             fmt::format(
                 "fluid.spacing is {} m but the domain is {} m long in {}: {:.3g} spacings, "
                 "at most {:.0f} are allowed. Use a larger spacing or a smaller domain",
                 shot_.fluid.spacing, domain.max[i] - domain.min[i], "xyz"[i], cells, most_cells));
      }
      if (shot_.fluid.present() && cells < least_cells) {
        fail("fluid.spacing",
             fmt::format("fluid.spacing is {} m but the domain is {} m long in {}: no fluid moves "
                         "there. Use a spacing of at most {:.2g} m, or a larger domain",
                         shot_.fluid.spacing, domain.max[i] - domain.min[i], "xyz"[i],
                         (domain.max[i] - domain.min[i]) / least_cells));
      }
      if (domain.axis[size_t(i)] == Axis::periodic) check_periodic(i);
    }
  }

  /// A frame that turns has an axis and repeats itself only along it.
  void check_frame() const {
    const auto& angle = shot_.frame_rotation_deg.keys;
    if (angle.size() < 2 && angle.front().second == 0) return;
    check_not_zero("shot.frame_axis", shot_.frame_axis);
    const V3d along = shot_.frame_axis.normalized();
    for (int k = 0; k < 3; ++k) {
      if (shot_.domain.axis[size_t(k)] != Axis::periodic || std::abs(along[k]) > 1 - 1e-6) continue;
      fail("shot.frame_rotation_deg",
           fmt::format("shot.frame_rotation_deg turns the domain about {}, but domain.{} is "
                       "\"periodic\": what turns is not the same a period on. Use \"walls\" or "
                       "\"open\", or an axis along {}",
                       text_of(shot_.frame_axis), "xyz"[k], "xyz"[k]));
    }
  }

  /// A moving wall stays in its plane, exists, and drags.
  void check_wall_velocity() const {
    const Domain& domain = shot_.domain;
    const std::array<V3d, 6> velocity = domain.wall_velocity.all();
    for (size_t i = 0; i < 6; ++i) {
      const V3d& v = velocity[i];
      if (v.length() == 0) continue;
      const char axis = "xyz"[i / 2];
      const std::string key =
          fmt::format("domain.wall_velocity.{}_{}", axis, i % 2 == 0 ? "low" : "high");
      if (v[int(i / 2)] != 0) {
        fail(key, fmt::format("{} is {} m/s; the wall would leave its plane. Set its {} to 0", key,
                              text_of(v), axis));
      }
      if (domain.axis[i / 2] != Axis::walls) {
        fail(key, fmt::format("{} is {} m/s but domain.{} has no walls. Set domain.{} = \"walls\" "
                              "or remove it",
                              key, text_of(v), axis, axis));
      }
      if (domain.slip == Slip::free) {
        fail(key, fmt::format("{} is {} m/s but domain.slip is \"free\"; such a wall drags "
                              "nothing. Use \"none\" or \"automatic\"",
                              key, text_of(v)));
      }
      check_drags(key);
    }
  }

  void check_drags(const std::string& key) const {
    const Fluid& fluid = shot_.fluid;
    if (!is_incompressible(shot_)) {
      fail(key, fmt::format("{} is set but the shot's fluid is weakly compressible, which knows "
                            "walls at rest only. Use fluid.solver = \"incompressible\", or "
                            "remove it",
                            key));
    }
    if (fluid.kinematic_viscosity == 0) {
      fail(key, fmt::format("{} is set but fluid.kinematic_viscosity is 0; nothing would be "
                            "dragged. Set one above 0",
                            key));
    }
  }

  /// A particle must not see a neighbour twice.
  void check_periodic(int axis) const {
    const std::string key = fmt::format("domain.{}", "xyz"[axis]);
    const double length = shot_.domain.max[axis] - shot_.domain.min[axis];
    if (!shot_.cloth.empty() && shot_.fluid.present() && !is_incompressible(shot_)) {
      fail(key, fmt::format("{} is \"periodic\" but the shot has cloth in a weakly compressible "
                            "fluid, which does not see it across the seam. Use fluid.solver = "
                            "\"incompressible\", or \"walls\" or \"open\"",
                            key));
    }
    const double support = support_ratio(shot_) * shot_.fluid.spacing;
    if (length < 2 * support * (1 - 1e-9)) {
      fail(key, fmt::format("{} is \"periodic\" but domain.min and domain.max are only {:.6g} m "
                            "apart there; particles would see each other from both sides. Use at "
                            "least two support radii, {:.6g} m",
                            key, length, 2 * support));
    }
    for (size_t i = 0; i < shot_.fluid.box.size(); ++i) check_seam_of_box(i, axis, length);
    for (size_t i = 0; i < shot_.fluid.sphere.size(); ++i) {
      check_seam_of_ball(fmt::format("fluid.sphere[{}]", i), shot_.fluid.sphere[i].radius, axis,
                         length);
    }
    for (size_t i = 0; i < shot_.fluid.drops.size(); ++i) {
      check_seam_of_ball(fmt::format("fluid.drops[{}]", i), shot_.fluid.drops[i].radius, axis,
                         length);
    }
  }

  /// The lattice of a box that goes all around must join itself.
  void check_seam_of_box(size_t i, int axis, double length) const {
    const FluidBox& box = shot_.fluid.box[i];
    const double a = shot_.fluid.spacing, layers = std::round(length / a);
    const double gap = length - a * std::floor((box.max[axis] - box.min[axis]) / a + 1e-6);
    if (gap > 0.999 * a || std::abs(gap) < 1e-3 * a) return;
    const std::string path = fmt::format("fluid.box[{}]", i);
    fail(path,
         fmt::format("{} goes all around the periodic {} axis, {:.9g} m, but its layers {} by "
                     "{:.3g} m at the seam: that is {:.6g} times fluid.spacing = {} m. Use "
                     "fluid.spacing = {:.9g} m, a domain of {:.9g} m, or a shorter box",
                     path, "xyz"[axis], length, gap > 0 ? "part" : "overlap", std::abs(gap),
                     length / a, a, length / layers, layers * a));
  }

  void check_seam_of_ball(const std::string& path, double radius, int axis, double length) const {
    const double most = 0.5 * (length - shot_.fluid.spacing);
    if (radius <= most) return;
    fail(path, fmt::format("{}.radius is {} m but the periodic {} axis is {:.6g} m long; the ball "
                           "would touch itself across the seam. Use at most {:.6g} m",
                           path, radius, "xyz"[axis], length, most));
  }

  /// Fluid must start between the walls; half a spacing is the rounding of a lattice.
  void check_inside(const std::string& path, const V3d& min, const V3d& max) const {
    const Domain& domain = shot_.domain;
    const double slack = 0.5 * shot_.fluid.spacing + 1e-9;
    for (int i = 0; i < 3; ++i) {
      if (domain.axis[size_t(i)] != Axis::walls) continue;
      if (min[i] < domain.min[i] - slack || max[i] > domain.max[i] + slack) {
        fail(path, fmt::format("{} reaches from {} to {} m in {}, beyond the domain's walls at {} "
                               "and {} m. Move it, or widen [domain]",
                               path, min[i], max[i], "xyz"[i], domain.min[i], domain.max[i]));
      }
    }
  }

  void check_fluid() const {
    if (shot_.fluid.write_source && shot_.fluid.sources() > 256)
      fail("fluid.write_source", fmt::format("the shot has {} sources of fluid; at most 256 can be "
                                             "told apart. Leave it out, or use fewer",
                                             shot_.fluid.sources()));
    const Fluid& fluid = shot_.fluid;
    if (fluid.solver == FluidSolver::incompressible && !shot_.cloth.empty() &&
        shot_.coupling.scheme == CouplingScheme::paper) {
      fail("fluid.solver",
           "fluid.solver is \"incompressible\" but coupling.scheme is \"paper\", which knows "
           "explicit pressures alone. Use coupling.scheme = \"exact\" or fluid.solver = "
           "\"weakly_compressible\"");
    }
    if (fluid.surface_tension > 0)
      check_surface_tension();
    else
      check_right_angles();
    if (fluid.support_ratio > 0 && fluid.support_ratio < 1.2) {
      fail("fluid.support_ratio",
           fmt::format("support radius is {} m (support_ratio {}) but fluid.spacing is {} m; "
                       "particles would have no neighbours. Use support_ratio = 2.0 ({} m), at "
                       "least 1.2",
                       fluid.support_ratio * fluid.spacing, fluid.support_ratio, fluid.spacing,
                       2 * fluid.spacing));
    }
    for (size_t i = 0; i < fluid.box.size(); ++i) check_box(i);
    for (size_t i = 0; i < fluid.sphere.size(); ++i) {
      const FluidSphere& sphere = fluid.sphere[i];
      const std::string path = fmt::format("fluid.sphere[{}]", i);
      check_positive(path + ".radius", sphere.radius, " m", "the sphere would hold no fluid");
      check_inside(path, sphere.center - V3d(sphere.radius), sphere.center + V3d(sphere.radius));
    }
    for (size_t i = 0; i < fluid.drops.size(); ++i) check_drops(i);
  }

  /// What surface tension has been measured with, and nothing else.
  void check_surface_tension() const {
    const auto refuse = [&](std::string_view what, std::string_view action) {
      fail("fluid.surface_tension",
           fmt::format("fluid.surface_tension is {} N/m but {}. {}, or remove it",
                       shot_.fluid.surface_tension, what, action));
    };
    if (!is_incompressible(shot_)) {
      refuse("the shot's fluid is weakly compressible, which has none",
             "Use fluid.solver = \"incompressible\"");
    }
    if (shot_.fluid.support_ratio > 0) {
      refuse(fmt::format("fluid.support_ratio is {}, at which its strength has not been measured",
                         shot_.fluid.support_ratio),
             "Leave fluid.support_ratio at 0");
    }
  }

  /// What pulls fluid to another angle is a part of the surface's tension.
  void check_right_angles() const {
    const auto check = [&](const std::string& path, double degrees) {
      if (wetting_of(degrees) == 0) return;
      fail(path + ".contact_angle_deg",
           fmt::format("{}.contact_angle_deg is {} but fluid.surface_tension is 0, so that nothing "
                       "pulls the fluid there. Set fluid.surface_tension (0.072 for water), or "
                       "remove the angle",
                       path, degrees));
    };
    check("domain", shot_.domain.contact_angle_deg);
    for (size_t i = 0; i < shot_.obstacle.size(); ++i)
      check(fmt::format("obstacle[{}]", i), shot_.obstacle[i].contact_angle_deg);
    for (size_t i = 0; i < shot_.cloth.size(); ++i)
      check(fmt::format("cloth[{}]", i), shot_.cloth[i].contact_angle_deg);
  }

  void check_box(size_t i) const {
    const FluidBox& box = shot_.fluid.box[i];
    const std::string path = fmt::format("fluid.box[{}]", i);
    check_corners(path, box.min, box.max);
    for (int k = 0; k < 3; ++k) {
      if (std::round((box.max[k] - box.min[k]) / shot_.fluid.spacing) < 1) {
        fail(path, fmt::format("{} is {} m thick in {}, less than half of fluid.spacing ({} m), so "
                               "it holds no particle. Use a smaller spacing or a thicker box",
                               path, box.max[k] - box.min[k], "xyz"[k], shot_.fluid.spacing));
      }
    }
    check_inside(path, box.min, box.max);
  }

  void check_drops(size_t i) const {
    const FluidDrops& drops = shot_.fluid.drops[i];
    const std::string path = fmt::format("fluid.drops[{}]", i);
    for (int k = 0; k < 3; ++k) {
      if (drops.min[k] > drops.max[k]) {
        fail(path + ".min",
             fmt::format("{0}.min is {1} and {0}.max is {2}; in {3} min exceeds max. Exchange them",
                         path, text_of(drops.min), text_of(drops.max), "xyz"[k]));
      }
    }
    check_positive(path + ".radius", drops.radius, " m", "a drop would hold no fluid");
    check_positive(path + ".count", drops.count, "", "there would be no drop");
    check_inside(path, drops.min - V3d(drops.radius), drops.max + V3d(drops.radius));
  }

  /// Largest number of particles that the sources may give, from their volumes.
  double particles_of_sources() const {
    const Fluid& fluid = shot_.fluid;
    const Timeline& time = shot_.timeline;
    const double end = shot_.preroll + (double(time.last) - time.first) / time.fps;
    double count = particles_at_start(shot_);
    for (const FluidEmitter& e : fluid.emitter) {
      const double flows = std::max(0.0, std::min(e.stop, end) - e.start);
      count += inlet_area(e) * e.speed * flows / std::pow(fluid.spacing, 3);
    }
    return count;
  }

  void check_particles() const {
    const double count = particles_of_sources();
    if (count > most_particles) {
      fail("fluid.spacing",
           fmt::format("fluid.spacing is {} m, which gives about {:.3g} particles; at most {:.3g} "
                       "are allowed. Use at least {:.2g} m, or less fluid",
                       shot_.fluid.spacing, count, most_particles,
                       1.01 * shot_.fluid.spacing * std::cbrt(count / most_particles)));
    }
  }

  void check_cloth(size_t i) const {
    const Cloth& cloth = shot_.cloth[i];
    const std::string path = fmt::format("cloth[{}]", i);
    const double vertices = (cloth.cells.x + 1.0) * (cloth.cells.y + 1.0);
    if (cloth.mesh_file.empty()) {
      const double area = cloth.u.cross(cloth.v).length();
      if (!(area > 1e-12)) {
        fail(path + ".u", fmt::format("{0}.u is {1} and {0}.v is {2}; the sheet has no area. Give "
                                      "two edges that are not parallel",
                                      path, text_of(cloth.u), text_of(cloth.v)));
      }
      if (vertices > most_vertices) {
        fail(path + ".cells",
             fmt::format("{}.cells is [{}, {}], {:.0f} vertices; at most {:.0f} "
                         "are allowed. Use fewer cells",
                         path, cloth.cells.x, cloth.cells.y, vertices, most_vertices));
      }
    }
    if (cloth.weld < 0 && cloth.weld != -1) {
      fail(path + ".weld", fmt::format("{}.weld is {} m; give a distance, 0 for none, or -1 for "
                                       "1e-5 of the mesh's diagonal",
                                       path, cloth.weld));
    }
    if (cloth.sleep_speed < 0 && cloth.sleep_speed != -1) {
      fail(
          path + ".sleep_speed",
          fmt::format("{}.sleep_speed is {} m/s; give a speed, 0 for a sheet that never sleeps, or "
                      "-1 to go by its size",
                      path, cloth.sleep_speed));
    }
    if (cloth.model == ClothModel::shell && shot_.fluid.present() && !is_incompressible(shot_)) {
      fail(path + ".model",
           fmt::format("{}.model is \"shell\", whose steps are implicit, but the fluid is weakly "
                       "compressible and takes its sheets along in explicit ones. Use "
                       "fluid.solver = \"incompressible\", or model = \"springs\"",
                       path));
    }
    if (is_ever_wet(cloth) && cloth.water_capacity == 0) {
      const std::string key = path + (cloth.soaks ? ".soaks" : ".wetness");
      fail(key, fmt::format("{} asks for a wet sheet, but {}.water_capacity is 0: {} takes up no "
                            "water. Give water_capacity, or remove the key",
                            key, path, cloth.fabric));
    }
    if (cloth.model != ClothModel::shell &&
        !(cloth.adjacent_stiffness + cloth.diagonal_stiffness > 0)) {
      fail(
          path + ".adjacent_stiffness",
          fmt::format("{0}.adjacent_stiffness and {0}.diagonal_stiffness are both 0; nothing would "
                      "hold the sheet together. Set one above 0",
                      path));
    }
    if (cloth.retardation_time > 0 && !(shot_.fluid.present() && is_incompressible(shot_))) {
      fail(path + ".retardation_time",
           fmt::format("{}.retardation_time is {} s, but only sheets beside incompressible fluid "
                       "take implicit steps; explicit ones would be too short to end. Use 0",
                       path, cloth.retardation_time));
    }
  }

  void check_obstacle(size_t i) const {
    const Obstacle& obstacle = shot_.obstacle[i];
    const std::string path = fmt::format("obstacle[{}]", i);
    if (shot_.fluid.solver == FluidSolver::weakly_compressible) {
      fail("fluid.solver",
           "fluid.solver is \"weakly_compressible\" but the shot has obstacles, which only the "
           "incompressible solver knows. Use \"incompressible\" or \"automatic\"");
    }
    if (obstacle.type == ObstacleType::plane) check_not_zero(path + ".normal", obstacle.normal);
    if (obstacle.type == ObstacleType::sphere)
      check_positive(path + ".radius", obstacle.radius, " m", "the sphere has no volume");
    for (int k = 0; k < 3 && obstacle.type == ObstacleType::box; ++k)
      check_positive(path + ".size", obstacle.size[k], " m", "the box has no volume");
    if (obstacle.type == ObstacleType::mesh) check_obstacle_files(obstacle, path + ".mesh");
  }

  void check_obstacle_files(const Obstacle& obstacle, const std::string& key) const {
    if (obstacle.mesh_file.empty())
      fail(key, fmt::format("{} is missing; add mesh = \"file.ply\"", key));
    if (!is_utf8(obstacle.mesh_file.string()))
      fail(key, fmt::format("{}: its folder's name is not UTF-8; rename the folder", key));
    if (!is_sequence(obstacle.mesh_file)) return;
    for (int frame = shot_.timeline.first; frame <= shot_.timeline.last; ++frame) {
      const std::filesystem::path file = sequence_file(obstacle.mesh_file, frame);
      std::error_code code;
      if (!std::filesystem::is_regular_file(file, code)) {
        fail(key, fmt::format("{} has no file {} for frame {}; a sequence has one for every frame "
                              "of shot.frames. Add it or shorten the shot",
                              key, file.string(), frame));
      }
    }
  }

  template <class T>
  void check_distinct(const std::vector<T>& objects, const std::string& section) const {
    for (size_t i = 0; i < objects.size(); ++i) {
      for (size_t j = 0; j < i; ++j) {
        if (objects[i].name != objects[j].name) continue;
        const std::string key = fmt::format("{}[{}].name", section, i);
        fail(key, fmt::format("two things of [[{}]] are named \"{}\"; the other one stands at {}. "
                              "Give each its own name",
                              section, objects[i].name,
                              sources_.at(fmt::format("{}[{}].name", section, j))));
      }
    }
  }

  void check_names() const {
    check_distinct(shot_.cloth, "cloth");
    check_distinct(shot_.obstacle, "obstacle");
    std::vector<Obstacle> sinks;
    for (const Sink& sink : shot_.sink) sinks.push_back(sink.shape);
    check_distinct(sinks, "sink");
    check_distinct(shot_.probe, "probe");
    check_distinct(shot_.light, "light");
    check_distinct(shot_.material, "material");
  }
};

}  // namespace

std::string ShotSources::at(const std::string& key) const {
  for (std::string path = key; !path.empty();) {
    const auto found = where.find(path);
    if (found != where.end()) return found->second;
    const size_t cut = path.find_last_of(".[");
    path.resize(cut == std::string::npos ? 0 : cut);
  }
  return file;
}

double particles_at_start(const Shot& shot) {
  const Fluid& fluid = shot.fluid;
  const double unit = fluid.spacing * fluid.spacing * fluid.spacing;
  const auto ball = [](double radius) { return 4 * pi / 3 * radius * radius * radius; };
  double count = 0;
  for (const FluidBox& box : fluid.box) {
    const V3d size = box.max - box.min;
    count += size.x * size.y * size.z / unit;
  }
  for (const FluidSphere& sphere : fluid.sphere) count += ball(sphere.radius) / unit;
  for (const FluidDrops& drops : fluid.drops)
    count += drops.particles > 0 ? drops.particles : drops.count * ball(drops.radius) / unit;
  return count;
}

void check_shot(const Shot& shot, const ShotSources& sources) { Checker(shot, sources).check(); }

}  // namespace drench
