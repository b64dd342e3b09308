#include "sim/passes/tension/contact_angle.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// Faces of the fluid at walls: of those that a particle is near the one with the largest stress.
void find_faces(State& state) {
  const MirrorImages images = mirror_images_of(state);
  const ObstacleViews obstacles = images.obstacles;
  const float *of_triangle = state.cloth.wetting.data(), at_walls = state.parameters.wetting,
              inverse_h = 1.f / state.parameters.support_radius;
  const int* triangle = images.any_cloth ? state.fluid.triangle.data() : nullptr;
  const Float4* surface = state.tension.normal.data();
  Float4* face = state.tension.wetting.data();
  parallel_for(
      state.queue, "contact angles: faces", state.fluid.count, DRENCH_LAMBDA(int i) {
        const Mirrors mirrors = images.of(i);
        Float4 largest{0.f, 0.f, 0.f, 0.f};
        for (int k = 0; k < mirrors.count; ++k) {
          const Mirror& m = mirrors.mirror[k];
          const float wetting = m.of == domain_wall     ? at_walls
                                : m.of == nearest_cloth ? of_triangle[triangle[i]]
                                                        : obstacles.obstacle[m.of].wetting;
          float s = wetting * m.weight * (8.f / 3) * WendlandC2::plane(m.distance * inverse_h);
          if (s > 0.f) s *= backed_fraction(surface[i], m.normal);
          if (fabsf(s) > fabsf(largest.w)) largest = {m.normal.x, m.normal.y, m.normal.z, s};
        }
        face[i] = largest;
      });
}

}  // namespace

void apply_contact_angles(State& state) {
  const Parameters& p = state.parameters;
  PressureState& s = state.pressure;
  Float4* kick = s.scratch_a.data();
  find_faces(state);
  with_separation(p, [&](auto separation) {
    using Separation = decltype(separation);
    const float h = p.support_radius, scale = gradient_scale(p) / p.rest_density;
    const float strength = float(state.dt) * p.surface_tension / (p.rest_density * h);
    const FaceForce<Separation> force{s.place.data(), state.tension.wetting.data(), kick,
                                      scale * strength, separation};
    for_each_neighbour(state.queue, "contact angles: force", s.lists, state.fluid.count, force);
    for_each_neighbour(state.queue, "contact angles: velocities", s.lists, state.fluid.count,
                       SmoothKick{kick, state.fluid.velocity.view(), scale * h * h});
  });
}

}  // namespace drench::sim::DRENCH_BACKEND
