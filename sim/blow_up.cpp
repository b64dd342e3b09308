#include "sim/blow_up.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/setup/room.h"

namespace drench::sim {

namespace {

constexpr double tight = 2;  // spacings, that fluid needs to get away between two solids

V3d world(const Scene& scene, const HostVec& column, int i) {
  return {scene.frame.to_world(0, column.x[size_t(i)]),
          scene.frame.to_world(1, column.y[size_t(i)]),
          scene.frame.to_world(2, column.z[size_t(i)])};
}

/// Emitters that pour into a domain which is full, or into fluid that is too dense.
std::string sources_that_overfill(const Shot& shot, Scene& scene, const HostState& state,
                                  const std::vector<float>& density,
                                  const std::vector<bool>& crowded, double time) {
  const double room = room_of(shot, scene, Counted::standing, time),
               share = double(state.id.size()) / room;
  const bool full = share > 0.97;
  std::string names;
  for (size_t e = 0; e < shot.fluid.emitter.size(); ++e) {
    const FluidEmitter& emitter = shot.fluid.emitter[e];
    const double since = time + shot.preroll;
    if (since < emitter.start || since > emitter.stop) continue;
    const double frame = shot.timeline.first + time * shot.timeline.fps;
    const bool inlet = emitter.type != EmitterType::mesh && density.size() == state.id.size();
    constexpr double too_dense = 1.01;
    if (!full && !crowded[e] &&
        !(inlet &&
          near_inlet(shot, scene, emitter, frame, state.position, density, {}).density > too_dense))
      continue;
    names += fmt::format("{}fluid.emitter[{}]", names.empty() ? "" : ", ", e);
  }
  if (names.empty()) return "";
  return fmt::format(
      "{}: {} had no room left to send into. Stop it earlier (stop), leave a way "
      "out, or add a [[sink]]",
      full ? fmt::format("The domain is closed and {:.0f} % full", 100 * share)
           : "The fluid before an inlet is too dense, or in a vessel that is closed and full",
      names);
}

/// Obstacles that move in a closed domain and leave its fluid too little room.
std::string obstacles_that_take_room(const Shot& shot, Scene& scene, const HostState& state,
                                     double time) {
  if (!scene.obstacles.any_moves()) return "";
  const double room = room_of(shot, scene, Counted::all, time), held = double(state.id.size());
  if (held < 0.97 * room) return "";
  std::string names;
  for (int k = 0; k < scene.obstacles.count(); ++k) {
    if (!scene.obstacles.moves(k)) continue;
    names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", scene.obstacles.obstacle(k).name);
  }
  return fmt::format(
      "The domain is closed, and what moves in it leaves room for {:.0f} particles, of which there "
      "are {:.0f}: obstacle {}. Stop it earlier, or leave the fluid a way out",
      room, held, names);
}

struct Solid {
  std::string name;
  double distance;  // m
  bool moves;
  V3d normal;  // unit, from the solid to the place
};

/// By differences of the distance over half a spacing.
V3d normal_of(const Shot& shot, Scene& scene, int obstacle, const V3d& p, double time) {
  const double e = 0.25 * shot.fluid.spacing;
  V3d slope;
  for (int k = 0; k < 3; ++k) {
    V3d step(0);
    step[k] = e;
    slope[k] = scene.obstacles.distance_to(obstacle, p + step, time) -
               scene.obstacles.distance_to(obstacle, p - step, time);
  }
  return slope.length() > 0 ? slope.normalized() : slope;
}

/// Walls and obstacles within reach of a place.
std::vector<Solid> solids_near(const Shot& shot, Scene& scene, const V3d& p, double time,
                               double reach) {
  std::vector<Solid> near;
  for (int k = 0; k < 3; ++k) {
    if (shot.domain.axis[size_t(k)] != Axis::walls) continue;
    const double low = p[k] - shot.domain.min[k], high = shot.domain.max[k] - p[k];
    const std::string axis(1, "xyz"[k]);
    V3d up(0);
    up[k] = 1;
    if (low < reach) near.push_back({"the domain's wall " + axis + "_low", low, false, up});
    if (high < reach) near.push_back({"the domain's wall " + axis + "_high", high, false, -up});
  }
  for (int k = 0; k < scene.obstacles.count(); ++k) {
    const double d = scene.obstacles.distance_to(k, p, time);
    if (d >= reach) continue;
    near.push_back({fmt::format("obstacle \"{}\"", scene.obstacles.obstacle(k).name), d,
                    scene.obstacles.moves(k), normal_of(shot, scene, k, p, time)});
  }
  return near;
}

/// A solid that moves, and another one that it leaves no room to.
std::string obstacle_that_closes(const Shot& shot, Scene& scene, const V3d& p, double time) {
  const double a = shot.fluid.spacing;
  std::vector<Solid> near = solids_near(shot, scene, p, time, tight * a);
  std::stable_sort(near.begin(), near.end(), [](const Solid& s, const Solid& t) {
    return s.moves != t.moves ? s.moves : s.distance < t.distance;
  });
  if (near.size() < 2 || !near[0].moves) return "";
  // What it slides along does not face it.
  const auto other = std::find_if(near.begin() + 1, near.end(), [&](const Solid& solid) {
    return solid.normal.dot(near[0].normal) < -0.5;
  });
  if (other == near.end()) return "";
  const double gap = std::max(0.0, near[0].distance) + std::max(0.0, other->distance);
  if (gap > tight * a) return "";
  return fmt::format(
      "{} closes on {} there: {:.2g} spacings are left between them, and fluid that "
      "is shut in has nowhere to go. Leave two spacings ({:.3g} m), or move it more "
      "slowly",
      near[0].name, other->name, gap / a, tight * a);
}

/// m, of the spring s from node v, over its rest length.
double stretch_of(const ClothTopology& t, const HostVec& x, size_t v, size_t s) {
  const auto end = size_t(t.spring_end[s]);
  V3d d(double(x.x[end]) - x.x[v], double(x.y[end]) - x.y[v], double(x.z[end]) - x.z[v]);
  if (t.spring_shift.size() > 0)
    d += V3d(t.spring_shift.x[s], t.spring_shift.y[s], t.spring_shift.z[s]);
  return d.length() / double(t.rest_length[s]);
}

/// A sheet that is stretched as a whole, which one vertex that was thrown does not do.
std::string sheet_beyond_its_length(const Shot& shot, const Scene& scene, const HostState& state) {
  const ClothTopology& t = scene.cloth;
  for (size_t sheet = 0; sheet < scene.sheet.size(); ++sheet) {
    double sum = 0;
    size_t springs = 0;
    for (int v = scene.first_vertex[sheet]; v < scene.first_vertex[sheet + 1]; ++v) {
      for (int s = t.spring_start[size_t(v)]; s < t.spring_start[size_t(v) + 1]; ++s, ++springs) {
        const double stretch = stretch_of(t, state.cloth_position, size_t(v), size_t(s));
        sum += stretch < 2 ? stretch : 2;  // of what is not finite, too
      }
    }
    constexpr double much = 1.25;
    if (springs == 0 || sum < much * double(springs)) continue;
    return fmt::format(
        "Cloth \"{}\" is stretched to {:.3g} times its length in the mean: look at "
        "what it is pinned to and what pulls it, or give it more stiffness",
        shot.cloth[sheet].name, sum / double(springs));
  }
  return "";
}

/// |F|^2, F the deformation gradient of triangle k.
double stretch2_of(const ClothTopology& t, const HostVec& x, size_t k) {
  V3d at_rest[2], now[2];
  const auto of = [&](const HostVec& from, size_t corner) {
    const auto v = size_t(t.corner[corner]);
    V3d p(from.x[v], from.y[v], from.z[v]);
    if (t.corner_shift.size() > 0)
      p += V3d(t.corner_shift.x[corner], t.corner_shift.y[corner], t.corner_shift.z[corner]);
    return p;
  };
  for (size_t c = 0; c < 2; ++c) {
    at_rest[c] = of(t.rest, 3 * k + c + 1) - of(t.rest, 3 * k);
    now[c] = of(x, 3 * k + c + 1) - of(x, 3 * k);
  }
  const double a = at_rest[0].length2(), b = at_rest[0].dot(at_rest[1]), c = at_rest[1].length2();
  return (now[0].length2() * c - 2 * now[0].dot(now[1]) * b + now[1].length2() * a) /
         (a * c - b * b);
}

/// A triangle at a vertex that is stretched beyond what any fabric bears.
std::string triangle_beyond_its_size(const Shot& shot, const Scene& scene, const HostState& state,
                                     size_t vertex) {
  const ClothTopology& t = scene.cloth;
  double most = 0;
  for (int f = t.fan_start[vertex]; f < t.fan_start[vertex + 1]; ++f)
    most = std::max(most, stretch2_of(t, state.cloth_position, size_t(t.fan_entry[size_t(f)]) / 3));
  if (most < 100) return "";
  return fmt::format(
      "Cloth \"{}\" has a triangle there that is stretched to {:.3g} times its size: look at what "
      "pulls it, or give it triangles that are less narrow",
      shot.cloth[size_t(t.sheet_of(int(vertex)))].name, std::sqrt(most));
}

}  // namespace

std::string cause_of_blow_up(const Shot& shot, Scene& scene, const HostState& state,
                             const std::vector<float>& density, const std::vector<bool>& crowded,
                             const Culprit& culprit, double time, double dt) {
  const HostVec& x = culprit.particle ? state.position : state.cloth_position;
  const HostVec& v = culprit.particle ? state.velocity : state.cloth_velocity;
  const auto i = size_t(culprit.index);
  // Where it was thrown, not where it is now.
  const V3d p = world(scene, x, culprit.index) - V3d(v.x[i], v.y[i], v.z[i]) * dt;
  const bool placed = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  std::string cause = sources_that_overfill(shot, scene, state, density, crowded, time);
  if (cause.empty()) cause = obstacles_that_take_room(shot, scene, state, time);
  if (cause.empty() && placed) cause = obstacle_that_closes(shot, scene, p, time);
  if (cause.empty() && scene.cloth.vertices() > 0)
    cause = sheet_beyond_its_length(shot, scene, state);
  if (cause.empty() && !culprit.particle) cause = triangle_beyond_its_size(shot, scene, state, i);
  const std::string settings = !scene.parameters.incompressible
                                   ? ", a softer cloth or a larger fluid.sound_speed"
                               : culprit.particle ? " or a smaller fluid.tolerance"
                                                  : " or a softer cloth";
  return (cause.empty() ? "" : cause + ". If that is as it should be: ") +
         fmt::format("{} a smaller shot.time_step{}", cause.empty() ? "Try" : "try", settings);
}

}  // namespace drench::sim
