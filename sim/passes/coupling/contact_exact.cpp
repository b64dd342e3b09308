#include "sim/passes/coupling/contact_exact.h"

#include "sim/passes/coupling/contact_paper.h"

namespace drench::sim::DRENCH_BACKEND {

void sort_contacts(State& state, float reach) {
  const int triangles = state.cloth.triangles;
  const int* triangle = state.fluid.triangle.data();
  const float *distance = state.fluid.sheet_distance.data(),
              *half_thickness = state.cloth.half_thickness.data();
  const float contact_distance = contact_distance_of(state.parameters);
  int* key = state.contact.key.data();
  parallel_for(
      state.queue, "contact: keys", state.fluid.count, DRENCH_LAMBDA(int i) {
        const int t = triangle[i];
        if (t < 0) {
          key[i] = 2 * triangles;
          return;
        }
        key[i] = distance[i] - half_thickness[t] - contact_distance > reach ? triangles + t : t;
      });
  stable_sort_keys(state.queue, state.contact.key, state.fluid.count, 2 * triangles,
                   state.contact.order, state.contact.start);
  state.contact.near = value_at(state.contact.start, 2 * triangles);
  state.contact.close = value_at(state.contact.start, triangles);
}

void sort_exact_contacts(State& state) {
  // Faster than a quarter of the speed of sound nothing should come near.
  sort_contacts(state, 0.25f * state.parameters.sound_speed * float(state.dt));
}

namespace {

ContactSetup contact_setup(State& state) {
  FluidState& f = state.fluid;
  ClothState& c = state.cloth;
  const Parameters& p = state.parameters;
  const float beta = 0.5f * float(state.substeps + 1) / float(state.substeps);
  return {.near = near_list(state),
          .velocity = f.velocity.view(),
          .normal = f.normal.view(),
          .distance = f.sheet_distance.data(),
          .pressure_term = f.pressure_term.data(),
          .inverse_density = f.inverse_density.data(),
          .half_thickness = c.half_thickness.data(),
          .inverse_mass = c.inverse_mass.data(),
          .contact_weight = c.share.data(),
          .beta = beta,
          .dt = float(state.dt),
          .mass = p.particle_mass,
          .rest_density = p.rest_density,
          .sound_speed = p.sound_speed,
          .support_radius = p.support_radius,
          .contact_distance = contact_distance_of(p),
          .viscosity = p.dynamic_viscosity,
          .push_speed = 0.01f * p.sound_speed,
          .wall_scale = p.wall_scale};
}

}  // namespace

void sum_by_triangle(State& state, Rows which, IdleCorners idle) {
  const ContactRows c = contact_rows(state);
  const ConstVecView given = state.contact.change.view();
  const int triangles = state.cloth.triangles, *start = state.contact.start.data();
  const VecView impulse = state.contact.impulse.view();
  const int last = which == Rows::all ? 1 : 0, gap = c.soft_begin - c.close;
  const bool skip = which == Rows::close && idle == IdleCorners::zero;
  parallel_for(
      state.queue, "contact: triangles", triangles, DRENCH_LAMBDA(int t) {
        if (skip && start[t] == start[t + 1]) return;
        Vec3<float> sum[3] = {};
        for (int soft = 0; soft <= last; ++soft) {
          const int k = t + soft * triangles;
          for (int row = start[k] + soft * gap; row < start[k + 1] + soft * gap; ++row) {
            const Vec3<float> change = given[row];
            for (int e = 0; e < 3; ++e) sum[e] = sum[e] + change * c.weight[e][row];
          }
        }
        for (int e = 0; e < 3; ++e) impulse.set(3 * t + e, sum[e]);
      });
}

void start_contacts(State& state) {
  ClothState& cloth = state.cloth;
  ContactState& contact = state.contact;
  const ContactRows c = contact_rows(state);
  const NearView near = near_list(state);
  int *particle = contact.particle.data(), *vertex = contact.vertex.data();
  float* weight = contact.weight.data();
  const VecView change = contact.change.view();
  const int stride = contact.stride;
  const ConstVecView owed = state.fluid.owed.view();
  const VecView force = cloth.force.view();
  const bool owes = state.owes;
  parallel_for(
      state.queue, "contact: rows", (c.rows + 7) / 8 * 8, DRENCH_LAMBDA(int row) {
        const int index = c.index_in_list(row), i = index < 0 ? -1 : near.order[index];
        particle[row] = i;
        for (int k = 0; k < 3; ++k) {
          vertex[k * stride + row] = i < 0 ? 0 : near.corner[3 * near.triangle[i] + k];
          weight[k * stride + row] = i < 0 ? 0.f : near.weight(i, k);
        }
        if (owes) change.set(row, i < 0 ? Vec3<float>{0.f, 0.f, 0.f} : owed[i]);
      });
  const ConstVecView impulse = state.contact.impulse.view();
  if (owes) {
    sum_by_triangle(state, Rows::all);
    state.fluid.owed.clear(state.queue);
    state.owes = false;
  }
  float* contact_weight = cloth.share.data();
  const float inverse_dt = 1.f / float(state.dt);
  const int gap = c.soft_begin - c.close, triangles = cloth.triangles;
  parallel_for(
      state.queue, "contact: weights by vertex", cloth.vertices, DRENCH_LAMBDA(int v) {
        float weights = 0.f;
        near.for_each_corner(v, [&](int t, int e) {
          for (int row = near.start[t]; row < near.start[t + 1]; ++row) weights += c.weight[e][row];
          const int k = t + triangles;
          for (int row = near.start[k] + gap; row < near.start[k + 1] + gap; ++row)
            weights += c.weight[e][row];
        });
        force.set(v,
                  owes ? near.sum_on_vertex(impulse, v) * -inverse_dt : Vec3<float>{0.f, 0.f, 0.f});
        contact_weight[v] = weights;
      });
}

void solve_contacts(State& state) {
  if (state.contact.near == 0) return;
  ClothState& cloth = state.cloth;
  const ContactSetup setup = contact_setup(state);
  const ExactContacts c = exact_contacts(state);
  const NearView near = setup.near;
  const VecView predicted = cloth.predicted.view(), force = cloth.force.view(),
                velocity = state.fluid.velocity.view();
  const ConstVecView impulse = state.contact.impulse.view();
  const float *inverse_mass = cloth.inverse_mass.data(), *contact_weight = cloth.share.data();
  const float inverse_dt = 1.f / float(state.dt), inverse_particle_mass = 1.f / setup.mass;
  for_each_lane(
      state.queue, "contact: prepare", c.list.rows,
      DRENCH_LAMBDA(auto row) { setup.prepare(c, row); });
  for_each_lane(
      state.queue, "contact: soft", c.list.rows - c.list.soft_begin, DRENCH_LAMBDA(auto row) {
        update_contact(c, row + c.list.soft_begin, predicted, inverse_particle_mass, 1.f);
      });
  for (int iteration = 0; iteration < contact_iterations; ++iteration) {
    const float relaxation = iteration + 1 < contact_iterations ? over_relaxation : 1.f;
    for_each_lane(
        state.queue, "contact: particles", c.list.close, DRENCH_LAMBDA(auto row) {
          update_contact(c, row, predicted, inverse_particle_mass, relaxation);
        });
    sum_by_triangle(state, iteration == 0 ? Rows::all : Rows::close,
                    iteration > 1 ? IdleCorners::zero : IdleCorners::unset);
    // Reaction shared by barycentric weights (eqs 10, 11 mended), gathered in a fixed order.
    parallel_for(
        state.queue, "contact: vertices", cloth.vertices, DRENCH_LAMBDA(int v) {
          if (contact_weight[v] == 0.f) return;
          const Vec3<float> sum = near.sum_on_vertex(impulse, v);
          predicted.set(v, predicted[v] - sum * (setup.beta * inverse_mass[v]));
          force.set(v, force[v] - sum * inverse_dt);
        });
  }
  parallel_for(
      state.queue, "contact: velocities", c.list.rows, DRENCH_LAMBDA(int row) {
        if (c.list.particle[row] >= 0) velocity.set(c.list.particle[row], c.velocity[row]);
      });
}

void find_nearest_centroids(State& state) {
  FluidState& f = state.fluid;
  const PolygonView polygons = polygons_of(state);
  const ConstVecView position = f.position.view();
  const VecView normal = f.normal.view();
  int* triangle = f.triangle.data();
  float *weight_b = f.weight_b.data(), *weight_c = f.weight_c.data(),
        *distance = f.sheet_distance.data(), *edge = f.edge.data(),
        *fraction = f.cloth_share.data();
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
  const float *distance = f.sheet_distance.data(), *inverse_density = f.inverse_density.data();
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
