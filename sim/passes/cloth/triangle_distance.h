#pragma once
// Points of a triangle that an obstacle is nearest to: least signed distances over its sides and
// its inside, by local optimisation (Macklin et al. 2020): golden sections along sides, and inside
// of them down the projected gradient, the best point of each line. Exact for spheres. The distance
// to a convex body is a convex function, which has no other least point; where it is not, samples
// along the sides say where to look.

#include "sim/passes/coupling/geometry.h"
#include "sim/passes/obstacle/obstacle_distance.h"

namespace drench::sim::DRENCH_BACKEND {

struct PointOnTriangle {
  float weight[3];
  float distance;  // m
};

struct PointOnLine {
  float at, distance;  // fraction of the way; m
};

/// The least f(at) in an interval where f falls and then rises, if below that of `best`. A loop
/// with one call, because a distance is long.
template <class F>
DRENCH_HD PointOnLine golden_section(const F& f, float low, float high, PointOnLine best) {
  constexpr float ratio = 0.618034f;
  float a = high - ratio * (high - low), b = low + ratio * (high - low), fa = 0.f, fb = 0.f;
  bool first = true;  // of the two points is the new one
  for (int k = 0; k < 16; ++k) {
    const float at = first ? a : b, distance = f(at);
    (first ? fa : fb) = distance;
    if (distance < best.distance) best = {at, distance};
    first = k > 0 && fa <= fb;
    if (k == 0) continue;
    if (first) {
      high = b, b = a, fb = fa, a = high - ratio * (high - low);
    } else {
      low = a, a = b, fa = fb, b = low + ratio * (high - low);
    }
  }
  return best;
}

/// A triangle in the obstacle's own frame.
struct TriangleAtObstacle {
  const ObstacleView* obstacle;
  float mix;         // see ObstacleView::distance
  Vec3<float> x[3];  // m
  float size;        // m, about the longest side

  DRENCH_HD float distance(Vec3<float> p) const { return obstacle->distance(p, mix); }
  DRENCH_HD Vec3<float> at(const float (&w)[3]) const {
    return x[0] * w[0] + x[1] * w[1] + x[2] * w[2];
  }

  /// Of the side from a to b, which have the distances da, db; `at` is 0 or 1 where an end is.
  DRENCH_HD_CALL PointOnLine on_side(Vec3<float> a, Vec3<float> b, float da, float db) const {
    const Vec3<float> way = b - a;
    PointOnLine best = da <= db ? PointOnLine{0.f, da} : PointOnLine{1.f, db};
    if (obstacle->shape == ObstacleShape::sphere) {
      const float u = -dot(a, way) / maximum(length2(way), 1e-30f);
      return u > 0.f && u < 1.f ? PointOnLine{u, distance(a + way * u)} : best;
    }
    const auto along = [&](float u) { return distance(a + way * u); };
    constexpr int parts = 6;
    int nearest = best.at == 0.f ? 0 : parts;
    for (int k = 1; k < parts; ++k) {
      const PointOnLine sample{float(k) / parts, along(float(k) / parts)};
      if (sample.distance < best.distance) best = sample, nearest = k;
    }
    return golden_section(along, max0(float(nearest - 1) / parts),
                          minimum(float(nearest + 1) / parts, 1.f), best);
  }

  /// Down from a point to the least one near by.
  DRENCH_HD_CALL PointOnTriangle down_from(PointOnTriangle best) const {
    if (obstacle->shape == ObstacleShape::sphere) {
      const ClosestPoint<float> c = closest_point({0.f, 0.f, 0.f}, x[0], x[1], x[2]);
      const float w[3] = {c.wa, c.wb, c.wc};
      return {{c.wa, c.wb, c.wc}, distance(at(w))};
    }
    for (int k = 0; k < 6; ++k) {
      const Vec3<float> p = at(best.weight), n = obstacle->normal(p, mix);
      const ClosestPoint<float> c =
          closest_point(p - n * (k % 2 == 0 ? 4.f * size : size), x[0], x[1], x[2]);
      const float way[3] = {c.wa - best.weight[0], c.wb - best.weight[1], c.wc - best.weight[2]};
      if (fabsf(way[0]) + fabsf(way[1]) + fabsf(way[2]) < 1e-3f) break;
      const PointOnLine low = golden_section(
          [&](float u) {
            const float w[3] = {best.weight[0] + u * way[0], best.weight[1] + u * way[1],
                                best.weight[2] + u * way[2]};
            return distance(at(w));
          },
          0.f, 1.f, {0.f, best.distance});
      if (!(low.distance < best.distance - 1e-6f * size)) break;
      for (int c = 0; c < 3; ++c) best.weight[c] += low.at * way[c];
      best.distance = low.distance;
    }
    return best;
  }
};

/// The least distances of the corners, the sides 01, 12, 20 and all of a triangle.
struct TriangleLeast {
  float corner[3];
  PointOnLine side[3];
  PointOnTriangle all;

  DRENCH_HD explicit TriangleLeast(const TriangleAtObstacle& t) {
    for (int c = 0; c < 3; ++c) corner[c] = t.distance(t.x[c]);
    constexpr float third = 1.f / 3.f;
    all = {{third, third, third}, t.distance((t.x[0] + t.x[1] + t.x[2]) * third)};
    for (int c = 0; c < 3; ++c) {
      const int d = c == 2 ? 0 : c + 1;
      side[c] = t.on_side(t.x[c], t.x[d], corner[c], corner[d]);
      if (!(side[c].distance < all.distance)) continue;
      all.distance = side[c].distance;
      all.weight[0] = all.weight[1] = all.weight[2] = 0.f;
      all.weight[c] = 1.f - side[c].at, all.weight[d] = side[c].at;
    }
    all = t.down_from(all);
  }
  /// Whether it lies between the ends of a side, lower than these.
  DRENCH_HD bool on_side(int c, float tiny) const {
    return side[c].distance < minimum(corner[c], corner[c == 2 ? 0 : c + 1]) - tiny;
  }
  /// Whether it lies inside, lower than all sides.
  DRENCH_HD bool inside(float tiny) const {
    return all.distance <
           minimum(side[0].distance, minimum(side[1].distance, side[2].distance)) - tiny;
  }
};

}  // namespace drench::sim::DRENCH_BACKEND
