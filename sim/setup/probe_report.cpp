#include "sim/setup/probe_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pipeline/contract/geometry/obstacle.h"
#include "pipeline/contract/shot/probe_check.h"

namespace drench::sim {

namespace {

/// The obstacle that stands and has a point at least so deep in it, m; -1: none.
int solid_around(Scene& scene, const V3d& p, double depth, double time) {
  for (int k = 0; k < scene.obstacles.count(); ++k) {
    if (!scene.obstacles.moves(k) && scene.obstacles.distance_to(k, p, time) < -depth) return k;
  }
  return -1;
}

/// The same of all of a vertical line between the ends of the domain, looked at every half spacing.
int solid_around_line(const Shot& shot, Scene& scene, V3d p, double time) {
  const double low = shot.domain.min.y, high = shot.domain.max.y;
  constexpr double most_looks = 10000;
  const double looks = std::min(std::ceil(2 * (high - low) / shot.fluid.spacing), most_looks);
  int solid = -1;
  for (double k = 0; k <= looks; ++k) {
    p.y = low + (high - low) * k / looks;
    solid = solid_around(scene, p, 0, time);
    if (solid < 0) return -1;
  }
  return solid;
}

bool beyond(const Domain& domain, const V3d& p, double slack) {
  for (int k = 0; k < 3; ++k) {
    if (domain.axis[size_t(k)] == Axis::periodic) continue;
    if (p[k] < domain.min[k] - slack || p[k] > domain.max[k] + slack) return true;
  }
  return false;
}

/// Why a probe of fluid at a place never reads; empty if it may.
std::string why_never(const Shot& shot, Scene& scene, const Probe& probe) {
  const double a = shot.fluid.spacing, time = -shot.preroll;
  V3d p = probe.position;
  if (!probe.on.empty()) {
    const int carrier = *obstacle_named(shot, probe.on);
    if (scene.obstacles.moves(carrier)) return "";
    p = obstacle_pose(scene.obstacles.obstacle(carrier), shot.timeline.first).to_world(p);
    V3d within = p;  // a height is read over all of its line
    if (probe.type == ProbeType::height) within.y = shot.domain.min.y;
    if (beyond(shot.domain, within, probe.radius + a)) {
      return fmt::format(
          "on \"{}\" its position is ({:.4g}, {:.4g}, {:.4g}) m in the world, beyond the domain: "
          "give it in the obstacle's own coordinates",
          probe.on, p.x, p.y, p.z);
    }
  }
  int solid = -1;
  if (probe.type == ProbeType::velocity)
    solid = solid_around(scene, p, std::max(probe.radius, a), time);
  if (probe.type == ProbeType::pressure) solid = solid_around(scene, p, 1.5 * a, time);
  if (probe.type == ProbeType::height) solid = solid_around_line(shot, scene, p, time);
  if (solid < 0) return "";
  return fmt::format("it lies in obstacle \"{}\": move it out",
                     scene.obstacles.obstacle(solid).name);
}

}  // namespace

void note_probes(const Shot& shot, Scene& scene) {
  for (const Probe& probe : shot.probe) {
    std::string why;
    if (probe.type == ProbeType::force) {
      const auto target = obstacle_named(shot, probe.target);
      if (target && !scene.obstacles.moves(*target) &&
          lies_beyond(shot.domain, shot.fluid.spacing, scene.obstacles, *target))
        why = fmt::format("obstacle \"{}\" lies wholly beyond the domain: move it", probe.target);
    } else if (probe.type == ProbeType::velocity || probe.type == ProbeType::pressure ||
               probe.type == ProbeType::height) {
      why = why_never(shot, scene, probe);
    }
    if (!why.empty())
      scene.report.notes.push_back(
          fmt::format("probe \"{}\" can never read anything: {}", probe.name, why));
  }
}

}  // namespace drench::sim
