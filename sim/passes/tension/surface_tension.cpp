#include "sim/passes/tension/surface_tension.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// Normals, from the means of gradients.
void make_unit(State& state) {
  Float4* normal = state.tension.normal.data();
  const float h = state.parameters.support_radius;
  parallel_for(
      state.queue, "tension: unit normals", state.fluid.count, DRENCH_LAMBDA(int i) {
        const Float4 n = normal[i];
        const float size = square_root(n.x * n.x + n.y * n.y + n.z * n.z);
        const float s = size > 0.f ? 1.f / size : 0.f;
        normal[i] = {s * n.x, s * n.y, s * n.z, h * size};
      });
}

/// Adds the images' part to a column of vectors.
template <class Term>
void add_images(const char* name, const State& state, Float4* vector, const Term& term) {
  const MirrorImages images = mirror_images_of(state);
  if (!images.any) return;
  parallel_for(
      state.queue, name, state.fluid.count, DRENCH_LAMBDA(int i) {
        const Mirrors mirrors = images.of(i);
        if (mirrors.count == 0) return;
        const Vec3<float> s = images.sum(i, mirrors, term).total();
        const Float4 v = vector[i];
        vector[i] = {v.x + s.x, v.y + s.y, v.z + s.z, 0.f};
      });
}

/// Adds what images do to kicks. A sheet owes its part until the next step, as in
/// continuous_collision.h.
template <class Separation>
void pull_on_walls(State& state, const TensionForce<Separation>& force) {
  const MirrorImages images = mirror_images_of(state);
  if (!images.any) return;
  const VecView owed = state.fluid.owed.view();
  Float4* kick = force.kick;
  const float mass = state.parameters.particle_mass;
  parallel_for(
      state.queue, "tension: force of walls", state.fluid.count, DRENCH_LAMBDA(int i) {
        const Mirrors mirrors = images.of(i);
        if (mirrors.count == 0) return;
        const ImageSums sums = images.sum(i, mirrors, force);
        const Vec3<float> all = sums.total() * force.scale;
        kick[i] = {kick[i].x - all.x, kick[i].y - all.y, kick[i].z - all.z, 0.f};
        for (int k = 0; k < mirrors.count; ++k)
          if (mirrors.mirror[k].of == nearest_cloth)
            owed.set(i, owed[i] - sums.by[k] * (force.scale * mass));
      });
  state.owes |= images.any_cloth;
}

}  // namespace

void apply_surface_tension(State& state) {
  const Parameters& p = state.parameters;
  PressureState& s = state.pressure;
  const int n = state.fluid.count;
  const float h = p.support_radius;
  Float4 *gradient = s.scratch_a.data(), *normal = state.tension.normal.data(), *kick = gradient;
  with_separation(p, [&](auto separation) {
    using Separation = decltype(separation);
    const float scale = gradient_scale(p) / p.rest_density;
    const ColourGradient<Separation> colour{s.place.data(), gradient, scale, separation};
    for_each_neighbour(state.queue, "tension: gradients", s.lists, n, colour);
    add_images("tension: gradients beyond walls", state, gradient, colour);
    const SmoothNormal smooth{gradient, normal, scale * h * h};
    for_each_neighbour(state.queue, "tension: normals", s.lists, n, smooth);
    add_images("tension: normals beyond walls", state, normal, smooth);
    make_unit(state);
    const TensionForce<Separation> force = tension_force(state, kick, separation);
    for_each_neighbour(state.queue, "tension: force", s.lists, n, force);
    pull_on_walls(state, force);
    for_each_neighbour(state.queue, "tension: velocities", s.lists, n,
                       SmoothKick{kick, state.fluid.velocity.view(), scale * h * h});
  });
}

}  // namespace drench::sim::DRENCH_BACKEND
