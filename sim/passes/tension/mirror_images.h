#pragma once
// Sums over the mirror images of neighbours beyond walls, obstacles and sheets and beyond the edges
// and corners they make with each other, for passes to which a wall is no half-space: a surface
// that ends at a wall goes on in its image. Mirrors are planes: walls of the domain, tangent planes
// of obstacles where they end the step, and that of the nearest sheet where its velocity takes it.
// No image is nearer than its particle, so that the neighbour lists hold all that are in reach.

#include "sim/neighbours/periodic.h"
#include "sim/neighbours/sph_kernels.h"
#include "sim/passes/coupling/contact_wcsph.h"
#include "sim/passes/motion/domain_walls.h"

namespace drench::sim::DRENCH_BACKEND {

/// What a mirror belongs to; obstacles by their index.
constexpr int domain_wall = -1, nearest_cloth = -2;

struct Mirror {
  Vec3<float> normal;  // unit, towards the fluid
  float offset;        // m, normal . x on the plane
  float distance;      // m, of the particle
  float weight;        // of its images: 1, less where a sheet ends
  int of;

  DRENCH_HD float height(Vec3<float> x) const { return dot(normal, x) - offset; }
};

/// The mirrors of one particle, the nearest first.
struct Mirrors {
  static constexpr int most = 3, candidates = 6;
  Mirror mirror[candidates];
  int count = 0;

  DRENCH_HD void add(const Mirror& m) {
    int at = count;
    for (; at > 0 && mirror[at - 1].distance > m.distance; --at)
      if (at < candidates) mirror[at] = mirror[at - 1];
    if (at < candidates) mirror[at] = m;
    count = count < candidates ? count + 1 : candidates;
  }
  /// Drops those that stand behind a nearer one, seen from x: walls behind a sheet, boxes flush
  /// with each other.
  DRENCH_HD void keep_seen(Vec3<float> x, float least) {
    int kept = 0;
    for (int k = 0; k < count && kept < most; ++k) {
      const Mirror m = mirror[k];
      const Vec3<float> foot = x - m.normal * m.distance;
      bool seen = true;
      for (int n = 0; n < kept; ++n) seen &= mirror[n].height(foot) > least;
      if (seen) mirror[kept++] = m;
    }
    count = kept;
  }
};

/// An image of a neighbour in one mirror, or in one after the other.
struct Image {
  const Mirrors* mirrors;
  int in;         // bit k: in mirror k
  Vec3<float> x;  // m, from there to the particle
  float u;        // closeness

  /// A vector as the mirrors show it.
  DRENCH_HD Vec3<float> turned(const Float4& v) const {
    Vec3<float> t{v.x, v.y, v.z};
    for (int k = 0; k < mirrors->count; ++k) {
      const Vec3<float> n = mirrors->mirror[k].normal;
      if (in >> k & 1) t = t - n * (2.f * dot(n, t));
    }
    return t;
  }
};

/// Sums of images by the nearest of their mirrors.
struct ImageSums {
  Vec3<float> by[Mirrors::most] = {};
  DRENCH_HD Vec3<float> total() const { return by[0] + by[1] + by[2]; }
};

/// The sheets as mirrors of the particles near them.
struct ClothMirrors {
  NearView near;
  ConstVecView normal, start, cloth_velocity;
  const float *distance, *edge, *half_thickness;
  float dt;  // s

  /// The gap as the pressure has it (contact_incompressible.h). Nothing is nearer than `least`.
  DRENCH_HD void add(Mirrors& mirrors, int i, Vec3<float> x, float h, float least) const {
    const int t = near.triangle[i];
    if (t < 0 || edge[i] <= 0.f) return;
    Vec3<float> foot{0.f, 0.f, 0.f};
    for (int k = 0; k < 3; ++k)
      foot = foot + cloth_velocity[near.corner[3 * t + k]] * (dt * near.weight(i, k));
    const Vec3<float> n = normal[i];
    const float gap = distance[i] - half_thickness[t] + dot(n, x - start[i] - foot),
                held = maximum(gap, least);
    if (held < h) mirrors.add({n, dot(n, x) - held, held, edge[i], nearest_cloth});
  }
};

struct MirrorImages {
  const Float4* position;  // m
  NeighbourView list;
  DomainWalls walls;
  float support_radius, spacing;  // m
  float period[3], inverse[3];    // m, 1/m; 0 where an axis is not periodic
  ObstacleViews obstacles;
  ClothMirrors cloth;
  bool any_cloth, any;

