#pragma once
// Contact between fluid and cloth, mended: once per fluid step an impulse for every particle near a
// sheet, found by a few Jacobi iterations against the velocities both would have at the end of the step,
// and given back to the three vertices by barycentric weights.
//
// Normal impulse: the pressure gradient that belongs to the wall density, taken implicitly,
//     lambda = dt m (a_w - kappa dt v_n),   a_w = 2 p_i rho_0 / rho_i^2 * P_spiky(q)/h,
// or, where that is not enough, what keeps the particle at the contact distance at the end of the step
// (eq 7 with the reduced mass in place of m and no restitution); never negative: cloth does not pull.
// Tangential impulse: eq 8 with the right sign and the Laplacian, over the half-space, implicit as well.
// Jacobi divides by the row sum 1/m + beta sum_k w_k W_k / m_k (W_k: weights of all contacts on vertex k),
// the reduced mass shared among simultaneous contacts, so that it cannot overshoot. beta = (S + 1) / 2S is
// the mean velocity that a steady force gives a free vertex over S substeps, in parts of its last one:
// exact where the sheet moves as a whole, a bound where springs hold a vertex back. Starting from the impulses of the step
// before was tried and dropped: light taut cloth answers them late and flutters (vertex speeds 10 m/s in
// place of 2 m/s under 0.12 m of water on 0.4 kg/m^2).

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
  /// Calls f(particle, weight) for every contact on a vertex, in a fixed order.
  template <class F>
  DRENCH_HD void for_each_on_vertex(int vertex, const F& f) const {
    for (int s = fan_start[vertex]; s < fan_start[vertex + 1]; ++s) {
      const int t = fan_entry[s] / 3, k = fan_entry[s] % 3;
      for (int c = start[t]; c < start[t + 1]; ++c) f(order[c], weight(order[c], k));
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

struct ContactSolve {
  ContactView contacts;
  VecView velocity, normal, drag, impulse, owed;
  const float *distance, *pressure, *inverse_density, *half_thickness;
  float* lambda;
  VecView predicted;
  const float *inverse_mass, *vertex_share;
  float relaxation, beta, dt, mass, rest_density, sound_speed2, support_radius, contact_distance, viscosity, push_speed;

  /// One Jacobi update of particle i; the vertices take theirs in gather().
  DRENCH_HD void update(int i) const {
    const int t = contacts.triangle[i];
    impulse.set(i, {0.f, 0.f, 0.f});
    if (contacts.edge[i] <= 0.f) return;
    const Vec3<float> n = normal[i];
    Vec3<float> cloth_velocity{0.f, 0.f, 0.f};
    float row = 1.f / mass;
    for (int k = 0; k < 3; ++k) {
      const int vertex = contacts.corner[3 * t + k];
      const float w = contacts.weight(i, k);
      cloth_velocity = cloth_velocity + predicted[vertex] * w;
      row += w * vertex_share[vertex] * beta * inverse_mass[vertex];
    }
    const Vec3<float> relative = velocity[i] - cloth_velocity;
    const float approach = dot(n, relative);
    const Vec3<float> slip = relative - n * approach;

    const float edge = contacts.edge[i], inverse_h = 1.f / support_radius;
    const float gap = max0(distance[i] - half_thickness[t]), q = minimum(gap * inverse_h, 1.f);
    const float share = edge * rest_density * inverse_density[i] * inverse_density[i];
    const float push = 2.f * share * pressure[i] * spiky_plane(q) * inverse_h;
    const float density_slope = pressure[i] > 0.f ? sound_speed2 * rest_density * poly6_plane(q) : 0.f;
    const float kappa = 2.f * share * inverse_h * inverse_h *
                        (density_slope * spiky_plane(q) + pressure[i] * spiky_plane_slope(q));
    const float before = lambda[i];
    const float by_pressure = (dt * mass * (push - kappa * dt * approach) - before) /
                              (1.f + dt * dt * mass * kappa * row);

    const float depth = contact_distance + half_thickness[t] - distance[i];
    const float least = depth > 0.f ? minimum(0.2f * depth / dt, push_speed) : depth / dt;
    const float by_contact = (least - approach) / row;
    const float after = max0(before + relaxation * maximum(by_pressure, by_contact));
    lambda[i] = after;

    const float rate = dt * mass * viscosity * share * viscosity_halfspace(q) * inverse_h * inverse_h;
    const Vec3<float> hold = (slip * -rate - drag[i]) * (1.f / (1.f + rate * row));
    drag.set(i, drag[i] + hold);
    const Vec3<float> change = n * (after - before) + hold;
    velocity.set(i, velocity[i] + change * (1.f / mass));
    impulse.set(i, change);
  }

  DRENCH_HD void start(int i) const {
    lambda[i] = 0.f;
    drag.set(i, {0.f, 0.f, 0.f});
    impulse.set(i, owed[i]);
    owed.set(i, {0.f, 0.f, 0.f});
  }
};

/// Iterations of the Jacobi solve. The row sum bounds every mode, so all but the last may go nearly twice as
/// far. A pool of 0.3 m on 0.4 kg/m^2: 4 plain iterations left 18,413 particles to the path test in half a
/// second, 12 plain ones 2, these 6 left 3.
constexpr int contact_iterations = 6;
constexpr float over_relaxation = 1.8f;

inline ContactSolve contact_solve(State& state) {
  FluidState& f = state.fluid;
  ClothState& c = state.cloth;
  const Parameters& p = state.parameters;
  return {contacts_of(state), f.velocity.view(), f.normal.view(), f.drag.view(), f.impulse.view(),
          f.owed.view(), f.sheet_distance.data(), f.pressure.data(), f.inverse_density.data(),
          c.half_thickness.data(), f.lambda.data(), c.predicted.view(), c.inverse_mass.data(),
          c.share.data(), 1.f, 0.5f * (state.substeps + 1) / state.substeps, float(state.dt), p.particle_mass, p.rest_density, p.sound_speed * p.sound_speed,
          p.support_radius, 0.5f * p.spacing, p.dynamic_viscosity, 0.01f * p.sound_speed};
}

/// Clears what the solve accumulates; the vertices receive what the path test took from particles.
inline void start_contacts(State& state) {
  ClothState& c = state.cloth;
  const ContactSolve solve = contact_solve(state);
  const ContactView contacts = solve.contacts;
  const VecView impulse = state.fluid.impulse.view(), force = c.force.view();
  parallel_for("contact: start", state.contact.near, DRENCH_LAMBDA(int k) { solve.start(contacts.order[k]); });
  float* share = c.share.data();
  const float inverse_dt = 1.f / float(state.dt);
  parallel_for("contact: weights by vertex", c.vertices, DRENCH_LAMBDA(int v) {
    Vec3<float> sum{0.f, 0.f, 0.f};
    float weights = 0.f;
    contacts.for_each_on_vertex(v, [&](int i, float w) { sum = sum + impulse[i] * w, weights += w; });
    force.set(v, sum * -inverse_dt);
    share[v] = weights;
  });
}

inline void solve_contacts(State& state) {
  ClothState& c = state.cloth;
  ContactSolve solve = contact_solve(state);
  const ContactView contacts = solve.contacts;
  const VecView impulse = state.fluid.impulse.view(), predicted = c.predicted.view(), force = c.force.view();
  const float* inverse_mass = c.inverse_mass.data();
  const float inverse_dt = 1.f / float(state.dt);
  if (state.contact.near == 0) return;
  for (int iteration = 0; iteration < contact_iterations; ++iteration) {
    solve.relaxation = iteration + 1 < contact_iterations ? over_relaxation : 1.f;
    parallel_for("contact: particles", state.contact.near,
                 DRENCH_LAMBDA(int k) { solve.update(contacts.order[k]); });
    // Reaction shared by barycentric weights (eqs 10, 11 mended), gathered in a fixed order.
    parallel_for("contact: vertices", c.vertices, DRENCH_LAMBDA(int v) {
      Vec3<float> sum{0.f, 0.f, 0.f};
      contacts.for_each_on_vertex(v, [&](int i, float w) { sum = sum + impulse[i] * w; });
      predicted.set(v, predicted[v] - sum * (solve.beta * inverse_mass[v]));
      force.set(v, force[v] - sum * inverse_dt);
    });
  }
}

}  // namespace drench::sim::DRENCH_BACKEND
