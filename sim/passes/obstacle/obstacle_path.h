#pragma once
// How far a point gets that moves beside an obstacle which moves at the same time. The path is
// followed in the obstacle's own frame, where only the point moves, by conservative advancement:
// the distance says how far it may go. Where it comes too near it slides on along the surface.

#include "sim/passes/motion/mover.h"

namespace drench::sim::DRENCH_BACKEND {

/// A path in the obstacle's frame; mix is how far its shape has come.
struct ObstaclePath {
  Vec3<float> from, to;
  float from_mix, to_mix;
  DRENCH_HD Vec3<float> at(float t) const { return from + (to - from) * t; }
  DRENCH_HD float mix(float t) const { return from_mix + (to_mix - from_mix) * t; }
  /// No distance changes by more along it, m.
  DRENCH_HD float length(const ObstacleView& o) const {
    return sqrtf(length2(to - from)) + o.deform * fabsf(to_mix - from_mix);
  }
};

struct PathStop {
  int start;        // where paths start: 0 with the obstacle at the step's start, 1 its end
  float clearance;  // m, no path ends nearer
  float out;        // m, where to one that does is moved

  /// Fraction of the path at which it comes within a quarter of the clearance; 2 if it never does.
  DRENCH_HD float first_hit(const ObstacleView& o, const ObstaclePath& path) const {
    const float length = path.length(o), least = 0.25f * clearance;
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
    for (int k = 0;; ++k) {
      const float d = o.distance(own, mix);
      if (k == 8 || !(d < clearance)) return d >= 0.5f * clearance;
      own = own + o.normal(own, mix) * (out - d);
    }
  }

  /// Where a path may end. False: it may as it is.
  DRENCH_HD bool stops(const ObstacleView& o, Vec3<float> x0, Vec3<float> x1,
                       Vec3<float>& own) const {
    if (!o.near_path(x0, x1, clearance)) return false;
    const ObstaclePath path{o.to_own(start, x0), o.to_own(1, x1), o.blend[start], o.blend[1]};
    own = path.to;
    const float d = o.distance(own, o.blend[1]);
    if (d >= clearance && d > path.length(o)) return false;
    const float t = first_hit(o, path);
    if (t > 1.f && d >= clearance) return false;
    if (t <= 1.f) {
      const Vec3<float> met = path.at(t), rest = path.to - met, n = o.normal(met, path.mix(t));
      const float inward = dot(rest, n);
      own = met + n * (0.5f * clearance);
      const ObstaclePath slide{own, own + rest - n * (inward < 0.f ? inward : 0.f), o.blend[1],
                               o.blend[1]};
      if (first_hit(o, slide) > 1.f) own = slide.to;
    }
    if (push_out(o, own)) return true;
    own = path.from;  // as the obstacle carries it along
    push_out(o, own);
    return true;
  }
};

/// The velocity that the surface has at a point along its normal, both at the step's end, m/s.
DRENCH_HD float surface_speed(const ObstacleView& o, Vec3<float> own, Vec3<float> n,
                              float inverse_dt) {
  const float carried = dot(o.to_frame(1, own) - o.to_frame(0, own), n);
  const float grown = o.distance(own, o.blend[0]) - o.distance(own, o.blend[1]);
  return (carried + grown) * inverse_dt;
}

/// Sums over what an obstacle stops: 4 an obstacle, velocity taken from particles and how many.
struct StopSums {
  static constexpr double unit = 1 << 30;  // of the velocities, in 1 m/s
  long long* sum;

  /// @param taken  m/s, as of a particle.
  DRENCH_HD void add(int k, Vec3<float> taken) const {
    add_atomic(sum + 4 * k, static_cast<long long>(taken.x * unit));
    add_atomic(sum + 4 * k + 1, static_cast<long long>(taken.y * unit));
    add_atomic(sum + 4 * k + 2, static_cast<long long>(taken.z * unit));
  }
  DRENCH_HD void count(int k) const { add_atomic(sum + 4 * k + 3, 1); }
};

/// The last guard at obstacles: no particle ends a step nearer than a clearance, and none passes
/// through what is thinner than its path. What it stops takes on the surface's normal velocity.
struct ObstacleGuard {
  ObstacleViews obstacles;
  Mover walls, ends;  // paths go on beyond a seam, where images are; `ends` wraps what ends there
  float inverse_dt;
  int start;  // see PathStop
  StopSums stopped;

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
    return ends.wrapped((*this)(x, to, v));
  }

  /// Where a particle ends that would go from x0 to x1, and what becomes of its velocity.
  DRENCH_HD Vec3<float> operator()(Vec3<float> x0, Vec3<float> x1, Vec3<float>& v) const {
    bool met = true;
    for (int round = 0; met && round < 4; ++round) {
      met = false;
      for (int k = 0; k < obstacles.count; ++k) {
        const ObstacleView& o = obstacles.obstacle[k];
        Vec3<float> own;
        if (!PathStop{start, o.clearance, 1.01f * o.clearance}.stops(o, x0, x1, own)) continue;
        met = true;
        x1 = o.to_frame(1, own);
        const Vec3<float> n = o.turn(1, o.normal(own, o.blend[1]));
        const float inward = dot(v, n) - (start == 1 ? 0.f : surface_speed(o, own, n, inverse_dt));
        if (inward < 0.f) stopped.add(o.of, n * inward);
        stopped.count(o.of);
        if (inward < 0.f) v = v - n * inward;
        x1 = walls.inside(x1);
      }
    }
    // Squeezed between obstacles or against a wall: the better of both positions.
    if (met && worst(x1) < 0.f && worst(walls.inside(x0)) > worst(x1)) x1 = walls.inside(x0);
    return x1;
  }
};

/// @param start  see PathStop.
inline ObstacleGuard obstacle_guard_of(State& state, int start) {
  const float dt = float(state.dt);
  const bool goes_on = start == 1 && state.cloth.vertices > 0;  // see project_density
  return {.obstacles = state.obstacles.views(),
          .walls = path_mover_of(state.parameters, dt),
          .ends = goes_on ? path_mover_of(state.parameters, dt) : mover_of(state.parameters, dt),
          .inverse_dt = 1.f / dt,
          .start = start,
          .stopped = {state.obstacles.stopped.data()}};
}

}  // namespace drench::sim::DRENCH_BACKEND
