#include "sim/passes/coupling/contact_paper.h"

namespace drench::sim::DRENCH_BACKEND {

void find_nearest_centroids(State& state) {
  FluidState& f = state.fluid;
  const PolygonView polygons = polygons_of(state);
  const ConstVecView position = f.position.view();
  const VecView normal = f.normal.view();
  int* triangle = f.triangle.data();
  float *weight_b = f.weight_b.data(), *weight_c = f.weight_c.data(),
        *distance = f.cloth_distance.data(), *edge = f.edge.data(),
        *fraction = f.cloth_density.data();
  const WallTable table{state.wall_table};
  const float h = state.parameters.support_radius, spacing = state.parameters.spacing;
  const Vec3<float> low = state.cloth.low, high = state.cloth.high;
  const float reach = 1.f / polygons.grid.inverse_edge.x;
  parallel_for(
      state.queue, "paper: nearest centroid", f.count, DRENCH_LAMBDA(int i) {
        const Vec3<float> p = position[i];
        triangle[i] = -1, edge[i] = 0.f, fraction[i] = 0.f, distance[i] = 1e30f;
        normal.set(i, {0.f, 0.f, 0.f});
        if (p.x < low.x - reach || p.x > high.x + reach || p.y < low.y - reach ||
            p.y > high.y + reach || p.z < low.z - reach || p.z > high.z + reach) {
          return;
        }
        const GridShape& g = polygons.grid;
        const int cx = g.cell_x(p.x), cy = g.cell_y(p.y), cz = g.cell_z(p.z);
        float best = 1e30f;
        int nearest = -1;
        for (int z = cz > 0 ? cz - 1 : 0; z <= cz + 1 && z < g.nz; ++z) {
          for (int y = cy > 0 ? cy - 1 : 0; y <= cy + 1 && y < g.ny; ++y) {
            const int last = cx + 1 < g.nx ? cx + 1 : g.nx - 1;
            const int end = polygons.cell_start[g.index(last, y, z) + 1];
            for (int k = polygons.cell_start[g.index(cx > 0 ? cx - 1 : 0, y, z)]; k < end; ++k) {
              const int t = polygons.order[k];
              const float d2 = length2(p - polygons.centroid[t]);
              if (d2 < best) best = d2, nearest = t;
            }
          }
        }
        if (nearest < 0) return;
        Vec3<float> a, b, c;
        polygons.corners(nearest, a, b, c);
        const Vec3<float> n = cross(b - a, c - a);
        const float twice_area = maximum(length(n), 1e-20f);
        const float d = dot(n, p - a) / twice_area;
        const float unsigned_d = d < 0.f ? -d : d;
        if (unsigned_d >= h) return;
        triangle[i] = nearest, edge[i] = 1.f, distance[i] = unsigned_d;
        weight_b[i] = weight_c[i] = 1.f / 3.f;  // eq 11: equal thirds
        normal.set(i, n * ((d < 0.f ? -1.f : 1.f) / twice_area));
        fraction[i] =
            spacing / h * table.density(unsigned_d / h);  // eq 9: one layer of particles a apart
      });
}

void add_paper_forces(State& state) {
  FluidState& f = state.fluid;
  const Parameters& p = state.parameters;
  const int *triangle = f.triangle.data(), *corner = state.cloth.corner.data();
  const ConstVecView velocity = f.velocity.view(), normal = f.normal.view();
  const VecView acceleration = f.acceleration.view(), impulse = f.impulse.view();
  const ConstVecView cloth_velocity = state.cloth.velocity.view();
  const float *distance = f.cloth_distance.data(), *inverse_density = f.inverse_density.data();
  const WallTable table{state.wall_table};
  const float h = p.support_radius, spacing = p.spacing, dt = float(state.dt),
              mass = p.particle_mass;
  const float viscosity = p.wall_viscosity * mass / (spacing * spacing * h * h * h);
  parallel_for(
      state.queue, "paper: forces", f.count, DRENCH_LAMBDA(int i) {
        impulse.set(i, {0.f, 0.f, 0.f});
        const int t = triangle[i];
        if (t < 0) return;
        Vec3<float> a = acceleration[i];
        const Vec3<float> wall =
            (cloth_velocity[corner[3 * t]] + cloth_velocity[corner[3 * t + 1]] +
             cloth_velocity[corner[3 * t + 2]]) *
            (1.f / 3.f);
        const float inverse_rho = inverse_density[i];
        const float rate = viscosity * inverse_rho * inverse_rho * table.viscosity(distance[i] / h);
        a = a - (wall - velocity[i]) * rate;
        if (distance[i] < spacing) {
          const Vec3<float> push = normal[i] * ((spacing - distance[i]) / (dt * dt));
          a = a + push;
          impulse.set(i, push * (mass * dt));
        }
        acceleration.set(i, a);
      });
}

void gather_paper_reaction(State& state) {
  ClothState& c = state.cloth;
  const NearView near = near_list(state);
  const ConstVecView impulse = state.fluid.impulse.view();
  const VecView force = c.force.view();
  const float inverse_dt = 1.f / float(state.dt);
  parallel_for(
      state.queue, "paper: reaction", c.vertices, DRENCH_LAMBDA(int v) {
        Vec3<float> sum{0.f, 0.f, 0.f};
        near.for_each_corner(v, [&](int t, int corner) {
          for (int k = near.start[t]; k < near.start[t + 1]; ++k) {
            const int i = near.order[k];
            sum = sum + impulse[i] * near.weight(i, corner);
          }
        });
        force.set(v, sum * -inverse_dt);
      });
}

}  // namespace drench::sim::DRENCH_BACKEND
