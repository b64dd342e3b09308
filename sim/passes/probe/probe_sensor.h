#pragma once
// Pressure sensors: a disc on a wall, an obstacle or a sheet measures what the fluid pushes there,
// over its area; a disc elsewhere the stress in the fluid. Both are of the forces that moved the
// particles, so that discs side by side sum to the force on what they cover.
//
// Inside the fluid a pair's force is what one particle exerts on the other along the line between
// them, and a body's along the perpendicular to its surface; the stress is that transferred through
// planes, the mean over planes with the disc's weight (bond functions: Hardy 1982; Murdoch 1983).
// At rest it balances the weight above every plane, between the last particles and a wall, too,
// where a sum over particles has only their layers (14 % off half a spacing before a wall).

#include "sim/passes/probe/probe_pressure.h"

namespace drench::sim::DRENCH_BACKEND {

/// The weight of a sensor: 1 on its disc, falling to 0 over a rim, because a particle's force is
/// spread over about a spacing.
struct SoftDisc {
  Vec3<float> centre, normal;
  float radius, rim;   // m; the weight falls from radius - rim to radius + rim
  Vec3<float> period;  // m; 0 where an axis is not periodic

  DRENCH_HD Vec3<float> from_centre(Vec3<float> p) const { return nearest(p - centre, period); }
  DRENCH_HD float across(Vec3<float> d) const {
    const Vec3<float> flat = d - normal * dot(d, normal);
    return minimum(max0((radius + rim - length(flat)) / (2.f * rim)), 1.f);
  }
  /// The mean weight along the line from d to d + along: the integral of the tent along the normal
  /// is exact, the position across is the line's middle.
  DRENCH_HD float bond(Vec3<float> d, Vec3<float> along) const {
    const float from = dot(d, normal) / rim, to = from + dot(along, normal) / rim;
    const float mean = fabsf(to - from) > 0.02f ? (below(to) - below(from)) / (to - from)
                                                : max0(1.f - fabsf(0.5f * (from + to)));
    return mean > 0.f ? mean * across(d + along * 0.5f) : 0.f;
  }
  /// Integral of the tent up to t.
  static DRENCH_HD float below(float t) {
    const float low = minimum(max0(1.f + t), 1.f), high = minimum(max0(1.f - t), 1.f);
    return t < 0.f ? 0.5f * low * low : 1.f - 0.5f * high * high;
  }
  /// Whether a line of length `most` from d may count.
  DRENCH_HD bool near(Vec3<float> d, float most) const {
    const float up = dot(d, normal), out = radius + rim + most;
    return fabsf(up) < rim + most && length2(d) - up * up < out * out;
  }
};

/// Points of a disc, or of layers of it, at the middles of equal cells.
struct DiscPoints {
  SoftDisc disc;
  Vec3<float> u, v;
  int layers, rings, spokes;

