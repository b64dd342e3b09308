#pragma once
// The last guard at obstacles: no particle ends a step nearer than a clearance, and none passes
// through what is thinner than its path. The path is followed in the obstacle's own frame, where
// only the particle moves, by conservative advancement: the distance says how far it may go. Where
// it comes too near it slides on along the surface, and takes on the surface's normal velocity.
// Pressure stops particles about half a spacing off: the guard acts on what it has failed.

#include "sim/passes/incompressible.h"

namespace drench::sim::DRENCH_BACKEND {

struct ObstacleGuard {
  static constexpr double unit = 1 << 30;  // of the velocities in `stopped`, in 1 m/s

  ObstacleViews obstacles;
  Mover walls;
  float inverse_dt;
  int start;           // where the path starts: 0 with the obstacle at the step's start, 1 its end
  long long* stopped;  // 4 an obstacle: velocity taken, in units; particles

  /// A path in the obstacle's frame; mix is how far its shape has come.
  struct Path {
    Vec3<float> from, to;
    float from_mix, to_mix;
    DRENCH_HD Vec3<float> at(float t) const { return from + (to - from) * t; }
    DRENCH_HD float mix(float t) const { return from_mix + (to_mix - from_mix) * t; }
    /// No distance changes by more along it, m.
    DRENCH_HD float length(const ObstacleView& o) const {
      return sqrtf(length2(to - from)) + o.deform * fabsf(to_mix - from_mix);
    }
  };

  /// Share of the path where it comes within a quarter of the clearance; 2 if it never does.
  DRENCH_HD float first_hit(const ObstacleView& o, const Path& path) const {
    const float length = path.length(o), least = 0.25f * o.clearance;
    for (float t = 0.f; t <= 1.f;) {
      const float d = o.distance(path.at(t), path.mix(t));
      if (d < least) return t;
      if (d - least > (1.f - t) * length) return 2.f;
      t += maximum(d - least, 0.5f * least) / length;
    }
    return 2.f;
  }

  /// Moves a point out to the clearance. False if that fails: between two parts of the surface.
  DRENCH_HD bool push_out(const ObstacleView& o, Vec3<float>& own) const {
    const float mix = o.blend[1];
    float d = o.distance(own, mix);
    for (int k = 0; k < 8 && d < o.clearance; ++k) {
      own = own + o.normal(own, mix) * (1.01f * o.clearance - d);
      d = o.distance(own, mix);
    }
    return d >= 0.5f * o.clearance;
  }

  /// Where a path may end. False: it may as it is.
  DRENCH_HD bool stops(const ObstacleView& o, Vec3<float> x0, Vec3<float> x1,
                       Vec3<float>& own) const {
    if (!o.near_path(x0, x1, o.clearance)) return false;
    const Path path{o.to_own(start, x0), o.to_own(1, x1), o.blend[start], o.blend[1]};
    own = path.to;
    const float d = o.distance(own, o.blend[1]);
    if (d >= o.clearance && d > path.length(o)) return false;
    const float t = first_hit(o, path);
    if (t > 1.f && d >= o.clearance) return false;
    if (t <= 1.f) {
      const Vec3<float> met = path.at(t), rest = path.to - met, n = o.normal(met, path.mix(t));
      const float inward = dot(rest, n);
      own = met + n * (0.5f * o.clearance);
      const Path slide{own, own + rest - n * (inward < 0.f ? inward : 0.f), o.blend[1], o.blend[1]};
      if (first_hit(o, slide) > 1.f) own = slide.to;
    }
    if (push_out(o, own)) return true;
    own = path.from;  // as the obstacle carries it along
    push_out(o, own);
    return true;
  }

  /// The velocity that the surface has at a point along its normal, m/s.
  DRENCH_HD float surface_speed(const ObstacleView& o, Vec3<float> own, Vec3<float> n) const {
    if (start == 1) return 0.f;
    const float carried = dot(o.to_frame(1, own) - o.to_frame(0, own), n);
    const float grown = o.distance(own, o.blend[0]) - o.distance(own, o.blend[1]);
    return (carried + grown) * inverse_dt;
  }

  DRENCH_HD float worst(Vec3<float> x) const {
    float least = 1e30f;
    for (int k = 0; k < obstacles.count; ++k) {
      const ObstacleView& o = obstacles.obstacle[k];
      if (o.near_path(x, x, 0.f))
        least = minimum(least, o.distance(o.to_own(1, x), o.blend[1]) - 0.5f * o.clearance);
    }
    return least;
  }

  /// As a Mover, within the domain's walls too.
  DRENCH_HD Vec3<float> operator()(Vec3<float> x, Vec3<float>& v) const {
    const Vec3<float> to = walls(x, v);
    return (*this)(x, to, v);
  }

  /// Where a particle ends that would go from x0 to x1, and what becomes of its velocity.
  DRENCH_HD Vec3<float> operator()(Vec3<float> x0, Vec3<float> x1, Vec3<float>& v) const {
    bool met = true;
    for (int round = 0; met && round < 4; ++round) {
      met = false;
      for (int k = 0; k < obstacles.count; ++k) {
        const ObstacleView& o = obstacles.obstacle[k];
        Vec3<float> own;
        if (!stops(o, x0, x1, own)) continue;
        met = true;
        x1 = o.to_frame(1, own);
        const Vec3<float> n = o.turn(1, o.normal(own, o.blend[1]));
        const float inward = dot(v, n) - surface_speed(o, own, n);
        count(k, inward < 0.f ? n * inward : Vec3<float>{0.f, 0.f, 0.f});
        if (inward < 0.f) v = v - n * inward;
        x1 = walls.inside(x1);
      }
    }
    // Squeezed between obstacles or against a wall: the better of both places.
    if (met && worst(x1) < 0.f && worst(walls.inside(x0)) > worst(x1)) x1 = walls.inside(x0);
    return x1;
  }

  DRENCH_HD void count(int k, Vec3<float> taken) const {
    add_atomic(stopped + 4 * k, static_cast<long long>(taken.x * unit));
    add_atomic(stopped + 4 * k + 1, static_cast<long long>(taken.y * unit));
    add_atomic(stopped + 4 * k + 2, static_cast<long long>(taken.z * unit));
    add_atomic(stopped + 4 * k + 3, 1);
  }
};

/// @param start  see ObstacleGuard.
inline ObstacleGuard obstacle_guard_of(const State& state, int start) {
  const float dt = float(state.dt);
  return {state.obstacles.views(), mover_of(state.parameters, dt), 1.f / dt, start,
          state.obstacles.stopped.data()};
}

/// predict_particles with obstacles that move at the same time.
inline void predict_around_obstacles(State& state) {
  predict_with(state, obstacle_guard_of(state, 0));
}

/// project_density with obstacles where the step ends.
inline void project_around_obstacles(State& state) {
  project_with(state, obstacle_guard_of(state, 1));
}

}  // namespace drench::sim::DRENCH_BACKEND
