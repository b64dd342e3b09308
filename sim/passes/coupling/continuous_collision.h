#pragma once
// Continuous collision detection, the last guard of the coupling: the straight path of a particle
// over a cloth substep against the triangles that move meanwhile (Bridson, Fedkiw, Anderson 2002).
// In double on the stored floats, so that whoever counts crossings from the stored states finds
// none. Where they would cross, the lighter one yields: a triangle lighter than the particle is
// held for the substep and shares its momentum with the particles that stopped it; a lighter
// particle is put back on its side of the triangle, a small clearance off the point where they met,
// by an impulse shared with the vertices. What finds no free position is held; if all is held
// nothing moves, which is free of crossings whatever the tangle.

#include "sim/passes/cloth/cloth_implicit.h"
#include "sim/passes/coupling/geometry.h"
#include "sim/passes/coupling/polygon_grid.h"

namespace drench::sim::DRENCH_BACKEND {

/// A triangle whose corners move on straight lines from a0.. to a1.. while t goes from 0 to 1.
struct MovingTriangle {
  Vec3<double> a0, b0, c0, a1, b1, c1;
};

DRENCH_HD Vec3<double> lerp(Vec3<double> p, Vec3<double> q, double t) { return p + (q - p) * t; }

/// The side of the plane of the triangle that the moving point is on at time t (six times a
/// volume).
DRENCH_HD double side_at(const MovingTriangle& m, Vec3<double> p0, Vec3<double> p1, double t) {
  return signed_volume(lerp(m.a0, m.a1, t), lerp(m.b0, m.b1, t), lerp(m.c0, m.c1, t),
                       lerp(p0, p1, t));
}

/// Is the point inside the triangle's outline at time t, seen along its normal? Edges belong to it.
DRENCH_HD bool inside_at(const MovingTriangle& m, Vec3<double> p0, Vec3<double> p1, double t) {
  const Vec3<double> a = lerp(m.a0, m.a1, t), b = lerp(m.b0, m.b1, t), c = lerp(m.c0, m.c1, t),
                     p = lerp(p0, p1, t);
  const Vec3<double> n = cross(b - a, c - a);
  const double slack = -1e-7 * dot(n, n);
  return dot(cross(b - a, p - a), n) >= slack && dot(cross(c - b, p - b), n) >= slack &&
         dot(cross(a - c, p - c), n) >= slack;
}

/// First time in [0, 1] at which the point passes through the triangle, or -1. The side is a cubic
/// in t: its turning points split [0, 1] into monotone parts, each with at most one root, found by
/// bisection.
DRENCH_HD double crossing_time(const MovingTriangle& m, Vec3<double> p0, Vec3<double> p1) {
  // Power form from four samples.
  const double f0 = side_at(m, p0, p1, 0), f1 = side_at(m, p0, p1, 1.0 / 3),
               f2 = side_at(m, p0, p1, 2.0 / 3), f3 = side_at(m, p0, p1, 1);
  const double c3 = 4.5 * (f3 - 3 * f2 + 3 * f1 - f0), c2 = 9 * f0 - 22.5 * f1 + 18 * f2 - 4.5 * f3,
               c1 = -5.5 * f0 + 9 * f1 - 4.5 * f2 + f3;
  double knots[4] = {0, 1, 1, 1};
  int count = 1;
  const double qa = 3 * c3, qb = 2 * c2, disc = qb * qb - 4 * qa * c1;
  if (disc >= 0) {
    const double q = -0.5 * (qb + (qb >= 0 ? ::sqrt(disc) : -::sqrt(disc)));
    const double r0 = qa != 0 ? q / qa : 2, r1 = q != 0 ? c1 / q : 2;
    const double lo = r0 < r1 ? r0 : r1, hi = r0 < r1 ? r1 : r0;
    if (lo > 0 && lo < 1) knots[count++] = lo;
    if (hi > 0 && hi < 1 && hi > lo) knots[count++] = hi;
  }
  knots[count] = 1;
  for (int k = 0; k < count; ++k) {
    double t0 = knots[k], t1 = knots[k + 1];
    const bool above = side_at(m, p0, p1, t0) > 0;
    if (above == (side_at(m, p0, p1, t1) > 0)) continue;
    for (int step = 0; step < 60 && t1 - t0 > 1e-15; ++step) {
      const double middle = 0.5 * (t0 + t1);
      ((side_at(m, p0, p1, middle) > 0) == above ? t0 : t1) = middle;
    }
    if (inside_at(m, p0, p1, t1)) return t1;
  }
  return -1;
}

/// What walls and obstacles hold of implicit sheets does not give way to what presses it on them.
struct ClothGround {
  ConstraintProjection free;
  Vec3<float> middle;  // m, between the walls
  bool holds;

