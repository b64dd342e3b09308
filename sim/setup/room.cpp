#include "sim/setup/room.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/shot/source_check.h"

namespace drench::sim {

double room_of(const Shot& shot, Scene& scene, Counted which, double time) {
  const Domain& domain = shot.domain;
  for (const Axis axis : domain.axis)
    if (axis == Axis::open) return 1e30;
  const double a = shot.fluid.spacing;
  const V3d size = domain.max - domain.min;
  const double cells = size.x * size.y * size.z / (a * a * a);
  std::vector<int> counted;
  for (int k = 0; k < scene.obstacles.count(); ++k)
    if (which == Counted::all || !scene.obstacles.moves(k)) counted.push_back(k);
  if (counted.empty()) return cells;
  constexpr double most_places = 2e6;
  const double step = a * std::max(1.0, std::cbrt(cells / most_places));
  int n[3];
  for (int k = 0; k < 3; ++k) n[k] = std::max(1, int(std::lround(size[k] / step)));
  double free = 0;
  for (int z = 0; z < n[2]; ++z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) {
        const V3d p = domain.min + V3d((x + 0.5) * size.x / n[0], (y + 0.5) * size.y / n[1],
                                       (z + 0.5) * size.z / n[2]);
        bool taken = false;
        for (size_t k = 0; k < counted.size() && !taken; ++k)
          taken = scene.obstacles.distance_to(counted[k], p, time) < 0;
        free += !taken;
      }
    }
  }
  return cells * free / (double(n[0]) * n[1] * n[2]);
}

NearInlet near_inlet(const Shot& shot, const Scene& scene, const FluidEmitter& emitter,
                     double frame, const HostVec& position, const std::vector<float>& density,
                     const std::vector<float>& pressure_term) {
  const Parameters& p = scene.parameters;
  const V3d centre = inlet_at(emitter, shot.timeline, frame).center;
  const double reach = std::sqrt(inlet_area(emitter) / std::numbers::pi) + double(p.support_radius);
  const float local[3] = {scene.place(0, centre.x), scene.place(1, centre.y),
                          scene.place(2, centre.z)};
  NearInlet mean;
  size_t near = 0;
  for (size_t i = 0; i < position.size(); ++i) {
    V3d d(double(position.x[i]) - local[0], double(position.y[i]) - local[1],
          double(position.z[i]) - local[2]);
    for (int k = 0; k < 3; ++k) {
      const double period = double(p.high[k]) - double(p.low[k]);
      if (p.periodic[k]) d[k] -= period * std::round(d[k] / period);
    }
    if (d.length2() >= reach * reach) continue;
    mean.density += double(density[i]), ++near;
    if (!pressure_term.empty()) mean.pressure += double(pressure_term[i]);
  }
  if (near == 0) return {};
  const double rest = double(p.rest_density);
  return {mean.density / (double(near) * rest), mean.pressure * rest / double(near)};
}

double pressure_without_room(const Scene& scene, const FluidEmitter& emitter) {
  // A tenth of the sound speed is what is expected of the scene (sim/parameters.h).
  const double expected = std::max(0.1 * double(scene.parameters.sound_speed), emitter.speed);
  return 20 * expected * expected;
}

}  // namespace drench::sim
