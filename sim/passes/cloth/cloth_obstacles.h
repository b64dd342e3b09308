#pragma once
// Sheets on obstacles. A vertex keeps a distance to every surface; one that forces would take
// nearer is held in the solve of the sheets (cloth_implicit.h): it may go along the surface, and
// along its normal goes where the surface does. Who is held is found twice: before the pressures by
// the forces on the vertex alone, and again from the whole solve, where what pulls off is let go
// and what still comes too near is held. Beside fluid the whole solve of shells comes before the
// pressures, under the last ones; after them nothing is let go (Settling). Between two vertices, e
// apart, a surface of radius R comes e^2 / 8R nearer: triangle_obstacles.h is for shells, nothing
// for springs. The force that holds a vertex is in the solve, and so is Coulomb's friction, in the
// same rounds: a vertex that it can hold sticks, one that it cannot feels it as a force. To shells
// what sticks is a stiffness across the normal
// (docs/decisions/0031-friction-holds-shells-by-a-stiffness.md). Last comes the guard that
// particles have: no path passes through a surface, whatever the solve says.

#include "sim/passes/cloth/cloth_implicit.h"
#include "sim/passes/coupling/polygon_grid.h"
#include "sim/passes/obstacle/obstacle_path.h"

namespace drench::sim::DRENCH_BACKEND {

/// What holds vertices at obstacles reads.
struct ClothHold {
  ObstacleViews obstacles;
  ClothWalls walls;
  const float* half_thickness;
  const int *fan_start, *fan_entry;
  VecView free, normal;
  BlockInverse block, free_block;
  const float *inertia, *shell_area;  // the second null without shells
  int* grip;
  StopSums stopped;
  float room;                      // m, between sheet and surface beyond what particles keep
  float inverse_dt, inverse_mass;  // 1/s, of a particle, 1/kg
  Vec3<float> low, period;         // m; 0 where an axis is not periodic
  bool shares;                     // shells share the room between two obstacles

  /// What takes a vertex, which nothing wraps, into the domain, where the images of obstacles are.
  /// Paths take that of their start. m
  DRENCH_HD Vec3<float> home(Vec3<float> x) const {
    const auto along = [](float x, float low, float length) {
      return length > 0.f ? -length * floorf((x - low) / length) : 0.f;
    };
    return {along(x.x, low.x, period.x), along(x.y, low.y, period.y), along(x.z, low.z, period.z)};
  }
  DRENCH_HD bool is_shell(int vertex) const {
    return shell_area && shell_area[fan_entry[fan_start[vertex]] / 3] > 0.f;
  }
  /// The block of the directions that are free, with a stiffness across the normal.
  DRENCH_HD void put_block(int vertex, float stiffness) const {
    const float more[6] = {stiffness, 0.f, 0.f, stiffness, 0.f, stiffness};
    free_block.copy(vertex, block);
    free_block.add(vertex, more, inertia[vertex]);
    free_block.put_free(vertex, free_block, free[vertex], normal[vertex], inertia[vertex]);
  }
  /// m, of a vertex to a surface: as to a wall of the domain, and half the thickness.
  DRENCH_HD float distance_to(const ObstacleView& o, int vertex) const {
    return o.clearance + room + half_thickness[fan_entry[fan_start[vertex]] / 3];
  }

  /// What a point that is to keep a distance from obstacle k keeps where another stands on its far
  /// side, nearer than the same: half of what there is between them, less a little, or they would
  /// throw it to and fro. m
  /// @param x  at home
  DRENCH_HD_CALL float shared(int k, float keep, Vec3<float> x) const {
    const ObstacleView& o = obstacles.obstacle[k];
    const Vec3<float> own = o.to_own(1, x);
    const float distance = o.distance(own, o.blend[1]), full = keep;
    for (int j = 0; j < obstacles.count; ++j) {
      const ObstacleView& other = obstacles.obstacle[j];
      if (j == k || !other.near_path(x, x, 2.f * full)) continue;
      const Vec3<float> there = other.to_own(1, x);
      const float both = distance + other.distance(there, other.blend[1]);
      if (0.49f * both >= keep) continue;
      const Vec3<float> n = o.turn(1, o.normal(own, o.blend[1])),
                        away = other.turn(1, other.normal(there, other.blend[1]));
      if (dot(n, away) < -0.5f) keep = maximum(0.49f * both, 0.02f * full);
    }
    return keep;
  }

  /// Where the first obstacle stops a vertex that would go from x0 to x1, both at home; -1 if none
  /// does.
  /// @param slack  fraction of the distance that may be missing
  DRENCH_HD int stop(int vertex, Vec3<float> x0, Vec3<float> x1, float slack,
                     Vec3<float>& own) const {
    for (int k = 0; k < obstacles.count; ++k) {
      const ObstacleView& o = obstacles.obstacle[k];
      float keep = distance_to(o, vertex);
      if (shares && o.near_path(x0, x1, keep) && is_shell(vertex)) keep = shared(k, keep, x0);
      if (PathStop{0, (1.f - slack) * keep, keep}.stops(o, x0, x1, own)) return k;
    }
    return -1;
  }