  /// Fraction of a vertex' inverse mass that a push meets. @param push  unit
  DRENCH_HD float gives(int vertex, Vec3<float> x, Vec3<float> push) const {
    if (!holds) return 1.f;
    const Vec3<float> may = free.axis[vertex];
    const auto open = [](float may, float push, float off) {
      return may == 0.f && push * off > 0.f ? 0.f : push;  // off the middle: into the wall
    };
    Vec3<float> direction{open(may.x, push.x, x.x - middle.x), open(may.y, push.y, x.y - middle.y),
                          open(may.z, push.z, x.z - middle.z)};
    if (!free.obstacles) return length2(direction);
    const Vec3<float> n = free.normal[vertex];
    const float in = dot(n, direction);
    if (in >= 0.f) return length2(direction);
    return free.slides[vertex] == 0.f ? 0.f : length2(direction - n * in);
  }
};

/// Spacings off the triangle where a path that met it ends.
constexpr float collision_clearance = 1e-3f;

/// Paths of particles against moving triangles, and who yields where they would cross
/// (docs/decisions/0025-who-yields-in-a-collision.md).
struct ContinuousCollision {
  PolygonView polygons;            // cells from the start of the step
  ConstVecView cloth, cloth_next;  // this substep
  ConstVecView cloth_velocity;
  VecView velocity, normal, start;
  ConstVecView position;
  VecView owed;
  const int* hold;      // by vertex: 1 once stopped
  long long* stop_sum;  // by vertex, 4: how many particles stop it in this round, sum of their
                        // velocities in units of velocity_unit
  int* stopped;         // by particle: triangle it stopped in this round, -1 none
  const int* nearest;   // by particle: its triangle, and how far inside a free edge of it (0..1)
  const float *edge, *distance, *cloth_mass, *inverse_mass, *contact_weight;
  float mass, clearance;
  float cloth_moved;  // m, farthest that a vertex has been from its position at the step's start
  int attempts;       // 0: the particle is held at once
  ClothGround ground;

  struct Hit {
    int triangle = -1;
    double time = 2;
    int image = -1;  // of the triangle: its index in the grid's order
  };

  /// The triangle over this substep. @param image  as Hit::image
  DRENCH_HD MovingTriangle moving(int image) const {
    const auto from = [&](int e) { return to_double(polygons.corner_in(image, e, cloth)); };
    const auto to = [&](int e) { return to_double(polygons.corner_in(image, e, cloth_next)); };
    return {from(0), from(1), from(2), to(0), to(1), to(2)};
  }

  /// The earliest triangle that the path meets, -1 for none.
  DRENCH_HD Hit first_hit(Vec3<float> from, Vec3<float> to) const {
    Hit hit;
    const Vec3<float> low{minimum(from.x, to.x), minimum(from.y, to.y), minimum(from.z, to.z)};
    const Vec3<float> high{maximum(from.x, to.x), maximum(from.y, to.y), maximum(from.z, to.z)};
    polygons.for_each_near_box(low, high, cloth_moved + clearance, [&](int k) {
      const double time = crossing_time(moving(k), to_double(from), to_double(to));
      if (time >= 0 && time < hit.time) hit = {polygons.order[k], time, k};
    });
    return hit;
  }

  /// Do all three corners stand still already?
  DRENCH_HD bool still(int t) const {
    const int* k = polygons.corner + 3 * t;
    return (hold[k[0]] || inverse_mass[k[0]] == 0.f) && (hold[k[1]] || inverse_mass[k[1]] == 0.f) &&
           (hold[k[2]] || inverse_mass[k[2]] == 0.f);
  }
  /// Is a triangle's mean vertex lighter than a particle?
  DRENCH_HD bool lighter(int t) const {
    const int* k = polygons.corner + 3 * t;
    return (cloth_mass[k[0]] + cloth_mass[k[1]] + cloth_mass[k[2]]) / 3.f < mass;
  }

  /// Does a triangle stop for a particle? A light one that comes at it, if that frees the path: a
  /// particle that would also pass through the triangle where it stands has to be turned aside
  /// anyway, and a triangle stopped for it hangs on the particle, step by step, while its springs
  /// stretch. So does one at a free edge of the particle's own triangle, where no pressure tells it
  /// of the springs.
  DRENCH_HD bool triangle_stops(int i, Vec3<float> from, Vec3<float> to, const Hit& hit) const {
    if (!lighter(hit.triangle) || (nearest[i] == hit.triangle && edge[i] < 1.f)) return false;
    MovingTriangle m = moving(hit.image);
    m.a1 = m.a0, m.b1 = m.b0, m.c1 = m.c0;
    return crossing_time(m, to_double(from), to_double(to)) < 0;
  }

  static constexpr double velocity_unit = 1.0 / (1 << 24);  // m/s

