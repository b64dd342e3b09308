#include "sim/passes/coupling/cloth_side.h"

namespace drench::sim::DRENCH_BACKEND {

void find_cloth_sides(State& state, const ConstVecView& position) {
  FluidState& f = state.fluid;
  const ClothTopology cloth = topology_of(state);
  const VecView normal = f.normal.view();
  int *triangle = f.triangle.data(), *memory_triangle = f.memory_triangle.data(),
      *memory_side = f.memory_side.data(), *shaded = f.shaded.data();
  const float *weight_b = f.weight_b.data(), *weight_c = f.weight_c.data();
  float *distance = f.cloth_distance.data(), *plane = f.plane.data(), *edge = f.edge.data(),
        *cloth_fraction = f.cloth_density.data();
  const float h = state.parameters.support_radius, spacing = state.parameters.spacing,
              scale = state.parameters.wall_scale;
  const float patch = 2.f * h + 2.f * state.cloth.largest_radius;
  // No path crosses a sheet, so that the side is where a particle is seen to be. Layers do go
  // through each other: a particle between two may then have its nearest triangle behind the other
  // layer, on one patch with the last one and with its other side to it. By the memory that is a
  // particle deep in the sheet, which pressure would push through it and collisions hold back, for
  // ever (docs/decisions/0024-side-as-seen.md).
  const bool by_memory = !state.parameters.incompressible;
  parallel_for(
      state.queue, "sheet side", f.count, DRENCH_LAMBDA(int i) {
        const int t = triangle[i];
        normal.set(i, {0.f, 0.f, 0.f});
        distance[i] = 1e30f, edge[i] = 0.f, cloth_fraction[i] = 0.f, shaded[i] = t >= 0;
        plane[i] = t >= 0 ? 1e29f : 1e30f;
        if (t < 0) {
          memory_triangle[i] = -1;
          return;
        }
        const float wb = weight_b[i], wc = weight_c[i], wa = 1.f - wb - wc;
        const FootNormal foot = foot_normal(cloth, t, wa, wb, wc);
        if (foot.free_edge) {
          memory_triangle[i] = -1;
          return;
        }
        Vec3<float> a, b, c;
        cloth.polygons.corners(t, a, b, c);
        Vec3<float> to_particle = position[i] - (a * wa + b * wb + c * wc);
        if (cloth.polygons.periodic) to_particle = nearest(to_particle, cloth.polygons.period);
        const float d = length(to_particle);
        const int seen = dot(to_particle, foot.normal) >= 0.f ? 1 : -1;
        const int old = memory_triangle[i];
        const bool clear = d > 1e-4f * h;  // closer than that the direction is rounding
        const bool remembered =
            (by_memory || !clear) && old >= 0 && cloth.on_one_patch(old, t, patch);
        const int side = remembered ? memory_side[i] : seen;
        // The strip of a seam may not be there in the next step.
        memory_triangle[i] = t < cloth.triangles ? t : -1, memory_side[i] = side;
        const Vec3<float> pseudo =
            foot.normal * (float(side) / maximum(length(foot.normal), 1e-20f));
        const float flip = side == seen ? 1.f : -1.f;
        normal.set(i, clear ? to_particle * (flip / d) : pseudo);
        distance[i] = flip * d;
        plane[i] = distance[i] - dot(normal[i], position[i]);
        edge[i] = edge_weight(cloth, t, wa, wb, wc, spacing);
        cloth_fraction[i] =
            scale * edge[i] *
            spiky_halfspace(minimum(max0(distance[i] - cloth.half_thickness[t]) / h, 1.f));
      });
}

}  // namespace drench::sim::DRENCH_BACKEND
