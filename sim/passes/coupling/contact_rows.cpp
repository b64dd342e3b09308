#include "sim/passes/coupling/contact_rows.h"

namespace drench::sim::DRENCH_BACKEND {

void sort_contacts(State& state, float reach) {
  const int triangles = state.cloth.polygons;
  const int* triangle = state.fluid.triangle.data();
  const float *distance = state.fluid.cloth_distance.data(),
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

void sum_by_triangle(State& state, Rows which, IdleCorners idle) {
  const ContactRows c = contact_rows(state);
  const ConstVecView given = state.contact.change.view();
  const int triangles = state.cloth.polygons, *start = state.contact.start.data();
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
  const int gap = c.soft_begin - c.close, triangles = cloth.polygons;
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

}  // namespace drench::sim::DRENCH_BACKEND