  DRENCH_HD Mirrors of(int i) const {
    Mirrors mirrors;
    const float h = support_radius, p[3] = {position[i].x, position[i].y, position[i].z};
    const Vec3<float> x{p[0], p[1], p[2]};
    for (int k = 0; k < 3; ++k) {
      const Vec3<float> up{float(k == 0), float(k == 1), float(k == 2)};
      if (!walls.on[k]) continue;
      const float below = p[k] - walls.low[k], above = walls.high[k] - p[k];
      if (below < h) mirrors.add({up, walls.low[k], below, 1.f, domain_wall});
      if (above < h) mirrors.add({-up, -walls.high[k], above, 1.f, domain_wall});
    }
    for (int k = 0; k < obstacles.count; ++k) {
      const ObstacleView& o = obstacles.obstacle[k];
      if (!o.near_path(x, x, h)) continue;
      const Vec3<float> own = o.to_own(1, x);
      const float d = maximum(o.distance(own, o.blend[1]), 0.1f * spacing);
      if (d >= h) continue;
      const Vec3<float> n = o.turn(1, o.normal(own, o.blend[1]));
      if (length2(n) > 0.5f) mirrors.add({n, dot(n, x) - d, d, 1.f, o.of});
    }
    if (any_cloth) cloth.add(mirrors, i, x, h, 0.1f * spacing);
    mirrors.keep_seen(x, 0.05f * spacing);
    return mirrors;
  }

  /// Where an image stands. False: there is none, its particle is behind the mirror.
  DRENCH_HD bool reflect(const Mirrors& mirrors, int in, Vec3<float>& x, float& weight) const {
    for (int k = 0; k < mirrors.count; ++k) {
      if (!(in >> k & 1)) continue;
      const Mirror& m = mirrors.mirror[k];
      const float above = m.height(x);
      if (above <= 0.f) return false;
      x = x - m.normal * (2.f * above);
      weight *= m.weight;
    }
    return true;
  }

  /// Sums of term(i, j, image) over images of j.
  template <class Term>
  DRENCH_HD ImageSums sum(int i, const Mirrors& mirrors, const Term& term) const {
    ImageSums sums;
    if (mirrors.count == 0) return sums;
    const float h = support_radius, own[3] = {position[i].x, position[i].y, position[i].z};
    const size_t end = list.end(i);
    for (size_t k = list.first(i); k < end; ++k) {
      if (!(list.closeness(k) > 0.f)) continue;
      const int j = list.index(k);
      const float at[3] = {position[j].x, position[j].y, position[j].z};
      float near[3];  // the nearest image across periodic axes
      for (int c = 0; c < 3; ++c)
        near[c] = at[c] + period[c] * rintf((own[c] - at[c]) * inverse[c]);
      for (int in = 1; in < 1 << mirrors.count; ++in) {
        Vec3<float> there{near[0], near[1], near[2]};
        float weight = 1.f;
        if (!reflect(mirrors, in, there, weight)) continue;
        const Vec3<float> x{own[0] - there.x, own[1] - there.y, own[2] - there.z};
        const float r2 = length2(x);
        if (r2 >= h * h) continue;
        const int nearest = in & 1 ? 0 : in & 2 ? 1 : 2;
        const Image image{&mirrors, in, x, 1.f - square_root(r2) / h};
        sums.by[nearest] = sums.by[nearest] + term(i, j, image) * weight;
      }
    }
    return sums;
  }
};

inline MirrorImages mirror_images_of(const State& state) {
  const Parameters& p = state.parameters;
  const PressureState& s = state.pressure;
  const FluidState& f = state.fluid;
  MirrorImages images{};
  images.position = s.place.data(), images.list = view_of(s.lists);
  images.support_radius = p.support_radius, images.spacing = p.spacing;
  images.obstacles = state.obstacles.views();
  images.walls = domain_walls(p);
  images.any_cloth = state.contact.near > 0;
  images.any = p.obstacles > 0 || images.any_cloth;
  for (int k = 0; k < 3; ++k) {
    images.period[k] = p.periodic[k] ? p.high[k] - p.low[k] : 0.f;
    images.inverse[k] = p.periodic[k] ? 1.f / images.period[k] : 0.f;
    images.any |= p.wall[k];
  }
  if (images.any_cloth) {
    images.cloth = {.near = near_list(state),
                    .normal = f.normal.view(),
                    .start = f.start.view(),
                    .cloth_velocity = state.cloth.velocity.view(),
                    .distance = f.cloth_distance.data(),
                    .edge = f.edge.data(),
                    .half_thickness = state.cloth.half_thickness.data(),
                    .dt = float(state.dt)};
  }
  return images;
}

}  // namespace drench::sim::DRENCH_BACKEND