  /// Holds a vertex, which `straight` is the straight path of, where an obstacle stops it from
  /// going to `to`.
  DRENCH_HD bool hold(int vertex, Vec3<float> from, Vec3<float> straight, Vec3<float> to,
                      Vec3<float>& w) const {
    Vec3<float> own;
    const Vec3<float> in = home(from);
    const int k = stop(vertex, from + in, to + in, 0.f, own);
    if (k < 0) return false;
    const ObstacleView& o = obstacles.obstacle[k];
    const Vec3<float> n = o.turn(1, o.normal(own, o.blend[1])), open = along(free[vertex], n);
    const float size2 = length2(open);
    if (size2 < 0.01f) return false;  // a wall holds it along n
    const Vec3<float> normal_free = open * (1.f / sqrtf(size2));
    w = w + normal_free * (dot(n, o.to_frame(1, own) - in - straight - w) / dot(n, normal_free));
    normal.set(vertex, normal_free);
    free_block.put_free(vertex, block, free[vertex], normal_free, inertia[vertex]);
    grip[vertex] = k;
    return true;
  }

  /// The velocity that the surface has along its normal at x, which is at home, and the solid's own
  /// across it, m/s.
  DRENCH_HD Vec3<float> surface_velocity(const ObstacleView& o, Vec3<float> x,
                                         Vec3<float> n) const {
    const Vec3<float> own = o.to_own(1, x);
    const Vec3<float> carried = (x - o.to_frame(0, own)) * inverse_dt;
    const float grown = o.distance(own, o.blend[0]) - o.distance(own, o.blend[1]);
    return carried + n * (grown * inverse_dt);
  }

  /// @param given  kg m/s, to the vertex
  DRENCH_HD void react(int k, Vec3<float> given) const {
    stopped.add(obstacles.obstacle[k].of, given * -inverse_mass);
  }

  /// The last guard: where a vertex ends that would go from x0 to x1 with velocity u.
  DRENCH_HD void guard(int vertex, float mass, Vec3<float> x0, Vec3<float>& x1,
                       Vec3<float>& u) const {
    const Vec3<float> in = home(x0);
    for (int round = 0; round < 4; ++round) {
      Vec3<float> own, unused{0.f, 0.f, 0.f};
      const int k = stop(vertex, x0 + in, x1 + in, 0.02f, own);
      if (k < 0) return;
      const ObstacleView& o = obstacles.obstacle[k];
      const Vec3<float> n = o.turn(1, o.normal(own, o.blend[1]));
      const Vec3<float> out = o.to_frame(1, own);
      x1 = out - in;
      const float inward = dot(u - surface_velocity(o, out, n), n);
      if (inward < 0.f) {
        react(k, n * (-inward * mass));
        u = u - n * inward;
      }
      walls.stop(x1, unused);
    }
  }
};

inline ClothHold cloth_hold_of(State& state) {
  const ClothState& c = state.cloth;
  ClothSystem& s = state.cloth_system;
  const Parameters& p = state.parameters;
  return {.obstacles = state.obstacles.views(),
          .walls = cloth_walls_of(p),
          .half_thickness = c.half_thickness.data(),
          .fan_start = c.fan_start.data(),
          .fan_entry = c.fan_entry.data(),
          .free = s.free.view(),
          .normal = s.normal.view(),
          .block = block_inverse(state),
          .free_block = free_block_inverse(state),
          .inertia = s.inertia.data(),
          .shell_area = state.shell.any ? state.shell.area.data() : nullptr,
          .grip = s.grip.data(),
          .stopped = {state.obstacles.stopped.data()},
          .room = 0.15f * p.spacing,
          .inverse_dt = float(1 / state.dt),
          .inverse_mass = 1.f / p.particle_mass,
          .low = {p.low[0], p.low[1], p.low[2]},
          .period = periods_of(p),
          .shares = state.shell.any && state.obstacles.count > 1};
}

/// As hold_at_walls, whose axes it takes into account.
void hold_at_obstacles(State& state);

/// What a round of settle_contacts makes of one vertex. Forces in kg m, over dt^2.
struct HoldRevision {
  ClothHold hold;
  ConstVecView position, velocity, path;
  VecView change;
  ConstVecView given;
  VecView right, reaction, rub;
  float *slides, *cling;
  const float *mass, *inverse_mass;
  float dt;
  int round;
  bool lets_go;  // what pulls
  bool finds_friction;

  DRENCH_HD bool free_too_near(int i) const {
    const Vec3<float> straight = position[i] + path[i] * dt;
    Vec3<float> w = change[i];
    if (!hold.hold(i, position[i], straight, straight + w, w)) return false;
    change.set(i, w);
    return true;
  }
  DRENCH_HD bool let_go(int i) const {
    hold.grip[i] = -2, slides[i] = 1.f, cling[i] = 0.f;
    hold.normal.set(i, {0.f, 0.f, 0.f});
    hold.free_block.copy(i, hold.block);
    right.set(i, given[i]);
    return true;
  }
  /// The obstacle takes the vertex with it.
  DRENCH_HD bool stick(int i, const ObstacleView& o, Vec3<float> n) const {
    const Vec3<float> x = position[i], straight = x + path[i] * dt, w = change[i];
    const Vec3<float> in = hold.home(x), carried = o.to_frame(1, o.to_own(0, x + in)) - in;
    const Vec3<float> off = along(hold.free[i], carried - straight - w);
    slides[i] = 0.f;
    right.set(i, given[i]);
    change.set(i, w + off - n * dot(n, off));
    return true;
  }
  DRENCH_HD bool slide(int i, Vec3<float> friction) const {
    slides[i] = 1.f;
    rub.set(i, friction), right.set(i, given[i] + friction);
    return true;
  }

