#include "sim/passes/viscosity/body_drag.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

/// @param cloth_velocity  of the start of the step, m/s
ClothGaps cloth_gaps(const State& state, const ConstVecView& cloth_velocity) {
  const FluidState& f = state.fluid;
  return {.rows = cloth_rows(state),
          .start = f.start.view(),
          .normal = f.normal.view(),
          .cloth_velocity = cloth_velocity,
          .distance = f.cloth_distance.data(),
          .edge = f.edge.data(),
          .half_thickness = state.cloth.half_thickness.data(),
          .triangle = f.triangle.data(),
          .dt = float(state.dt)};
}

/// Beside sheets: all that brakes, and the sheets' rates.
void set_drag_near_cloth(State& state, const BodyDrag& law) {
  const ClothGaps gaps = cloth_gaps(state, state.cloth.velocity.view());
  const ClothRates rates = cloth_rates(state);
  const ConstVecView velocity = state.cloth.velocity.view();
  const ConstVecView change = state.cloth_system.change.view();
  const float* held = state.parameters.no_slip_sheets ? state.cloth.no_slip.data() : nullptr;
  const Float4* place = state.pressure.place.data();
  ViscosityState& s = state.viscosity;
  Float4 *rate = s.body_rate.data(), *cross = s.body_cross.data(), *source = s.body_source.data();
  parallel_for(
      state.queue, "drag: near sheets", gaps.rows.rows, DRENCH_LAMBDA(int row) {
        const int i = gaps.rows.particle[row];
        rates.along[row] = rates.across[row] = 0.f;
        if (i < 0) return;
        const Vec3<float> x{place[i].x, place[i].y, place[i].z};
        const BesideCloth sheet = gaps.of(row, x);
        WallDrag drag = law.of(x, sheet);
        if (held && held[gaps.triangle[i]] > 0.f && gaps.edge[i] > 0.f) {
          const float along = gaps.edge[i] * law.along(sheet.gap),
                      across = gaps.edge[i] * law.across(sheet.gap);
          rates.along[row] = along, rates.across[row] = across;
          add_surface(
              drag, along, across, sheet.normal,
              gaps.rows.at_foot(row, velocity) + gaps.rows.at_foot(row, change) * law.inverse_dt);
        }
        rate[i] = {drag.rate.x, drag.rate.y, drag.rate.z, 0.f};
        cross[i] = {drag.cross.x, drag.cross.y, drag.cross.z, 0.f};
        source[i] = {drag.source.x, drag.source.y, drag.source.z, 0.f};
      });
}

}  // namespace

void find_body_drag(State& state) {
  const BodyDrag law = body_drag_of(state);
  const Float4* place = state.pressure.place.data();
  const bool sheets = state.contact.near > 0;
  const int* triangle = sheets ? state.fluid.triangle.data() : nullptr;
  ViscosityState& s = state.viscosity;
  Float4 *rate = s.body_rate.data(), *cross = s.body_cross.data(), *source = s.body_source.data();
  parallel_for(
      state.queue, "drag: obstacles", state.fluid.count, DRENCH_LAMBDA(int i) {
        if (triangle && triangle[i] >= 0) return;
        const WallDrag drag = law.of({place[i].x, place[i].y, place[i].z}, BesideCloth{});
        rate[i] = {drag.rate.x, drag.rate.y, drag.rate.z, 0.f};
        cross[i] = {drag.cross.x, drag.cross.y, drag.cross.z, 0.f};
        source[i] = {drag.source.x, drag.source.y, drag.source.z, 0.f};
      });
  if (sheets) set_drag_near_cloth(state, law);
}

Impulse drag_impulse(const State& state, int which) {
  const BodyDrag law = body_drag_of(state);
  const bool solved = viscosity_is_implicit(state.parameters, state.dt);
  const DraggedVelocity velocity{solved ? state.viscosity.solution.data()
                                        : state.pressure.scratch_a.data()};
  const Float4* place = state.pressure.place.data();
  const double mass = state.parameters.particle_mass;
  const bool sheets = state.contact.near > 0;
  const int* triangle = sheets ? state.fluid.triangle.data() : nullptr;
  const ObstacleViews obstacles = state.obstacles.views();
  const Impulse far = parallel_reduce(
      state.queue, "drag: impulse", state.fluid.count, Impulse{},
      DRENCH_LAMBDA(int i) {
        if (triangle && triangle[i] >= 0) return Impulse{};
        WallDrag drag{};
        const Vec3<float> x{place[i].x, place[i].y, place[i].z};
        for (int k = 0; k < obstacles.count; ++k)
          if (obstacles.obstacle[k].of == which)
            law.add_obstacle(obstacles.obstacle[k], x, BesideCloth{}, drag);
        return velocity.on(drag, i, mass);
      },
      Plus{});
  if (!sheets) return far;
  const ClothGaps gaps = cloth_gaps(state, state.cloth.next_velocity.view());  // swapped by now
  const Impulse near = parallel_reduce(
      state.queue, "drag: impulse near sheets", gaps.rows.rows, Impulse{},
      DRENCH_LAMBDA(int row) {
        const int i = gaps.rows.particle[row];
        if (i < 0) return Impulse{};
        const Vec3<float> x{place[i].x, place[i].y, place[i].z};
        WallDrag drag{};
        for (int k = 0; k < obstacles.count; ++k)
          if (obstacles.obstacle[k].of == which)
            law.add_obstacle(obstacles.obstacle[k], x, gaps.of(row, x), drag);
        return velocity.on(drag, i, mass);
      },
      Plus{});
  return far + near;
}

}  // namespace drench::sim::DRENCH_BACKEND