  DRENCH_HD int count() const { return layers * rings * spokes; }
  /// m, edge of a cell.
  DRENCH_HD float cell() const {
    const float ring = (disc.radius + disc.rim) / float(rings);
    return layers > 1 ? maximum(ring, 2.f * disc.rim / float(layers)) : ring;
  }
  DRENCH_HD Vec3<float> point(int k, float& weight) const {
    const int spoke = k % spokes, ring = k / spokes % rings, layer = k / (spokes * rings);
    const float edge = (disc.radius + disc.rim) / float(rings), r = edge * (float(ring) + 0.5f),
                angle = 2.f * pi * (float(spoke) + 0.5f) / float(spokes);
    const float t = layers > 1 ? 2.f * (float(layer) + 0.5f) / float(layers) - 1.f : 0.f;
    weight = minimum((disc.radius + disc.rim - r) / (2.f * disc.rim), 1.f) * 2.f * pi * r * edge /
             float(spokes);
    if (layers > 1) weight *= (1.f - fabsf(t)) * 2.f * disc.rim / float(layers);
    return disc.centre + u * (r * cosf(angle)) + v * (r * sinf(angle)) +
           disc.normal * (t * disc.rim);
  }
};

/// What a disc lies on.
struct SensorBody {
  enum Kind : int { none, wall, obstacle, sheet } kind = none;
  int axis = 0, side = 0;             // of a wall
  int of = -1;                        // obstacle or sheet
  Vec3<float> facing{0.f, 0.f, 0.f};  // unit, to the fluid that is measured
  Vec3<float> foot{0.f, 0.f, 0.f};    // m, on a sheet
  float distance = 1e30f;             // m, of the disc's centre from its surface
};
struct NearerBody {
  DRENCH_HD SensorBody operator()(const SensorBody& a, const SensorBody& b) const {
    return fabsf(b.distance) < fabsf(a.distance) ? b : a;
  }
};

struct ObstacleAt {
  ObstacleViews obstacles;
  Vec3<float> centre;
  int only;  // -1: any
  DRENCH_HD SensorBody operator()(int k) const {
    const ObstacleView& o = obstacles.obstacle[k];
    SensorBody body;
    if (only >= 0 && o.of != only) return body;
    const Vec3<float> own = o.to_own(1, centre);
    body.kind = SensorBody::obstacle, body.of = o.of;
    body.distance = o.distance(own, o.blend[1]);
    body.facing = o.turn(1, o.normal(own, o.blend[1]));
    return body;
  }
};

struct ClothAt {
  Corners corners;
  ConstVecView position;
  const float* half_thickness;
  const int* sheet;
  Vec3<float> centre, period;
  DRENCH_HD SensorBody operator()(int t) const {
    const Vec3<float> a = corners.at(position, 3 * t), b = corners.at(position, 3 * t + 1),
                      c = corners.at(position, 3 * t + 2), d = nearest(centre - a, period),
                      none{0.f, 0.f, 0.f}, n = cross(b - a, c - a);
    const auto foot = closest_point(d, none, b - a, c - a);
    const float size = length(n);
    SensorBody body;
    body.kind = SensorBody::sheet, body.of = sheet[t];
    body.distance = sqrtf(foot.distance2) - half_thickness[t];
    body.facing = n * (size > 0.f ? 1.f / size : 0.f);
    body.foot = centre - d + (b - a) * foot.wb + (c - a) * foot.wc;
    return body;
  }
};

/// What the fluid pushes onto a body through a disc on it, N.
struct SurfaceSensor {
  BodyParts parts;
  SoftDisc disc;
  SensorBody body;
  const int *triangle, *sheet;  // of particles, of triangles
  float reach;                  // m, how far from the disc's plane its surface may lie

  DRENCH_HD double push(const BodyPart& part, Vec3<float> from, int i) const {
    const float inward = -dot(part.gradient, body.facing);
    const Vec3<float> d = from + part.to_surface;
    if (!(inward > 0.f) || fabsf(dot(d, disc.normal)) > reach) return 0;
    return double(disc.across(d)) * parts.step.mass * parts.step.term[i] * inward;
  }
  DRENCH_HD Totals<1> operator()(int i, int row) const {
    if (parts.step.term[i] == 0.f) return {};
    const Beside b = parts.beside(i, row);
    const Vec3<float> from = disc.from_centre(b.x);
    const float up = dot(from, disc.normal), out = disc.radius + disc.rim + parts.step.h;
    if (length2(from) - up * up > out * out) return {};
    if (body.kind == SensorBody::wall)
      return {{push(parts.wall(i, b, body.axis, body.side), from, i)}};
    if (body.kind == SensorBody::sheet) {
      if (row < 0 || sheet[triangle[i]] != body.of) return {};
      return {{push(parts.sheet(b, row), from, i)}};
    }
    Totals<1> sum;
    for (int k = 0; k < parts.obstacles.count; ++k)
      if (parts.obstacles.obstacle[k].of == body.of)
        sum.value[0] += push(parts.obstacle(b, k), from, i);
    return sum;
  }
};

/// Where fluid may be: between the walls, outside obstacles, on one side of a sheet.
struct OpenSpace {
  ImageWalls walls;
  ObstacleViews obstacles;
  Vec3<float> cloth_normal, cloth_foot;  // a zero normal: no sheet
  float cell;                            // m, over which the open fraction of a point falls