  /// Whether anything is to change.
  DRENCH_HD bool operator()(int i) const {
    const int k = hold.grip[i];
    if (k < 0) {
      // The guard would move a shell's vertex through the next layer.
      return (k == -1 || hold.is_shell(i)) && inverse_mass[i] > 0.f && free_too_near(i);
    }
    const ObstacleView& o = hold.obstacles.obstacle[k];
    const Vec3<float> n = hold.normal[i], all = reaction[i];
    const float normal = dot(n, all), most = o.friction * normal;
    if (normal < 0.f) return lets_go && let_go(i);
    if (!finds_friction) return false;
    if (o.friction == 0.f) return round == 0;
    const Vec3<float> straight = position[i] + path[i] * dt;
    const Vec3<float> solid = hold.surface_velocity(o, straight + hold.home(position[i]), n);
    if (hold.is_shell(i)) return rubs(i, o, n, all, solid, most);
    if (round == 0) {  // hold what is slow enough for friction to stop it
      const Vec3<float> slip = across(velocity[i] - solid, n);
      const float size = length(slip);
      if (size * mass[i] * dt <= most) return stick(i, o, n);
      return slide(i, slip * (-most / size));
    }
    if (slides[i] == 0.f) {
      const Vec3<float> pull = across(all, n);
      const float size = length(pull);
      return size > most && slide(i, pull * (most / size));
    }
    const Vec3<float> slip = across(velocity[i] + change[i] * (1.f / dt) - solid, n);
    const float now = length(rub[i]);
    if (round < 3 && dot(slip, rub[i]) > 0.f) return stick(i, o, n);
    return fabsf(now - most) > 0.02f * most && now > 0.f && slide(i, rub[i] * (most / now));
  }
  /// Of shells, as pairs of sheets rub (RowRevision::rubs).
  DRENCH_HD bool rubs(int i, const ObstacleView& o, Vec3<float> n, Vec3<float> all,
                      Vec3<float> solid, float most) const {
    if (cling[i] > 0.f) {
      const Vec3<float> pull = across(all, n);
      const float size = length(pull);
      return size > most && rub_by(i, pull * (most / size), 0.f);
    }
    const float now = length(rub[i]);
    if (now == 0.f) {
      const Vec3<float> slip = across(velocity[i] - solid, n);
      const float size = length(slip);
      return size * mass[i] * dt <= most ? clings(i, o, n) : rub_by(i, slip * (-most / size), 0.f);
    }
    const Vec3<float> slip = across(velocity[i] + change[i] * (1.f / dt) - solid, n);
    if (round < 3 && dot(slip, rub[i]) > 0.f) return clings(i, o, n);
    return fabsf(now - most) > 0.02f * most && rub_by(i, rub[i] * (most / now), 0.f);
  }
  /// The obstacle takes the vertex with it, but for what its friction gives way.
  DRENCH_HD bool clings(int i, const ObstacleView& o, Vec3<float> n) const {
    const Vec3<float> x = position[i], in = hold.home(x),
                      carried = o.to_frame(1, o.to_own(0, x + in)) - in;
    const float stiffness = row_grip * mass[i];
    return rub_by(i, across(carried - x - path[i] * dt, n) * stiffness, stiffness);
  }
  DRENCH_HD bool rub_by(int i, Vec3<float> friction, float stiffness) const {
    if (stiffness != cling[i]) hold.put_block(i, stiffness);
    cling[i] = stiffness;
    rub.set(i, friction), right.set(i, given[i] + friction);
    return true;
  }
  DRENCH_HD static Vec3<float> across(Vec3<float> v, Vec3<float> n) { return v - n * dot(v, n); }
};

/// Tolerances of the first solve of a step, and of those after contacts changed.
struct ContactTolerances {
  float first, between;
};

/// Whether an obstacle, another piece of a sheet or a wall holds anything.
bool anything_is_met(const State& state);

/// Solves for the sheets, with friction and with other vertices and pairs of sheets held
/// (self_contact.h) until these are the right ones, or nearly. Whether any of that changed.
bool settle_contacts(State& state, const ConstVecView& given, int most_iterations,
                     const ContactTolerances& tolerance, const Settling& settling);

/// What obstacles make of the step's end in ClothState::next: the surface's velocity, the guard,
/// and their own impulse.
void finish_at_obstacles(State& state, const ConstVecView& given);

/// Continuous collision detection has stopped vertices where they were: obstacles carry them on.
void carry_held_vertices(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
