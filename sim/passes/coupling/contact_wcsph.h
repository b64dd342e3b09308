#pragma once
// Contact between fluid and cloth, mended: once per fluid step an impulse for every particle near a
// sheet, found by a few Jacobi iterations against the velocities both would have at the end of the
// step, and given back to the three vertices by barycentric weights.
//
// Normal impulse: the pressure gradient that belongs to the wall density, taken implicitly,
//     lambda = dt m (a_w - kappa dt v_n),   a_w = p_i rho_0 / rho_i^2 * P_spiky(q)/h,
// or, where that is not enough, what keeps the particle at the contact distance at the end of the
// step (eq 7 with the reduced mass in place of m and no restitution); never negative: cloth does
// not pull. Tangential impulse: eq 8 with the right sign and the Laplacian, over the half-space,
// implicit as well. Jacobi divides by the row sum 1/m + beta sum_k w_k W_k / m_k (W_k: weights of
// all contacts on vertex k), the reduced mass shared among simultaneous contacts, so that it cannot
// overshoot. beta = (S + 1) / 2S is the mean velocity that a steady force gives a free vertex over
// S substeps, in parts of its last one: exact where the sheet moves as a whole, a bound where
// springs hold a vertex back. Impulses start at zero
// (docs/decisions/0020-impulses-start-at-zero.md). A contact too far off to be reached within the
// step (the second layer of particles) has a soft pressure alone: it is solved once, implicitly,
// before the first iteration.

#include "sim/neighbours/sph_kernels.h"
#include "sim/passes/coupling/contact_rows.h"

namespace drench::sim::DRENCH_BACKEND {

/// What the solve of the exact coupling keeps of every row.
struct ExactContacts {
  ContactRows list;
  VecView normal, velocity, drag, change;
  float *inverse_row, *pressure_target, *pressure_rate, *pressure_scale, *least, *drag_rate,
      *drag_scale, *lambda;
};

inline ExactContacts exact_contacts(State& state) {
  ContactState& c = state.contact;
  return {.list = contact_rows(state),
          .normal = c.normal.view(),
          .velocity = c.velocity.view(),
          .drag = c.drag.view(),
          .change = c.change.view(),
          .inverse_row = c.inverse_row.data(),
          .pressure_target = c.pressure_target.data(),
          .pressure_rate = c.pressure_rate.data(),
          .pressure_scale = c.pressure_scale.data(),
          .least = c.least.data(),
          .drag_rate = c.drag_rate.data(),
          .drag_scale = c.drag_scale.data(),
          .lambda = c.lambda.data()};
}

/// What the solve reads of the particles and the sheet to set contacts up.
struct ContactSetup {
  NearView near;
  VecView velocity, normal;
  const float *distance, *pressure_term, *inverse_density, *half_thickness, *inverse_mass,
      *contact_weight;
  float beta, dt, mass, rest_density, sound_speed, support_radius, contact_distance, viscosity,
      push_speed, wall_scale;

