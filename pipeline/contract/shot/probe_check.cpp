#include "pipeline/contract/shot/probe_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/error.h"

namespace drench {

namespace {

class ProbeChecker {
 public:
  ProbeChecker(const Shot& shot, const ShotSources& sources, size_t index)
      : shot_(shot),
        sources_(sources),
        probe_(shot.probe[index]),
        path_(fmt::format("probe[{}]", index)) {}

  void check() const {
    const bool of_fluid = probe_.type == ProbeType::height || probe_.type == ProbeType::pressure ||
                          probe_.type == ProbeType::force || probe_.type == ProbeType::volume ||
                          probe_.type == ProbeType::velocity || probe_.type == ProbeType::front;
    if (of_fluid && !shot_.fluid.present()) {
      fail("type", fmt::format("{} \"{}\" measures fluid, but the shot has none. Add a "
                               "[[fluid.box]] or remove the probe",
                               path_, probe_.name));
    }
    if (!probe_.on.empty()) check_carrier();
    if (probe_.type == ProbeType::velocity && probe_.on.empty()) check_inside(V3d(0), {0, 1, 2});
    if (probe_.type == ProbeType::front) check_direction("direction", probe_.direction);
    if (probe_.type == ProbeType::height && probe_.on.empty()) check_inside(V3d(0), {0, 2});
    if (probe_.type == ProbeType::pressure) check_disc();
    if (probe_.type == ProbeType::force) check_target();
    if (probe_.type == ProbeType::tip) check_tip();
  }

 private:
  [[noreturn]] void fail(const char* key, const std::string& text) const {
    throw Error(fmt::format("{}: {}", sources_.at(path_ + "." + key), text));
  }

  /// The probe and `reach` around it must lie between the walls; half a spacing is the width that a
  /// wall is known to.
  void check_inside(const V3d& reach, std::initializer_list<int> axes) const {
    const Domain& domain = shot_.domain;
    const double slack = 0.5 * shot_.fluid.spacing + 1e-9;
    for (const int k : axes) {
      if (domain.axis[size_t(k)] == Axis::open) {
        check_beside_open_side(k, std::max(reach[k], probe_.radius));
        continue;
      }
      // Its images are seen across a seam, but each particle once.
      if (domain.axis[size_t(k)] == Axis::periodic) {
        if (2 * reach[k] <= domain.max[k] - domain.min[k] + 1e-9) continue;
        fail("radius",
             fmt::format("{} \"{}\" is {:.6g} m wide in {}, more than the period of {:.6g} m: it "
                         "would see its fluid twice. Use a radius of at most {:.6g} m",
                         path_, probe_.name, 2 * reach[k], "xyz"[k], domain.max[k] - domain.min[k],
                         0.5 * (domain.max[k] - domain.min[k])));
      }
      const double low = probe_.position[k] - reach[k], high = probe_.position[k] + reach[k];
      if (low >= domain.min[k] - slack && high <= domain.max[k] + slack) continue;
      fail("position",
           fmt::format("{} \"{}\" reaches from {:.6g} to {:.6g} m in {}, beyond the domain's walls "
                       "at {} and {} m, where no fluid comes. Move it, or widen [domain]",
                       path_, probe_.name, low, high, "xyz"[k], domain.min[k], domain.max[k]));
    }
  }

  /// What is a spacing beyond an open side is dropped.
  void check_beside_open_side(int k, double reach) const {
    const Domain& domain = shot_.domain;
    const double x = probe_.position[k], most = reach + shot_.fluid.spacing;
    if (x >= domain.min[k] - most && x <= domain.max[k] + most) return;
    fail("position",
         fmt::format("{} \"{}\" is at {:.6g} m in {}, beyond the domain's open sides at {} and {} "
                     "m, where fluid is dropped. Move it, or widen [domain]",
                     path_, probe_.name, x, "xyz"[k], domain.min[k], domain.max[k]));
  }

  void check_direction(const char* key, const V3d& direction) const {
    if (direction.length() > 1e-9) return;
    fail(key, fmt::format("{}.{} has no direction; give it a length other than 0, for example "
                          "[0, 1, 0]",
                          path_, key));
  }

