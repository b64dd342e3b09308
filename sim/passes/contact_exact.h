#pragma once
// Contact between fluid and cloth, mended: once per fluid step an impulse for every particle near a
// sheet, found by a few Jacobi iterations against the velocities both would have at the end of the step,
// and given back to the three vertices by barycentric weights.
//
// Normal impulse: the pressure gradient that belongs to the wall density, taken implicitly,
//     lambda = dt m (a_w - kappa dt v_n),   a_w = p_i rho_0 / rho_i^2 * P_spiky(q)/h,
// or, where that is not enough, what keeps the particle at the contact distance at the end of the step
// (eq 7 with the reduced mass in place of m and no restitution); never negative: cloth does not pull.
// Tangential impulse: eq 8 with the right sign and the Laplacian, over the half-space, implicit as well.
// Jacobi divides by the row sum 1/m + beta sum_k w_k W_k / m_k (W_k: weights of all contacts on vertex k),
// the reduced mass shared among simultaneous contacts, so that it cannot overshoot. beta = (S + 1) / 2S is
// the mean velocity that a steady force gives a free vertex over S substeps, in parts of its last one:
// exact where the sheet moves as a whole, a bound where springs hold a vertex back. Starting from the impulses of the step
// before was tried and dropped: light taut cloth answers them late and flutters (vertex speeds 10 m/s in
// place of 2 m/s under 0.12 m of water on 0.4 kg/m^2).
// A contact so soft that one explicit impulse is within a few percent (the second layer of particles) is
// left alone after the first iteration.

#include "sim/kernels.h"
#include "sim/parallel.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

struct ContactView {
  const int *triangle, *corner;
  const float *weight_b, *weight_c, *edge;
  const int *order, *start;          // contacts by triangle
  const int *fan_start, *fan_entry;  // triangles by vertex

  DRENCH_HD float weight(int i, int k) const {
    return k == 1 ? weight_b[i] : k == 2 ? weight_c[i] : 1.f - weight_b[i] - weight_c[i];
  }
  /// Sum over the corners that meet in a vertex, in a fixed order.
  DRENCH_HD Vec3<float> sum_on_vertex(const VecView& of_corner, int vertex) const {
    Vec3<float> sum{0.f, 0.f, 0.f};
    for (int s = fan_start[vertex]; s < fan_start[vertex + 1]; ++s) sum = sum + of_corner[fan_entry[s]];
    return sum;
  }
  /// Calls f(place in order, corner) for every contact on a vertex, in a fixed order.
  template <class F>
  DRENCH_HD void for_each_on_vertex(int vertex, const F& f) const {
    for (int s = fan_start[vertex]; s < fan_start[vertex + 1]; ++s) {
      const int t = fan_entry[s] / 3, k = fan_entry[s] % 3;
      for (int c = start[t]; c < start[t + 1]; ++c) f(c, k);
    }
  }
};

inline ContactView contacts_of(const State& state) {
  const FluidState& f = state.fluid;
  const ClothState& c = state.cloth;
  return {f.triangle.data(),   c.corner.data(),          f.weight_b.data(),         f.weight_c.data(),
          f.edge.data(),       state.contact.order.data(), state.contact.start.data(), c.fan_start.data(),
          c.fan_entry.data()};
}

/// Sorts the particles in reach of a sheet by triangle: the near list, all that coupling works on.
inline void sort_contacts(State& state) {
  const int triangles = state.cloth.triangles;
  const int* triangle = state.fluid.triangle.data();
  int* key = state.contact.key.data();
  parallel_for("contact: keys", state.fluid.count, DRENCH_LAMBDA(int i) {
    key[i] = triangle[i] >= 0 ? triangle[i] : triangles;
  });
  stable_sort_keys(state.contact.key, state.fluid.count, triangles, state.contact.order,
                   state.contact.start, state.scratch);
  state.contact.near = value_at(state.contact.start, triangles);
}

/// What the solve reads of the particles and the sheet to set a contact up.
struct ContactSetup {
  ContactView contacts;
  VecView velocity, normal;
  const float *distance, *pressure_term, *inverse_density, *half_thickness, *inverse_mass, *vertex_share;
  float beta, dt, mass, rest_density, sound_speed, support_radius, contact_distance, viscosity, push_speed, wall_scale;

