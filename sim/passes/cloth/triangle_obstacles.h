#pragma once
// Triangles of shells at obstacles. Vertices are held at them (cloth_obstacles.h); between these a
// corner, an edge, a thin rod or a small ball could come through. Where an obstacle is nearest to a
// point inside a triangle or a side (triangle_distance.h), and the step could bring them nearer
// than half the thickness and what particles keep from the obstacle, the point has a row in the
// sheets' system, as pairs of sheets have (self_contact.h), whose other side moves as the surface
// does. Vertices keep more (ClothHold::room): rows are for what sags between them. A row that bears
// a load it cannot hold with the stiffness of a pair of sheets becomes stiffer in the same rounds.
// The normal is that of the start of the step: a convex body stays behind its tangent plane. No
// point is nearer to a plane than a corner, and triangles with a pinned corner in an obstacle take
// no part there. Between two obstacles the room there is is shared (ClothHold::shared).
//
// The guard advances triangles along their paths in the obstacle's frame by what the least distance
// allows, and stops their vertices before any point is nearer than half the thickness.

#include "sim/passes/cloth/cloth_obstacles.h"
#include "sim/passes/cloth/triangle_distance.h"

namespace drench::sim::DRENCH_BACKEND {

/// Ways of a triangle's corners past an obstacle, in the obstacle's own frame.
struct TrianglePaths {
  Vec3<float> from[3], to[3];
  float approach;  // m, at most

  DRENCH_HD TriangleAtObstacle at(const ObstacleView& o, float t) const {
    TriangleAtObstacle now{};
    now.obstacle = &o, now.mix = o.blend[0] + t * (o.blend[1] - o.blend[0]);
    for (int c = 0; c < 3; ++c) now.x[c] = from[c] + (to[c] - from[c]) * t;
    now.size =
        square_root(maximum(length2(now.x[1] - now.x[0]),
                            maximum(length2(now.x[2] - now.x[1]), length2(now.x[0] - now.x[2]))));
    return now;
  }
};

/// What pairs of triangles and obstacles read.
struct TrianglePieces {
  ClothHold hold;
  Corners corners;
  ConstVecView position;
  const float *area, *half_thickness, *inverse_mass;
  float slack;  // m, see SelfContact

  DRENCH_HD const ObstacleView& obstacle(int k) const { return hold.obstacles.obstacle[k]; }
  /// m, of a point between vertices.
  DRENCH_HD float distance_to(const ObstacleView& o, int triangle) const {
    return o.clearance + half_thickness[triangle];
  }
  DRENCH_HD TrianglePaths paths(const ObstacleView& o, int triangle,
                                const ConstVecView& ends) const {
    TrianglePaths p;
    const Vec3<float> in = hold.home(corners.at(position, 3 * triangle));
    float most2 = 0.f;
    for (int c = 0; c < 3; ++c) {
      p.from[c] = o.to_own(0, corners.at(position, 3 * triangle + c) + in);
      p.to[c] = o.to_own(1, corners.at(ends, 3 * triangle + c) + in);
      most2 = maximum(most2, length2(p.to[c] - p.from[c]));
    }
    p.approach = square_root(most2) + o.deform * fabsf(o.blend[1] - o.blend[0]);
    return p;
  }
};

inline TrianglePieces triangle_pieces_of(State& state) {
  const ClothState& c = state.cloth;
  return {.hold = cloth_hold_of(state),
          .corners = corners_of(c),
          .position = c.position.view(),
          .area = state.shell.area.data(),
          .half_thickness = c.half_thickness.data(),
          .inverse_mass = c.inverse_mass.data(),
          .slack = state.self_contact.slack};
}

/// What never changes about triangles at obstacles.
void load_triangle_obstacles(State& state, const ClothTopology& cloth);

/// Fills TriangleObstacles::pair and ::touch for paths from the positions to SelfContact::to.
void find_triangles_at_obstacles(State& state);

/// Makes the rows of TriangleObstacles::touch from `first` on.
void put_touch_rows(State& state, int first);

/// Adds what the rows gave to the sheets to the obstacles' sums.
void react_to_touch_rows(State& state);

/// How many pairs' paths to ClothState::next are not safe; up to where they are is in
/// TriangleObstacles::stop.
int count_unsafe_triangles(State& state);

/// What stops a vertex at obstacles: see self_contact_guard.cpp.
struct TriangleStops {
  ClothHold hold;
  const TrianglePair* pair;
  const int *first, *count, *fan_start, *fan_entry;
  const float *stop, *inverse_mass;
  int* carrier;
  bool any;

  struct Stop {
    float part = 2.f;
    int obstacle = -1;
  };
  DRENCH_HD Stop operator()(int v) const {
    Stop least;
    if (!any || inverse_mass[v] == 0.f) return least;
    for (int e = fan_start[v]; e < fan_start[v + 1]; ++e) {
      const int t = fan_entry[e] / 3;
      for (int n = 0; n < count[t]; ++n) {
        const int k = first[t] + n;
        if (stop[k] < least.part) least = {stop[k], pair[k].obstacle};
      }
    }
    return least;
  }
  /// How far an obstacle takes what stays where it is on it, m.
  DRENCH_HD Vec3<float> carried(int obstacle, Vec3<float> x) const {
    const ObstacleView& o = hold.obstacles.obstacle[obstacle];
    const Vec3<float> own = o.to_own(0, x + hold.home(x));
    return o.to_frame(1, own) - o.to_frame(0, own);
  }
};

inline TriangleStops triangle_stops_of(State& state) {
  TriangleObstacles& s = state.triangle_obstacles;
  if (!s.any) return {};
  return {.hold = cloth_hold_of(state),
          .pair = s.pair.data(),
          .first = s.first.data(),
          .count = s.count.data(),
          .fan_start = state.cloth.fan_start.data(),
          .fan_entry = state.cloth.fan_entry.data(),
          .stop = s.stop.data(),
          .inverse_mass = state.cloth.inverse_mass.data(),
          .carrier = s.carrier.data(),
          .any = true};
}

}  // namespace drench::sim::DRENCH_BACKEND
