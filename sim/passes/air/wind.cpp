#include "sim/passes/air/wind_on_cloth.h"
#include "sim/passes/air/wind_on_fluid.h"

namespace drench::sim::DRENCH_BACKEND {

void blow_at_cloth(State& state, const ConstVecView& position, const ConstVecView& velocity) {
  ClothState& c = state.cloth;
  const Parameters& p = state.parameters;
  const VecView diagonal = c.air_diagonal.view(), cross_terms = c.air_cross.view(),
                push = c.air_push.view();
  const int *fan_start = c.fan_start.data(), *fan = c.fan_entry.data(), *corner = c.corner.data();
  const Corners corners = corners_of(c);
  const float* share = c.air_share.data();
  const float half = 0.5f * p.air_density, normal_drag = half * p.cloth_drag,
              tangential_drag = half * p.cloth_friction;
  const WindNow wind = state.wind;
  const AirDrag drag = air_drag_of(state);
  parallel_for(
      state.queue, "wind on cloth", c.vertices, DRENCH_LAMBDA(int i) {
        const Vec3<float> air = wind_at(wind, position[i]);
        Vec3<float> d{0.f, 0.f, 0.f}, m{0.f, 0.f, 0.f};
        for (int k = fan_start[i]; k < fan_start[i + 1]; ++k) {
          const int* v = corner + 3 * (fan[k] / 3);
          const int first = 3 * (fan[k] / 3);
          const Vec3<float> a = corners.at(position, first);
          const Vec3<float> twice =
              cross(corners.at(position, first + 1) - a, corners.at(position, first + 2) - a);
          const float size = length(twice);  // twice the area
          const Vec3<float> n = twice * (1.f / maximum(size, 1e-20f));
          const Vec3<float> u =
              air - (velocity[v[0]] + velocity[v[1]] + velocity[v[2]]) * (1.f / 3.f);
          const float third = share[i] * size * (1.f / 6.f), along = dot(u, n);
          const float friction = third * tangential_drag * length(u);
          const float both = third * normal_drag * fabsf(along) - friction;
          d = d + Vec3<float>{friction + both * n.x * n.x, friction + both * n.y * n.y,
                              friction + both * n.z * n.z};
          m = m + Vec3<float>{n.x * n.y, n.y * n.z, n.z * n.x} * both;
        }
        diagonal.set(i, d), cross_terms.set(i, m);
        push.set(i, drag.times(i, air - velocity[i]));
      });
}

void wind_on_cloth(State& state) {
  blow_at_cloth(state, state.cloth.position.view(), state.cloth.velocity.view());
}

void wind_on_fluid(State& state) {
  FluidState& f = state.fluid;
  const Parameters& p = state.parameters;
  const ConstVecView x = f.position.view();
  const VecView v = f.velocity.view();
  const float* density = f.density.data();
  const Float4* wall = state.pressure.wall.data();
  const NeighbourView list = view_of(state.pressure.lists);
  const DropDrag law = drop_drag_of(p);
  const WindNow wind = state.wind;
  const Vec3<float> period = periods_of(p);
  const float rest = 1.f / p.rest_density;
  const float step = float(state.dt) * 0.5f * p.air_density * p.fluid_drag / p.particle_mass;
  parallel_for(
      state.queue, "wind on fluid", f.count, DRENCH_LAMBDA(int i) {
        const Vec3<float> u = wind_at(wind, x[i]) - v[i];
        const float speed = length(u);
        if (!(speed > 1e-6f)) return;
        const Vec3<float> direction = u * (1.f / speed);
        float shelter = 0.f;
        const size_t end = list.end(i);
        for (size_t k = list.first(i); k < end && shelter < 1.f; ++k) {
          const int j = list.index(k);
          if (j == i || !(list.closeness(k) > 0.f)) continue;
          const Vec3<float> d = nearest(x[i] - x[j], period);
          const float size = length(d);
          if (size > 0.f) shelter = maximum(shelter, dot(direction, d) / size);
        }
        const Vec3<float> in{wall[i].x, wall[i].y, wall[i].z};  // towards walls
        const float steep = length(in);
        if (steep > 0.f) shelter = maximum(shelter, -dot(direction, in) / steep);
        shelter = minimum(shelter, 1.f);
        const float rate = step * speed * law.area(speed, density[i] * rest, shelter);
        v.set(i, v[i] + u * (rate / (1.f + rate)));
      });
}

}  // namespace drench::sim::DRENCH_BACKEND