  DRENCH_HD void prepare(ContactRow& row) const {
    const int i = row.particle, t = contacts.triangle[i];
    float sum = 1.f / mass;
    for (int k = 0; k < 3; ++k) {
      sum += row.weight[k] * vertex_share[row.vertex[k]] * beta * inverse_mass[row.vertex[k]];
    }
    row.inverse_row = contacts.edge[i] > 0.f ? 1.f / sum : 0.f;  // no force at and beyond a free edge
    row.normal = normal[i];
    row.velocity = velocity[i];
    row.lambda = 0.f;
    row.drag = row.change = {0.f, 0.f, 0.f};

    const float inverse_h = 1.f / support_radius;
    const float gap = max0(distance[i] - half_thickness[t]), q = minimum(gap * inverse_h, 1.f);
    const float layer = contacts.edge[i] * rest_density, push_term = layer * pressure_term[i];
    const float share = layer * inverse_density[i] * inverse_density[i];
    const float push = push_term * spiky_plane(q) * inverse_h;
    const float density_slope = pressure_term[i] > 0.f ? wall_scale * sound_speed * sound_speed * rest_density * spiky_plane(q) : 0.f;
    const float kappa = inverse_h * inverse_h *
                        (share * density_slope * spiky_plane(q) + push_term * spiky_plane_slope(q));
    row.pressure_target = dt * mass * push;
    row.pressure_rate = dt * dt * mass * kappa;
    row.pressure_scale = 1.f / (1.f + row.pressure_rate * sum);
    const float depth = contact_distance + half_thickness[t] - distance[i];
    row.least = depth > 0.f ? minimum(0.2f * depth / dt, push_speed) : depth / dt;
    row.drag_rate = dt * mass * viscosity * share * viscosity_halfspace(q) * inverse_h * inverse_h;
    row.drag_scale = 1.f / (1.f + row.drag_rate * sum);
    row.soft = row.least < -0.25f * sound_speed && maximum(row.pressure_rate, row.drag_rate) * sum < 0.1f;
  }
};

/// One Jacobi update of a contact against the predicted vertices; they take theirs afterwards.
DRENCH_HD void update_contact(ContactRow& row, const VecView& predicted, float inverse_mass, float relaxation) {
  const Vec3<float> sheet = predicted[row.vertex[0]] * row.weight[0] + predicted[row.vertex[1]] * row.weight[1] +
                            predicted[row.vertex[2]] * row.weight[2];
  const Vec3<float> relative = row.velocity - sheet;
  const float approach = dot(row.normal, relative);
  const Vec3<float> slip = relative - row.normal * approach;
  const float by_pressure = (row.pressure_target - row.pressure_rate * approach - row.lambda) * row.pressure_scale;
  const float by_contact = (row.least - approach) * row.inverse_row;
  const float lambda = max0(row.lambda + relaxation * maximum(by_pressure, by_contact));
  const Vec3<float> hold = (slip * -row.drag_rate - row.drag) * row.drag_scale;
  row.change = row.normal * (lambda - row.lambda) + hold;
  row.lambda = lambda;
  row.drag = row.drag + hold;
  row.velocity = row.velocity + row.change * inverse_mass;
}

/// Iterations of the Jacobi solve. The row sum bounds every mode, so all but the last may go nearly twice as
/// far. A pool of 0.3 m on 0.4 kg/m^2: 4 plain iterations left 18,413 particles to the path test in half a
/// second, 12 plain ones 2, these 6 left 3.
constexpr int contact_iterations = 6;
constexpr float over_relaxation = 1.8f;

inline ContactSetup contact_setup(State& state) {
  FluidState& f = state.fluid;
  ClothState& c = state.cloth;
  const Parameters& p = state.parameters;
  const float beta = 0.5f * float(state.substeps + 1) / float(state.substeps);
  return {contacts_of(state), f.velocity.view(), f.normal.view(), f.sheet_distance.data(), f.pressure_term.data(),
          f.inverse_density.data(), c.half_thickness.data(), c.inverse_mass.data(), c.share.data(), beta,
          float(state.dt), p.particle_mass, p.rest_density, p.sound_speed, p.support_radius,
          0.5f * p.spacing, p.dynamic_viscosity, 0.01f * p.sound_speed, p.wall_scale};
}

