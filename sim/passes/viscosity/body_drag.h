#pragma once
// What obstacles and sheets brake the fluid by where it does not slip along them: as a wall of the
// domain does (viscosity_rows.h), whose velocity is theirs at the foot of the particle's
// perpendicular. A body that fills less of what lies beyond its tangent plane brakes less: by the
// fraction of the half-space's integral of the kernel that it fills, with the closed forms of
// obstacle_density.h; by its square along what is curved, as what lies beside the perpendicular
// weighs most there. Against the integral over a ball of 3 spacings this is
// up to 13 % off, at a box's edge 29 % (tests/sim/body_drag_test.cpp). Walls and obstacles behind a
// sheet are not seen through it.
//
// Of all these a particle has one block of the viscous matrix. That of a sheet acts on both: rows
// of the near list keep its rates for viscosity_cloth.h.

#include "sim/passes/obstacle/obstacle_impulse.h"
#include "sim/passes/viscosity/viscosity_rows.h"

namespace drench::sim::DRENCH_BACKEND {

/// What brakes along a surface and across it, 1; times its velocity, m/s.
DRENCH_HD void add_surface(WallDrag& drag, float along, float across, Vec3<float> n,
                           Vec3<float> velocity) {
  const float more = across - along;
  const WallDrag one{{along + more * n.x * n.x, along + more * n.y * n.y, along + more * n.z * n.z},
                     {more * n.x * n.y, more * n.y * n.z, more * n.z * n.x},
                     {}};
  drag.rate = drag.rate + one.rate, drag.cross = drag.cross + one.cross;
  drag.source = drag.source + one.times(velocity);
}

/// What a particle sees of a sheet that it is beside: nothing, with a normal of zero.
struct BesideCloth {
  Vec3<float> normal{0.f, 0.f, 0.f};
  float gap = 0.f;  // m
};

/// The law of what brakes within a step.
struct BodyDrag {
  NoSlipWalls walls;
  ImageWalls image;
  ObstacleViews obstacles;
  float support_radius, inverse_dt;  // m, 1/s

  /// Over the support radius.
  DRENCH_HD float relative_distance(float distance) const {
    return maximum(distance * walls.inverse_h, walls.least);
  }
  DRENCH_HD float along(float distance) const {
    const float q = relative_distance(distance);
    return q < 1.f ? walls.strength * ViscousWeight::wall_along(q) : 0.f;
  }
  DRENCH_HD float across(float distance) const {
    const float q = relative_distance(distance);
    return q < 1.f ? walls.strength * ViscousWeight::wall_across(q) : 0.f;
  }

  DRENCH_HD static float curvature(const ObstacleView& o, Vec3<float> own, float distance) {
    if (o.shape == ObstacleShape::sphere) return 1.f / (distance + o.half[0]);
    if (o.shape != ObstacleShape::field) return 0.f;
    const float mix = o.blend[1], e = o.field[0].voxel;
    const float sum =
        o.distance({own.x - e, own.y, own.z}, mix) + o.distance({own.x + e, own.y, own.z}, mix) +
        o.distance({own.x, own.y - e, own.z}, mix) + o.distance({own.x, own.y + e, own.z}, mix) +
        o.distance({own.x, own.y, own.z - e}, mix) + o.distance({own.x, own.y, own.z + e}, mix);
    return 0.5f * (sum - 6.f * distance) / (e * e);
  }
  /// How much of the half-space beyond its tangent plane an obstacle fills, by the kernel.
  DRENCH_HD float filled(const ObstacleView& o, Vec3<float> own, float distance) const {
    const float D = maximum(distance, 0.f) * walls.inverse_h, H = WendlandC2::halfspace(D);
    if (!(H > 1e-6f)) return 0.f;
    if (o.shape == ObstacleShape::box) {
      const BoxDistance to(own, o.half);
      float fill = 1.f / H;
      for (int k = 0; k < 3; ++k) fill *= WendlandC2::halfspace(to.beyond[k] * walls.inverse_h);
      return minimum(fill, 1.f);
    }
    const float k = maximum(minimum(curvature(o, own, distance) * support_radius, 2.f), -2.f);
    return maximum(minimum(1.f - k * D - 0.5f * k * WendlandC2::moment(D) / H, 2.f), 0.f);
  }

