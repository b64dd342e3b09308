#pragma once
// Contacts of particles and cloth, row by row: a particle, the triangle it is nearest to, and the
// barycentric weights of its foot point, by which the three vertices receive what it loses
// (eqs 10 and 11 with weights in place of thirds). Sorted by triangle, so that sums on triangles
// and then on vertices have a fixed order.

#include "sim/passes/coupling/polygon_grid.h"

namespace drench::sim::DRENCH_BACKEND {

/// The near list and what it lies on.
struct NearView {
  const int *triangle, *corner;
  const float *weight_b, *weight_c, *edge;
  const int *order, *start;          // contacts by triangle
  const int *fan_start, *fan_entry;  // triangles by vertex

  DRENCH_HD float weight(int i, int k) const {
    return k == 1 ? weight_b[i] : k == 2 ? weight_c[i] : 1.f - weight_b[i] - weight_c[i];
  }
  /// Sum over the corners that meet in a vertex, in a fixed order.
  DRENCH_HD Vec3<float> sum_on_vertex(const ConstVecView& of_corner, int vertex) const {
    Vec3<float> sum{0.f, 0.f, 0.f};
    for (int s = fan_start[vertex]; s < fan_start[vertex + 1]; ++s)
      sum = sum + of_corner[fan_entry[s]];
    return sum;
  }
  /// Calls f(triangle, its corner) for every triangle on a vertex, in a fixed order.
  template <class F>
  DRENCH_HD void for_each_corner(int vertex, const F& f) const {
    for (int s = fan_start[vertex]; s < fan_start[vertex + 1]; ++s)
      f(fan_entry[s] / 3, fan_entry[s] % 3);
  }
};

inline NearView near_list(const State& state) {
  const FluidState& f = state.fluid;
  const ClothState& c = state.cloth;
  return {.triangle = f.triangle.data(),
          .corner = c.corner.data(),
          .weight_b = f.weight_b.data(),
          .weight_c = f.weight_c.data(),
          .edge = f.edge.data(),
          .order = state.contact.order.data(),
          .start = state.contact.start.data(),
          .fan_start = polygon_fan_start(c),
          .fan_entry = polygon_fan_entry(c)};
}

/// m, the gap to the sheet's surface that contact keeps.
inline float contact_distance_of(const Parameters& p) { return 0.5f * p.spacing; }

/// Sorts the particles in reach of a sheet by triangle: the near list, all that coupling works on.
/// With `reach`, those farther than that from the contact distance stand behind the others, by
/// triangle as well.
void sort_contacts(State& state, float reach);

/// Contacts row by row: close ones, up to seven empty rows, the soft ones; both in the order of the
/// near list.
struct ContactRows {
  const int *particle, *vertex[3];  // -1: empty
  const float* weight[3];
  int close, soft_begin, rows;  // rows 0..close-1 and soft_begin..rows-1 are contacts

  DRENCH_HD int index_in_list(int row) const {  // -1: empty
    return row < close ? row : row < soft_begin || row >= rows ? -1 : row - soft_begin + close;
  }
  /// The weighted mean of the vertices.
  DRENCH_HD Vec3<float> at_foot(int row, const ConstVecView& of_vertex) const {
    Vec3<float> sum{0.f, 0.f, 0.f};
    for (int k = 0; k < 3; ++k) sum = sum + of_vertex[vertex[k][row]] * weight[k][row];
    return sum;
  }
};

inline ContactRows contact_rows(const State& state) {
  const ContactState& c = state.contact;
  const int *vertex = c.vertex.data(), soft_begin = (c.close + 7) / 8 * 8;
  const float* weight = c.weight.data();
  return {.particle = c.particle.data(),
          .vertex = {vertex, vertex + c.stride, vertex + 2 * c.stride},
          .weight = {weight, weight + c.stride, weight + 2 * c.stride},
          .close = c.close,
          .soft_begin = soft_begin,
          .rows = soft_begin + c.near - c.close};
}

/// Rows of contacts: those in reach within the step, or the soft ones, too.
enum class Rows { close, all };

/// What the corners of a triangle without contacts hold: anything, or the zeros of a sum before.
enum class IdleCorners { unset, zero };

/// Adds up what the contacts of each triangle give to its corners, in their order.
void sum_by_triangle(State& state, Rows which, IdleCorners idle = IdleCorners::unset);

/// Fills the rows of the near list and the weights of contacts by vertex (ClothState::share). The
/// vertices receive what particles owe them (FluidState::owed, kg m/s) as ClothState::force, N.
void start_contacts(State& state);

}  // namespace drench::sim::DRENCH_BACKEND