  DRENCH_HD float step(float distance) const { return minimum(max0(0.5f + distance / cell), 1.f); }
  /// The fraction of a point's cell that is open. @param but  an axis, or an obstacle, left out.
  DRENCH_HD float open_fraction(Vec3<float> x, int but_axis, int but_obstacle) const {
    float open = 1.f;
    for (int k = 0; k < 3; ++k)
      if (walls.on[k] && k != but_axis)
        open *= step(component(x, k) - walls.low[k]) * step(walls.high[k] - component(x, k));
    for (int k = 0; k < obstacles.count; ++k) {
      const ObstacleView& o = obstacles.obstacle[k];
      if (o.of == but_obstacle || !o.near_path(x, x, cell)) continue;
      open *= step(o.distance(o.to_own(1, x), o.blend[1]));
    }
    if (length2(cloth_normal) > 0.f) open *= step(dot(x - cloth_foot, cloth_normal));
    return open;
  }
};

/// Area of a disc over a wall or obstacle that other bodies leave to the fluid, m^2.
struct SurfaceExtent {
  DiscPoints points;
  OpenSpace space;
  SensorBody body;
  float spacing, reach;  // m

  /// Height of the surface over the disc's plane at x, m; false: there is none.
  DRENCH_HD bool surface(Vec3<float> x, float& height) const {
    height = 0.5f * spacing;
    float least = away(x, height);
    while (least < 0.f && height < reach)
      height += maximum(-least, 0.1f * spacing), least = away(x, height);
    if (least < 0.f) return false;
    const float met = 0.02f * spacing;
    for (int k = 0; k < 64 && height > -reach; ++k) {
      if (least < met) return true;
      height -= maximum(least, met), least = away(x, height);
    }
    return false;
  }
  DRENCH_HD float away(Vec3<float> x, float height) const {
    const Vec3<float> p = x + body.facing * height;
    float least = 1e30f;
    for (int k = 0; k < space.obstacles.count; ++k) {
      const ObstacleView& o = space.obstacles.obstacle[k];
      if (o.of == body.of) least = minimum(least, o.distance(o.to_own(1, p), o.blend[1]));
    }
    return least;
  }
  DRENCH_HD Totals<1> operator()(int k) const {
    float weight, height = 0.f;
    const Vec3<float> x = points.point(k, weight);
    const bool on_obstacle = body.kind == SensorBody::obstacle;
    if (on_obstacle && !surface(x, height)) return {};
    const Vec3<float> before = x + body.facing * (height + 0.25f * spacing);
    return {{double(weight) * space.open_fraction(before, on_obstacle ? -1 : body.axis,
                                                  on_obstacle ? body.of : -1)}};
  }
};

/// Area of a sheet over a disc, seen along its normal, m^2: triangles in 64 parts each.
struct ClothExtent {
  Corners corners;
  ConstVecView position;
  const int* sheet;
  SoftDisc disc;
  int of;
  float reach;
  DRENCH_HD Totals<1> operator()(int t) const {
    if (sheet[t] != of) return {};
    const Vec3<float> a = corners.at(position, 3 * t), b = corners.at(position, 3 * t + 1) - a,
                      c = corners.at(position, 3 * t + 2) - a, d = disc.from_centre(a);
    constexpr int parts = 8;
    const float area = 0.5f * fabsf(dot(cross(b, c), disc.normal)) / (parts * parts);
    double sum = 0;
    for (int i = 0; i < parts; ++i) {
      for (int j = 0; i + j < parts; ++j) {
        for (int upper = 0; upper < 2 && i + j + upper < parts; ++upper) {
          const float add = upper == 0 ? 1.f / 3 : 2.f / 3;
          const Vec3<float> at =
              d + b * ((float(i) + add) / parts) + c * ((float(j) + add) / parts);
          if (fabsf(dot(at, disc.normal)) <= reach) sum += double(area) * disc.across(at);
        }
      }
    }
    return {{sum}};
  }
};

/// The stress along the disc's normal n times volumes, N m: of particle i, by virtual work,
/// p_i (m / rho_0) sum_j m / rho_0 (-W'/r) (x_ij . L n) (x_ij . n) b_ij, b the mean weight along
/// the pair, and what bodies have of it.
struct InnerSensor {
  BodyParts parts;
  SoftDisc disc;
  GridView grid;
  NeighbourView list;
  Vec3<float> cloth_normal, cloth_foot;  // particles behind it do not count; zero: none