/// What the contacts of a triangle give to its corners, added up in their order.
struct CornerSums {
  Vec3<float> impulse[3] = {};  // kg m/s, on the particles
  float weight[3] = {};

  DRENCH_HD void add(const ContactRow& row) {
    for (int k = 0; k < 3; ++k) {
      impulse[k] = impulse[k] + row.change * row.weight[k];
      weight[k] += row.weight[k];
    }
  }
};

/// Rows of the near list; the vertices receive what the path test took from particles.
inline void start_contacts(State& state) {
  ClothState& c = state.cloth;
  const ContactView contacts = contacts_of(state);
  ContactRow* rows = state.contact.rows.data();
  const VecView owed = state.fluid.owed.view(), force = c.force.view(), impulse = state.contact.impulse.view();
  float* weight = state.contact.weight.data();
  parallel_for("contact: start", c.triangles, DRENCH_LAMBDA(int t) {
    CornerSums sums;
    for (int k = contacts.start[t]; k < contacts.start[t + 1]; ++k) {
      ContactRow& row = rows[k];
      row.particle = contacts.order[k];
      for (int corner = 0; corner < 3; ++corner) {
        row.vertex[corner] = contacts.corner[3 * t + corner];
        row.weight[corner] = contacts.weight(row.particle, corner);
      }
      row.change = owed[row.particle];
      owed.set(row.particle, {0.f, 0.f, 0.f});
      sums.add(row);
    }
    for (int k = 0; k < 3; ++k) impulse.set(3 * t + k, sums.impulse[k]), weight[3 * t + k] = sums.weight[k];
  });
  float* share = c.share.data();
  const float inverse_dt = 1.f / float(state.dt);
  parallel_for("contact: weights by vertex", c.vertices, DRENCH_LAMBDA(int v) {
    float weights = 0.f;
    for (int s = contacts.fan_start[v]; s < contacts.fan_start[v + 1]; ++s) weights += weight[contacts.fan_entry[s]];
    force.set(v, contacts.sum_on_vertex(impulse, v) * -inverse_dt);
    share[v] = weights;
  });
}

inline void solve_contacts(State& state) {
  if (state.contact.near == 0) return;
  ClothState& c = state.cloth;
  const ContactSetup setup = contact_setup(state);
  const ContactView contacts = setup.contacts;
  ContactRow* rows = state.contact.rows.data();
  const VecView predicted = c.predicted.view(), force = c.force.view(), velocity = state.fluid.velocity.view(),
                impulse = state.contact.impulse.view();
  const float *inverse_mass = c.inverse_mass.data(), *share = c.share.data(), inverse_dt = 1.f / float(state.dt);
  parallel_for("contact: prepare", state.contact.near, DRENCH_LAMBDA(int k) { setup.prepare(rows[k]); });
  for (int iteration = 0; iteration < contact_iterations; ++iteration) {
    const float relaxation = iteration + 1 < contact_iterations ? over_relaxation : 1.f;
    parallel_for("contact: particles", c.triangles, DRENCH_LAMBDA(int t) {
      const int begin = contacts.start[t], end = contacts.start[t + 1];
      if (begin == end) return;
      CornerSums sums;
      for (int k = begin; k < end; ++k) {
        ContactRow& row = rows[k];
        if (row.inverse_row == 0.f || (row.soft && iteration > 0)) continue;
        update_contact(row, predicted, 1.f / setup.mass, row.soft ? 1.f : relaxation);
        sums.add(row);
      }
      for (int k = 0; k < 3; ++k) impulse.set(3 * t + k, sums.impulse[k]);
    });
    // Reaction shared by barycentric weights (eqs 10, 11 mended), gathered in a fixed order.
    parallel_for("contact: vertices", c.vertices, DRENCH_LAMBDA(int v) {
      if (share[v] == 0.f) return;
      const Vec3<float> sum = contacts.sum_on_vertex(impulse, v);
      predicted.set(v, predicted[v] - sum * (setup.beta * inverse_mass[v]));
      force.set(v, force[v] - sum * inverse_dt);
    });
  }
  parallel_for("contact: velocities", state.contact.near,
               DRENCH_LAMBDA(int k) { velocity.set(rows[k].particle, rows[k].velocity); });
}

}  // namespace drench::sim::DRENCH_BACKEND
