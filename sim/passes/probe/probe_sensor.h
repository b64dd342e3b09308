#pragma once
// Pressure sensors: a disc on a wall, an obstacle or a sheet measures what the fluid pushes there,
// over its area; a disc elsewhere the stress in the fluid. Both are of the forces that moved the
// particles, so that discs side by side sum to the force on what they cover.
//
// Inside the fluid a pair's force is what one particle hands to the other along the line between
// them, and a body's along the perpendicular to its surface; the stress is that handed through
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
  /// The mean weight along the line from d to d + way: the integral of the tent along the normal is
  /// exact, the place across is the line's middle.
  DRENCH_HD float bond(Vec3<float> d, Vec3<float> way) const {
    const float from = dot(d, normal) / rim, to = from + dot(way, normal) / rim;
    const float mean = fabsf(to - from) > 0.02f ? (below(to) - below(from)) / (to - from)
                                                : max0(1.f - fabsf(0.5f * (from + to)));
    return mean > 0.f ? mean * across(d + way * 0.5f) : 0.f;
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

inline SoftDisc soft_disc_of(const ProbeQuery& q, const Parameters& p) {
  return {{q.place[0], q.place[1], q.place[2]},
          {q.normal[0], q.normal[1], q.normal[2]},
          q.radius,
          q.rim,
          periods_of(p)};
}

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
  DRENCH_HD Vec3<float> place(int k, float& weight) const {
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

inline DiscPoints disc_points(const SoftDisc& disc, int layers, int rings, int spokes) {
  const Vec3<float> n = disc.normal,
                    other =
                        fabsf(n.x) < 0.6f ? Vec3<float>{1.f, 0.f, 0.f} : Vec3<float>{0.f, 1.f, 0.f},
                    across = cross(n, other), u = across * (1.f / length(across));
  return {disc, u, cross(n, u), layers, rings, spokes};
}

/// What a disc lies on.
struct SensorBody {
  enum Kind : int { none, wall, obstacle, sheet } kind = none;
  int axis = 0, side = 0;             // of a wall
  int of = -1;                        // obstacle or sheet
  Vec3<float> facing{0.f, 0.f, 0.f};  // unit, to the fluid that is measured
  Vec3<float> foot{0.f, 0.f, 0.f};    // m, on a sheet
  float distance = 1e30f;             // m, of the disc's centre from its surface
  DRENCH_HD SensorBody operator()(const SensorBody& a, const SensorBody& b) const {
    return fabsf(b.distance) < fabsf(a.distance) ? b : a;
  }
};

struct ObstacleAt {
  ObstacleViews obstacles;
  Vec3<float> place;
  int only;  // -1: any
  DRENCH_HD SensorBody operator()(int k) const {
    const ObstacleView& o = obstacles.obstacle[k];
    SensorBody body;
    if (only >= 0 && o.of != only) return body;
    const Vec3<float> own = o.to_own(1, place);
    body.kind = SensorBody::obstacle, body.of = o.of;
    body.distance = o.distance(own, o.blend[1]);
    body.facing = o.turn(1, o.normal(own, o.blend[1]));
    return body;
  }
};

struct SheetAt {
  Corners corners;
  VecView position;
  const float* half_thickness;
  const int* sheet;
  Vec3<float> place, period;
  DRENCH_HD SensorBody operator()(int t) const {
    const Vec3<float> a = corners.at(position, 3 * t), b = corners.at(position, 3 * t + 1),
                      c = corners.at(position, 3 * t + 2), d = nearest(place - a, period),
                      none{0.f, 0.f, 0.f}, n = cross(b - a, c - a);
    const auto foot = closest_point(d, none, b - a, c - a);
    const float size = length(n);
    SensorBody body;
    body.kind = SensorBody::sheet, body.of = sheet[t];
    body.distance = sqrtf(foot.distance2) - half_thickness[t];
    body.facing = n * (size > 0.f ? 1.f / size : 0.f);
    body.foot = place - d + (b - a) * foot.wb + (c - a) * foot.wc;
    return body;
  }
};

/// The nearest sheet; none in a shot without any.
inline SensorBody sheet_at(const State& state, Vec3<float> place) {
  const ClothState& c = state.cloth;
  if (!state.parameters.incompressible) return {};
  return parallel_reduce("probe: sheet", c.triangles, SensorBody{},
                         SheetAt{corners_of(c), c.position.view(), c.half_thickness.data(),
                                 c.sheet.data(), place, periods_of(state.parameters)},
                         SensorBody{});
}

/// What a disc lies on: within half a spacing and 25 degrees of its surface. On obstacles either
/// sign of its normal is right, on sheets it points to the side that is measured.
inline SensorBody sensor_body(const State& state, const ProbeQuery& q) {
  SensorBody body;
  if (q.kind == ProbeKind::wall_pressure) {
    body.kind = SensorBody::wall, body.axis = q.axis, body.side = q.side;
    body.facing = along_axis(q.axis, q.side == 0 ? 1.f : -1.f);
    return body;
  }
  const Vec3<float> place{q.place[0], q.place[1], q.place[2]},
      n{q.normal[0], q.normal[1], q.normal[2]};
  const float reach = 0.5f * state.parameters.spacing * 1.001f;
  const auto lies_on = [&](const SensorBody& b) {
    return fabsf(b.distance) <= reach && fabsf(dot(b.facing, n)) > 0.9f;
  };
  const ObstacleViews obstacles = state.obstacles.views();
  body = parallel_reduce("probe: obstacle", obstacles.count, SensorBody{},
                         ObstacleAt{obstacles, place, q.on}, SensorBody{});
  if (lies_on(body)) {
    body.facing = dot(body.facing, n) < 0.f ? -n : n;
    return body;
  }
  body = sheet_at(state, place);
  if (lies_on(body)) {
    body.facing = n;
    return body;
  }
  return {};
}

/// What the fluid pushes onto a body through a disc on it, N.
struct SurfaceSensor {
  BodyParts parts;
  SoftDisc disc;
  SensorBody body;
  const int *triangle, *sheet;  // of particles, of triangles
  float reach;                  // m, how far from the disc's plane its surface may lie

  DRENCH_HD double push(const BodyPart& part, Vec3<float> from, int i) const {
    const float inward = -dot(part.gradient, body.facing);
    const Vec3<float> d = from + part.way;
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
  Vec3<float> sheet_normal, sheet_foot;  // a zero normal: no sheet
  float cell;                            // m, over which the share of a point falls

  DRENCH_HD float step(float distance) const { return minimum(max0(0.5f + distance / cell), 1.f); }
  /// The share of a point's cell that is open. @param but  an axis, or an obstacle, left out.
  DRENCH_HD float share(Vec3<float> x, int but_axis, int but_obstacle) const {
    float open = 1.f;
    for (int k = 0; k < 3; ++k)
      if (walls.on[k] && k != but_axis)
        open *= step(component(x, k) - walls.low[k]) * step(walls.high[k] - component(x, k));
    for (int k = 0; k < obstacles.count; ++k) {
      const ObstacleView& o = obstacles.obstacle[k];
      if (o.of == but_obstacle || !o.near_path(x, x, cell)) continue;
      open *= step(o.distance(o.to_own(1, x), o.blend[1]));
    }
    if (length2(sheet_normal) > 0.f) open *= step(dot(x - sheet_foot, sheet_normal));
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
    const Vec3<float> x = points.place(k, weight);
    const bool on_obstacle = body.kind == SensorBody::obstacle;
    if (on_obstacle && !surface(x, height)) return {};
    const Vec3<float> before = x + body.facing * (height + 0.25f * spacing);
    return {{double(weight) *
             space.share(before, on_obstacle ? -1 : body.axis, on_obstacle ? body.of : -1)}};
  }
};

/// Area of a sheet over a disc, seen along its normal, m^2: triangles in 64 parts each.
struct SheetExtent {
  Corners corners;
  VecView position;
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

inline double surface_extent(const State& state, const ProbeQuery& q, const SoftDisc& disc,
                             const SensorBody& body, float reach) {
  const Parameters& p = state.parameters;
  const ClothState& c = state.cloth;
  if (body.kind == SensorBody::sheet) {
    return parallel_reduce(
               "probe: sheet's area", c.triangles, Totals<1>{},
               SheetExtent{corners_of(c), c.position.view(), c.sheet.data(), disc, body.of, reach},
               AddTotals<1>{})
        .value[0];
  }
  const ObstacleViews obstacles = state.obstacles.views();
  if (obstacles.count == 0) return q.extent;
  const DiscPoints points = disc_points(disc, 1, 48, 96);
  const Vec3<float> none{0.f, 0.f, 0.f};
  return parallel_reduce("probe: area", points.count(), Totals<1>{},
                         SurfaceExtent{points,
                                       {image_walls_of(p), obstacles, none, none, points.cell()},
                                       body,
                                       p.spacing,
                                       reach},
                         AddTotals<1>{})
      .value[0];
}

/// Force of the fluid through a disc on a body, over its area, Pa; 0 where nothing is left of it.
inline double surface_pressure(const State& state, const ProbeQuery& q, const SensorBody& body) {
  const SoftDisc disc = soft_disc_of(q, state.parameters);
  const float reach = disc.radius + disc.rim;
  const double extent = surface_extent(state, q, disc, body, reach);
  if (!(extent > 1e-3 * disc.rim * disc.rim)) return 0;
  const Totals<1> sum = sum_by_particle<1>(
      "probe: pressure on a surface", state,
      SurfaceSensor{body_parts_of(state), disc, body, state.fluid.triangle.data(),
                    state.cloth.sheet.data(), reach});
  return sum.value[0] / extent;
}

/// The stress along the disc's normal n times volumes, N m: of particle i, by virtual work,
/// p_i (m / rho_0) sum_j m / rho_0 (-W'/r) (x_ij . L n) (x_ij . n) b_ij, b the mean weight along
/// the pair, and what bodies have of it.
struct InnerSensor {
  BodyParts parts;
  SoftDisc disc;
  GridView grid;
  NeighbourView list;
  Vec3<float> sheet_normal, sheet_foot;  // particles behind it do not count; zero: none

  DRENCH_HD float pair(Vec3<float> from, Vec3<float> d, Vec3<float> corrected) const {
    const float bond = disc.bond(from, d);
    if (bond == 0.f) return 0.f;
    return parts.step.pair_weight(length(d)) * dot(d, corrected) * dot(d, disc.normal) * bond;
  }
  DRENCH_HD float pairs(int i, Vec3<float> x, Vec3<float> from) const {
    const StepPressure& step = parts.step;
    const Vec3<float> corrected = step.corrected(i, disc.normal);
    float sum = 0.f;
    if (step.place) {
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
    const float across = dot(part.gradient, disc.normal) * dot(part.way, disc.normal);
    return across == 0.f ? 0.f : across / parts.step.rest_density * disc.bond(from, part.way);
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
    if (dot(disc.centre + from - sheet_foot, sheet_normal) < 0.f) return {};
    return {{double(step.mass) * step.rest_density * step.term[i] *
             (pairs(i, b.x, from) + bodies(i, b, row, from))}};
  }
};

struct InnerExtent {
  DiscPoints points;
  OpenSpace space;
  DRENCH_HD Totals<1> operator()(int k) const {
    float weight;
    const Vec3<float> x = points.place(k, weight);
    return {{double(weight) * space.share(x, -1, -1)}};
  }
};

/// Mean of the pressure in a disc inside the fluid, Pa; where there is no fluid it counts as none.
inline double inner_pressure(const State& state, const ProbeQuery& q) {
  const Parameters& p = state.parameters;
  const FluidState& f = state.fluid;
  const SoftDisc disc = soft_disc_of(q, p);
  const ObstacleViews obstacles = state.obstacles.views();
  // Fluid on the disc's side of the nearest sheet alone, if that is in reach.
  const SensorBody sheet = sheet_at(state, disc.centre);
  Vec3<float> normal{0.f, 0.f, 0.f};
  if (sheet.distance < disc.rim) {
    const Vec3<float> up = disc.from_centre(sheet.foot) * -1.f;
    normal = dot(up, sheet.facing) < 0.f ? -sheet.facing : sheet.facing;
  }
  double extent = q.extent;
  if (obstacles.count > 0 || length2(normal) > 0.f) {
    const DiscPoints points = disc_points(disc, 32, 16, 32);
    extent =
        parallel_reduce(
            "probe: volume of a disc", points.count(), Totals<1>{},
            InnerExtent{points, {image_walls_of(p), obstacles, normal, sheet.foot, points.cell()}},
            AddTotals<1>{})
            .value[0];
  }
  if (!(extent > 1e-3 * disc.rim * disc.rim * disc.rim)) return 0;
  const Totals<1> sum = sum_by_particle<1>("probe: pressure", state,
                                           InnerSensor{body_parts_of(state),
                                                       disc,
                                                       {f.grid, f.cell_start.data()},
                                                       view_of(state.pressure.lists),
                                                       normal,
                                                       sheet.foot});
  return sum.value[0] / extent;
}

/// Pressure of a disc, Pa, of a surface that it lies on or of the fluid around it.
inline double disc_pressure(const State& state, const ProbeQuery& q) {
  const SensorBody body = sensor_body(state, q);
  return body.kind == SensorBody::none ? inner_pressure(state, q)
                                       : surface_pressure(state, q, body);
}

}  // namespace drench::sim::DRENCH_BACKEND