  DRENCH_HD float pair(Vec3<float> from, Vec3<float> d, Vec3<float> corrected) const {
    const float bond = disc.bond(from, d);
    if (bond == 0.f) return 0.f;
    return parts.step.pair_weight(length(d)) * dot(d, corrected) * dot(d, disc.normal) * bond;
  }
  DRENCH_HD float pairs(int i, Vec3<float> x, Vec3<float> from) const {
    const StepPressure& step = parts.step;
    const Vec3<float> corrected = step.corrected(i, disc.normal);
    float sum = 0.f;
    if (step.predicted) {
      for (size_t k = list.first(i); k < list.end(i); ++k)
        if (list.closeness(k) > 0.f)
          sum += pair(from, nearest(step.at(list.index(k)) - x, disc.period), corrected);
      return sum;
    }
    const GridShape& g = grid.shape;
    for_each_run(grid, g.cell_x(x.x), g.cell_y(x.y), g.cell_z(x.z),
                 [&](int begin, int end, Vec3<float> shift) {
                   const Vec3<float> seen = x - shift;
                   for (int j = begin; j < end; ++j)
                     sum += pair(from, step.at(j) - seen, corrected);
                 });
    return sum;
  }
  DRENCH_HD float body(const BodyPart& part, Vec3<float> from) const {
    const float across = dot(part.gradient, disc.normal) * dot(part.to_surface, disc.normal);
    return across == 0.f ? 0.f
                         : across / parts.step.rest_density * disc.bond(from, part.to_surface);
  }
  DRENCH_HD float bodies(int i, const Beside& b, int row, Vec3<float> from) const {
    float sum = body(parts.sheet(b, row), from);
    for (int k = 0; k < 3; ++k)
      for (int side = 0; side < 2; ++side) sum += body(parts.wall(i, b, k, side), from);
    for (int k = 0; k < parts.obstacles.count; ++k) sum += body(parts.obstacle(b, k), from);
    return sum;
  }
  DRENCH_HD Totals<1> operator()(int i, int row) const {
    const StepPressure& step = parts.step;
    const Beside b = parts.beside(i, row);
    const Vec3<float> from = disc.from_centre(b.x);
    if (step.term[i] == 0.f || !disc.near(from, step.h)) return {};
    if (dot(disc.centre + from - cloth_foot, cloth_normal) < 0.f) return {};
    return {{double(step.mass) * step.rest_density * step.term[i] *
             (pairs(i, b.x, from) + bodies(i, b, row, from))}};
  }
};

struct InnerExtent {
  DiscPoints points;
  OpenSpace space;
  DRENCH_HD Totals<1> operator()(int k) const {
    float weight;
    const Vec3<float> x = points.point(k, weight);
    return {{double(weight) * space.open_fraction(x, -1, -1)}};
  }
};

}  // namespace drench::sim::DRENCH_BACKEND