  /// Counts a particle of velocity v, m/s, that stops a vertex: in integers, in any order.
  DRENCH_HD void add_stop(int vertex, Vec3<float> v) const {
    long long* sum = stop_sum + 4 * vertex;
    add_atomic(sum, 1);
    add_atomic(sum + 1, (long long)(v.x / velocity_unit));
    add_atomic(sum + 2, (long long)(v.y / velocity_unit));
    add_atomic(sum + 3, (long long)(v.z / velocity_unit));
  }
  DRENCH_HD int stop_count(int vertex) const { return int(stop_sum[4 * vertex]); }
  /// Of the vertex and the particles that stop it, after an impact without rebound; a particle
  /// gives a third of its mass to each corner. The mean of the particles alone would leave them a
  /// heavy vertex's momentum to carry off, and a vertex may have ten times their mass.
  DRENCH_HD Vec3<float> stop_velocity(int vertex, Vec3<float> own) const {
    const long long* sum = stop_sum + 4 * vertex;
    const double third = mass / 3., of_cloth = cloth_mass[vertex];
    const double unit = velocity_unit * third, inverse = 1 / (of_cloth + third * double(sum[0]));
    return {float((sum[1] * unit + own.x * of_cloth) * inverse),
            float((sum[2] * unit + own.y * of_cloth) * inverse),
            float((sum[3] * unit + own.z * of_cloth) * inverse)};
  }

  /// Where the particle ends this substep; false if another round is needed because it stopped a
  /// triangle or had to be held itself.
  DRENCH_HD bool resolve(int i, Vec3<float> from, Vec3<float>& to) const {
    stopped[i] = -1;
    for (int attempt = 0;; ++attempt) {
      const Hit hit = first_hit(from, to);
      if (hit.triangle < 0) return true;
      if (!still(hit.triangle) && (triangle_stops(i, from, to, hit) || attempt >= attempts)) {
        stopped[i] = hit.triangle;
        for (int k = 0; k < 3; ++k) add_stop(polygons.corner[3 * hit.triangle + k], velocity[i]);
        return false;
      }
      if (attempt >= attempts) {
        to = from;
        return false;
      }
      bounce(i, from, to, hit);
    }
  }

  /// Puts the end of the path back on the particle's side of the triangle it met and takes the
  /// normal part of the relative velocity, once a step and shared by the reduced mass of all
  /// contacts on the vertices (as in contact_wcsph.h, or many hits would throw light cloth back);
  /// the cloth's part is owed to it until the next step.
  DRENCH_HD void bounce(int i, Vec3<float> from, Vec3<float>& to, const Hit& hit) const {
    const MovingTriangle m = moving(hit.image);
    const Vec3<double> p0 = to_double(from), p1 = to_double(to);
    const double side = side_at(m, p0, p1, 0) > 0 ? 1 : -1;
    const Vec3<double> p = lerp(p0, p1, hit.time), a = lerp(m.a0, m.a1, hit.time),
                       e = lerp(m.b0, m.b1, hit.time) - a, f = lerp(m.c0, m.c1, hit.time) - a;
    const Vec3<double> n = cross(e, f);
    const double nn = dot(n, n) > 1e-60 ? dot(n, n) : 1e-60;
    const double wb = dot(cross(p - a, f), n) / nn, wc = dot(cross(e, p - a), n) / nn,
                 wa = 1 - wb - wc;
    const Vec3<double> n1 = cross(m.b1 - m.a1, m.c1 - m.a1);
    const Vec3<double> unit = n1 * (side / (length(n1) > 1e-30 ? length(n1) : 1e-30));
    to = to_float(m.a1 * wa + m.b1 * wb + m.c1 * wc + unit * double(clearance));

    const int* k = polygons.corner + 3 * hit.triangle;
    const Vec3<float> direction = to_float(unit);
    const float w[3] = {float(wa), float(wb), float(wc)};
    Vec3<float> wall{0.f, 0.f, 0.f};
    float row = 1.f / mass;
    for (int c = 0; c < 3; ++c) {
      wall = wall + cloth_velocity[k[c]] * w[c];
      row += w[c] * maximum(w[c], contact_weight[k[c]]) * inverse_mass[k[c]] *
             ground.gives(k[c], cloth_next[k[c]], direction * -1.f);
    }
    const float approach = dot(direction, velocity[i] - wall);
    if (approach >= 0.f) return;
    const Vec3<float> whole = direction * -approach, shared = direction * (-approach / row);
    const bool held = still(hit.triangle);
    // Between fluid on both sides a light sheet can neither move nor take more than its share, and
    // the rest of the velocity would pile up in a particle that does not move: there it is given
    // up. A heavy sheet takes all.
    owed.set(i, owed[i] + (held && !lighter(hit.triangle) ? whole * mass : shared));
    velocity.set(i, velocity[i] + (held ? whole : shared * (1.f / mass)));
  }

  /// Can the particle meet the sheet at all? Its distance at the start of the step against all
  /// motion.
  DRENCH_HD bool in_reach(int i, Vec3<float> to) const {
    const float d = distance[i] < 0.f ? -distance[i] : distance[i];
    const float nearest = normal_is_zero(i) ? 0.f : d;
    return nearest <=
           length(to - start[i]) + length(to - position[i]) + cloth_moved + 2.f * clearance;
  }
  /// Beyond a free edge: near, but the distance is not kept.
  DRENCH_HD bool normal_is_zero(int i) const {
    const Vec3<float> n = normal[i];
    return n.x == 0.f && n.y == 0.f && n.z == 0.f;
  }
};

}  // namespace drench::sim::DRENCH_BACKEND
