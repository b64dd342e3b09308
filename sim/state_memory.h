#pragma once
// What the columns of a state take, group by group.

#include "sim/solver.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

template <class T>
size_t bytes_of(const Column<T>& column) {
  return column.capacity() * sizeof(T);
}
inline size_t bytes_of(const VecColumn& c) { return bytes_of(c.x) + bytes_of(c.y) + bytes_of(c.z); }

template <class... Columns>
ColumnMemory memory_of(const char* name, const Columns&... column) {
  return {name, (size_t(0) + ... + bytes_of(column))};
}

inline void add_fluid_memory(const State& state, std::vector<ColumnMemory>& all) {
  const FluidState& f = state.fluid;
  const PressureState& p = state.pressure;
  const ViscosityState& v = state.viscosity;
  all.push_back(memory_of("position, velocity, id", f.position, f.velocity, f.id));
  all.push_back(memory_of("acceleration", f.acceleration));
  all.push_back(memory_of("density and pressure", f.density, f.pressure_term, f.inverse_density));
  all.push_back(memory_of("cells and sorting", f.cell, f.order, f.cell_start, state.swap_float,
                          state.scratch.histogram, state.scratch.order_in, state.scratch.key_out,
                          state.scratch.bytes));
  all.push_back(
      memory_of("neighbour lists", p.lists.block, p.lists.base, p.lists.begin, p.lists.blocks));
  all.push_back(memory_of("rows of the pressure solve", p.place, p.scratch_a, p.wall, p.correction,
                          p.correction_cross, p.scratch_b, p.mean_displacement));
  all.push_back(memory_of("unknowns of the pressure solve", p.inverse_diagonal, p.source, p.before,
                          p.next, p.product, p.control));
  all.push_back(memory_of("coarse levels of the pressure solve", p.hierarchy.partial,
                          p.hierarchy.answer, p.hierarchy.inverse));
  all.push_back(memory_of("implicit viscosity", v.solution, v.residual, v.direction, v.product,
                          v.diagonal, v.cross, v.control));
  all.push_back(memory_of("drag of obstacles and sheets", v.body_rate, v.body_cross, v.body_source,
                          state.cloth.no_slip, state.cloth_system.drag_factor));
  all.push_back(memory_of("surface tension", state.tension.normal));
  all.push_back(memory_of("contact angles", state.tension.wetting, state.cloth.wetting));
  all.push_back(memory_of("remembered sides", f.memory_triangle, f.memory_side, f.owed));
  all.push_back(memory_of("nearest triangles", f.triangle, f.far_by, f.weight_b, f.weight_c,
                          f.normal, f.sheet_distance, f.plane, f.edge, f.shaded, f.cloth_share));
  all.push_back(memory_of("paths", f.impulse, f.end, f.start, f.drift, f.moved, f.held, f.stopped));
}

inline void add_cloth_memory(const State& state, std::vector<ColumnMemory>& all) {
  const ClothState& c = state.cloth;
  const ClothSystem& s = state.cloth_system;
  const ContactState& t = state.contact;
  all.push_back(memory_of("rows of sheets", t.key, t.order, t.start, t.particle, t.vertex, t.weight,
                          t.change, t.normal, t.velocity, t.drag, t.inverse_row, t.pressure_target,
                          t.pressure_rate, t.pressure_scale, t.least, t.drag_rate, t.drag_scale,
                          t.lambda, t.gradient, t.recovery, t.compliance, t.gap, t.open,
                          t.rate_along, t.rate_across, t.impulse, t.guarded, t.guard_start));
  all.push_back(memory_of("sheets", c.position, c.velocity, c.mass, c.inverse_mass, c.damping_rate,
                          c.spring_end, c.slot_offset, c.rest_length, c.stiffness, c.spring_damping,
                          c.corner, c.neighbour, c.sheet, c.half_thickness, c.rest_centroid,
                          c.fan_start, c.fan_entry, c.rim, c.next, c.next_velocity, c.start,
                          c.centroid, c.cell, c.order, c.cell_start, c.sorted_low, c.sorted_high,
                          c.sorted_triangle, c.predicted, c.share, c.air_diagonal, c.air_cross,
                          c.air_share, c.air_push, c.force, c.held, c.stop_sum));
  all.push_back(memory_of("implicit step of sheets", s.tension, s.axis, s.inertia, s.factor, s.base,
                          s.right, s.free, s.change, s.answer, s.residual, s.scaled, s.image,
                          s.direction, s.direction_image, s.control));
  all.push_back(memory_of("sheets at obstacles", s.normal, s.grip, s.free_factor, s.slides, s.rub));
}

/// Groups that take anything, in the order of the state.
inline std::vector<ColumnMemory> memory_of(const State& state) {
  std::vector<ColumnMemory> all;
  add_fluid_memory(state, all);
  add_cloth_memory(state, all);
  for (const ObstacleState* o : {&state.obstacles, &state.sinks}) {
    size_t bytes = bytes_of(o->view) + bytes_of(o->stopped);
    for (const ObstacleState::Field& field : o->field)
      bytes += bytes_of(field.block) + bytes_of(field.value);
    all.push_back({o == &state.sinks ? "sinks" : "obstacles", bytes});
  }
  std::erase_if(all, [](const ColumnMemory& one) { return one.bytes == 0; });
  return all;
}

}  // namespace drench::sim::DRENCH_BACKEND