  void check_carrier() const {
    if (obstacle_named(shot_, probe_.on)) return;
    std::vector<std::string> names;
    for (const Obstacle& obstacle : shot_.obstacle) names.push_back(obstacle.name);
    fail("on", fmt::format("{}.on is \"{}\", which is not an obstacle; the obstacles of this shot: "
                           "{}",
                           path_, probe_.on,
                           names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
  }

  void check_disc() const {
    check_direction("normal", probe_.normal);
    if (!probe_.on.empty()) return;
    const V3d n = probe_.normal.normalized();
    V3d reach;
    for (int k = 0; k < 3; ++k)
      reach[k] = probe_.radius * std::sqrt(std::max(0.0, 1 - n[k] * n[k]));
    check_inside(reach, {0, 1, 2});
  }

  void check_target() const {
    if (const auto wall = wall_named(probe_.target)) {
      const bool sheet = std::any_of(shot_.cloth.begin(), shot_.cloth.end(),
                                     [&](const Cloth& c) { return c.name == probe_.target; });
      if (sheet || obstacle_named(shot_, probe_.target)) {
        fail("target",
             fmt::format("{}.target is \"{}\", which is a wall of the domain and the name "
                         "of {}; rename that",
                         path_, probe_.target, sheet ? "a sheet" : "an obstacle"));
      }
      const Axis axis = shot_.domain.axis[size_t(wall->axis)];
      if (axis == Axis::walls) return;
      fail("target", fmt::format("{}.target is \"{}\", but domain.{} is \"{}\": there is no wall. "
                                 "Use \"walls\", or another target",
                                 path_, probe_.target, "xyz"[wall->axis],
                                 axis == Axis::open ? "open" : "periodic"));
    }
    if (const auto obstacle = obstacle_named(shot_, probe_.target)) {
      for (const Cloth& cloth : shot_.cloth) {
        if (cloth.name != probe_.target) continue;
        fail("target", fmt::format("{}.target is \"{}\", which is the name of obstacle {} and of a "
                                   "sheet; rename one of them",
                                   path_, probe_.target, *obstacle + 1));
      }
      return;
    }
    check_sheet("target", probe_.target,
                "a wall (x_low, x_high, y_low, y_high, z_low, z_high), an obstacle or a sheet");
  }

  void check_tip() const {
    const Cloth& cloth = check_sheet("cloth", probe_.cloth, "a sheet");
    const double vertices = (cloth.cells.x + 1.0) * (cloth.cells.y + 1.0);
    if (!cloth.mesh_file.empty() || probe_.vertex < vertices) return;
    fail("vertex",
         fmt::format("{}.vertex is {}, but the {} x {} grid of \"{}\" has vertices 0 to "
                     "{:.0f}. Use one of these, or position",
                     path_, probe_.vertex, cloth.cells.x, cloth.cells.y, cloth.name, vertices - 1));
  }

  const Cloth& check_sheet(const char* key, const std::string& name, const char* wanted) const {
    std::vector<std::string> names;
    for (const Cloth& cloth : shot_.cloth) {
      if (cloth.name == name) return cloth;
      names.push_back(cloth.name);
    }
    if (std::string_view(key) == "target")
      for (const Obstacle& obstacle : shot_.obstacle) names.push_back(obstacle.name);
    fail(key,
         fmt::format("{}.{} is \"{}\", which is not {}; this shot has {}", path_, key, name, wanted,
                     names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
  }

  const Shot& shot_;
  const ShotSources& sources_;
  const Probe& probe_;
  const std::string path_;
};

}  // namespace

std::optional<DomainWall> wall_named(std::string_view name) {
  for (int axis = 0; axis < 3; ++axis) {
    if (name.empty() || name[0] != "xyz"[axis]) continue;
    if (name.substr(1) == "_low") return DomainWall{axis, Side::low};
    if (name.substr(1) == "_high") return DomainWall{axis, Side::high};
  }
  return {};
}

std::optional<int> obstacle_named(const Shot& shot, std::string_view name) {
  for (size_t k = 0; k < shot.obstacle.size(); ++k)
    if (shot.obstacle[k].name == name) return int(k);
  return {};
}

std::optional<DomainWall> wall_under(const Probe& probe, const Shot& shot) {
  const V3d n = probe.normal.normalized();
  const double slack = 0.5 * shot.fluid.spacing + 1e-9;
  for (int axis = 0; axis < 3; ++axis) {
    if (shot.domain.axis[size_t(axis)] != Axis::walls || std::abs(n[axis]) < 1 - 1e-6) continue;
    const double x = probe.position[axis];
    if (std::abs(x - shot.domain.min[axis]) <= slack) return DomainWall{axis, Side::low};
    if (std::abs(x - shot.domain.max[axis]) <= slack) return DomainWall{axis, Side::high};
  }
  return {};
}

void check_probes(const Shot& shot, const ShotSources& sources) {
  for (size_t i = 0; i < shot.probe.size(); ++i) ProbeChecker(shot, sources, i).check();
}

}  // namespace drench