  /// m/s, of the surface at a place on it that is `own` at the end of the step.
  DRENCH_HD Vec3<float> velocity(const ObstacleView& o, Vec3<float> own, Vec3<float> n) const {
    const Vec3<float> turned = o.turn(1, own) - o.turn(0, own),
                      moved{o.centre[1][0] - o.centre[0][0], o.centre[1][1] - o.centre[0][1],
                            o.centre[1][2] - o.centre[0][2]};
    const float grown =
        o.deform > 0.f ? o.distance(own, o.blend[0]) - o.distance(own, o.blend[1]) : 0.f;
    return (moved + turned + n * grown) * inverse_dt;
  }

  DRENCH_HD void add_obstacle(const ObstacleView& o, Vec3<float> x, const BesideCloth& sheet,
                              WallDrag& drag) const {
    if (o.no_slip == 0.f || !o.near_path(x, x, support_radius)) return;
    const Vec3<float> own = o.to_own(1, x);
    const float d = o.distance(own, o.blend[1]);
    if (!(d < support_radius)) return;
    const Vec3<float> own_normal = o.normal(own, o.blend[1]), n = o.turn(1, own_normal);
    const float fill = filled(o, own, d), less = o.shape == ObstacleShape::box ? 1.f : fill;
    const float fraction =
        image.seen(d * dot(n, sheet.normal) - sheet.gap) * fill * length2(own_normal);
    add_surface(drag, fraction * less * along(d), fraction * across(d), n,
                velocity(o, own - own_normal * d, n));
  }

  /// All but the sheet.
  DRENCH_HD WallDrag of(Vec3<float> place, const BesideCloth& sheet) const {
    const float x[3] = {place.x, place.y, place.z},
                n[3] = {sheet.normal.x, sheet.normal.y, sheet.normal.z};
    WallDrag drag{};
    for (int k = 0; k < 3; ++k) {
      if (!walls.on[k]) continue;
      const Vec3<float> up{float(k == 0), float(k == 1), float(k == 2)};
      const float distance[2] = {x[k] - walls.low[k], walls.high[k] - x[k]};
      for (int end = 0; end < 2; ++end) {
        const float d = distance[end], facing = end == 0 ? n[k] : -n[k];
        const float fraction = image.seen(d * facing - sheet.gap);
        const float* v = walls.velocity[k][end];
        add_surface(drag, fraction * along(d), fraction * across(d), up, {v[0], v[1], v[2]});
      }
    }
    for (int k = 0; k < obstacles.count; ++k)
      add_obstacle(obstacles.obstacle[k], place, sheet, drag);
    return drag;
  }
};

inline BodyDrag body_drag_of(const State& state) {
  const Parameters& p = state.parameters;
  return {no_slip_walls_of(p, viscous_strength(p, state.dt)), image_walls_of(p),
          state.obstacles.views(), p.support_radius, float(1 / state.dt)};
}

/// Particles by their rows: the gap to the sheet at the predicted places, as the pressure has it.
struct ClothGaps {
  ClothRows rows;
  ConstVecView start, normal, cloth_velocity;
  const float *distance, *edge, *half_thickness;
  const int* triangle;
  float dt;  // s

  DRENCH_HD BesideCloth of(int row, Vec3<float> x) const {
    const int i = rows.particle[row];
    if (edge[i] <= 0.f) return {};
    const Vec3<float> n = normal[i], foot = rows.at_foot(row, cloth_velocity) * dt;
    return {n, distance[i] - half_thickness[triangle[i]] + dot(n, x - start[i] - foot)};
  }
};

/// Rates of the sheets' rows, along and across.
struct ClothRates {
  float *along, *across;
};

inline ClothRates cloth_rates(State& state) {
  return {state.contact.rate_along.data(), state.contact.rate_across.data()};
}

/// What brakes every particle in this step's viscosity.
void find_body_drag(State& state);

/// Velocities that the viscosity of the step that was made dragged by, m/s.
struct DraggedVelocity {
  const Float4* at;
  DRENCH_HD Impulse on(const WallDrag& drag, int i, double mass) const {
    const Vec3<float> pull = drag.times({at[i].x, at[i].y, at[i].z}) - drag.source;
    return {mass * pull.x, mass * pull.y, mass * pull.z};
  }
};

/// What viscosity gave to one obstacle, all images of it, in the step that was made, kg m/s.
Impulse drag_impulse(const State& state, int which);

}  // namespace drench::sim::DRENCH_BACKEND