  template <class Index>
  DRENCH_HD void prepare(const ExactContacts& c, Index row) const {
    const auto member = load(c.list.particle, row);
    const auto valid = is_index(member);
    const auto i = select(valid, member, same_index(0, member));
    const auto t = load(near.triangle, i);
    using T = decltype(load(distance, i));
    T sum(1.f / mass);
    for (int k = 0; k < 3; ++k) {
      const auto vertex = load(c.list.vertex[k], row);
      sum = sum + load(c.list.weight[k], row) * load(contact_weight, vertex) * T(beta) *
                      load(inverse_mass, vertex);
    }
    const T none(0.f), edge = select(valid, load(near.edge, i), none);
    // No force at and beyond a free edge, where the edge's weight is 0.
    store(c.inverse_row, row, select(edge > none, T(1.f) / sum, none));
    c.normal.put(row, normal.at(i));
    c.velocity.put(row, velocity.at(i));
    c.drag.put(row, Vec3<T>{none, none, none});
    store(c.lambda, row, none);
    const T away = load(distance, i) - load(half_thickness, select(valid, t, same_index(0, t)));
    const T depth = T(contact_distance) - away;
    store(c.least, row,
          select(depth > none, minimum(depth * T(0.2f / dt), T(push_speed)), depth * T(1.f / dt)));

    const T inverse_h(1.f / support_radius), q = minimum(max0(away) * inverse_h, T(1.f));
    const T pressure = load(pressure_term, i), inverse_rho = load(inverse_density, i),
            plane = spiky_plane(q);
    const T layer = edge * T(rest_density), push_term = layer * pressure;
    const T drag_term = layer * inverse_rho * inverse_rho;
    const T slope = select(pressure > none,
                           T(wall_scale * sound_speed * sound_speed * rest_density) * plane, none);
    const T kappa =
        inverse_h * inverse_h * (drag_term * slope * plane + push_term * spiky_plane_slope(q));
    const T rate = T(dt * dt * mass) * kappa;
    store(c.pressure_target, row, T(dt * mass) * push_term * plane * inverse_h);
    store(c.pressure_rate, row, rate);
    store(c.pressure_scale, row, T(1.f) / (T(1.f) + rate * sum));
    const T drag_rate =
        T(dt * mass * viscosity) * drag_term * viscosity_halfspace(q) * inverse_h * inverse_h;
    store(c.drag_rate, row, drag_rate);
    store(c.drag_scale, row, T(1.f) / (T(1.f) + drag_rate * sum));
  }
};

/// One Jacobi update of a contact against the predicted vertices; they take theirs afterwards.
template <class Index>
DRENCH_HD void update_contact(const ExactContacts& c, Index row, const ConstVecView& predicted,
                              float inverse_mass, float relaxation) {
  using T = decltype(load(c.lambda, row));
  const Vec3<T> normal = c.normal.at(row), velocity = c.velocity.at(row), drag = c.drag.at(row);
  const Vec3<T> foot = predicted.at(load(c.list.vertex[0], row)) * load(c.list.weight[0], row) +
                       predicted.at(load(c.list.vertex[1], row)) * load(c.list.weight[1], row) +
                       predicted.at(load(c.list.vertex[2], row)) * load(c.list.weight[2], row);
  const Vec3<T> relative = velocity - foot;
  const T approach = dot(normal, relative), old = load(c.lambda, row), none(0.f);
  const Vec3<T> slip = relative - normal * approach;
  const T by_pressure =
      (load(c.pressure_target, row) - load(c.pressure_rate, row) * approach - old) *
      load(c.pressure_scale, row);
  const T inverse_row = load(c.inverse_row, row),
          by_contact = (load(c.least, row) - approach) * inverse_row;
  const T lambda = max0(old + T(relaxation) * maximum(by_pressure, by_contact));
  const Vec3<T> hold = (slip * -load(c.drag_rate, row) - drag) * load(c.drag_scale, row);
  const Vec3<T> still{none, none, none};
  const auto active = inverse_row > none;
  const Vec3<T> change = select(active, normal * (lambda - old) + hold, still);
  store(c.lambda, row, select(active, lambda, none));
  c.drag.put(row, select(active, drag + hold, still));
  c.change.put(row, change);
  c.velocity.put(row, velocity + change * T(inverse_mass));
}

/// Iterations of the Jacobi solve. The row sum bounds every mode, so all but the last may go nearly
/// twice as far, which halves their number (docs/decisions/0021-over-relaxed-contacts.md).
constexpr int contact_iterations = 6;
constexpr float over_relaxation = 1.8f;

/// sort_contacts with the reach of a weakly compressible step, a quarter of the speed of sound.
void sort_wcsph_contacts(State& state);

/// Solves for the impulses of the rows, N s: leaves the particles' velocities after contact, and in
/// ClothState::predicted and ClothState::force what the vertices received.
void solve_contacts(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
