#pragma once
// Every column of the state, in one list: allocation, sorting, loading, saving, appending,
// checkpoints, figures of memory and the test of what passes write are made from it. A new column
// is a member of state.h and a line here.

#include "sim/solver.h"
#include "sim/state.h"

namespace drench::sim::DRENCH_BACKEND {

/// How many elements a column has.
enum class Extent {
  particles,
  rows,    // of the near list, up to 23 more than particles
  rows_3,  // a field of rows for each corner
  vertices,
  other,  // what its passes or the topology ask for
};

/// What becomes of a column between steps.
enum class Use {
  kept,     // the next step reads it: sorted with the particles, saved in checkpoints
  sorted,   // the next step reads it, and needs none: not saved
  rebuilt,  // by every step
};

struct ColumnInfo {
  const char *name, *unit;
  ColumnGroup group;
  Extent extent = Extent::other;
  Use use = Use::rebuilt;
  int initial = 0;  // of a new particle
};

/// What no HostState holds.
inline constexpr std::nullptr_t none = nullptr;

template <class S, class Visit>
void for_each_fluid_column(S& state, const Visit& visit) {
  auto& f = state.fluid;
  using enum Extent;
  using Group = ColumnGroup;
  using H = HostState;
  const bool projected = state.parameters.incompressible;
  const Use by_projection = projected ? Use::kept : Use::rebuilt;
  const Use by_prediction = projected ? Use::sorted : Use::rebuilt;
  visit({"position", "m", Group::position, particles, Use::kept}, f.position, &H::position);
  visit({"velocity", "m/s", Group::velocity, particles, Use::kept}, f.velocity, &H::velocity);
  visit({"id", "1", Group::position, particles, Use::kept}, f.id, &H::id);
  visit({"memory_triangle", "1", Group::memory, particles, Use::kept, -1}, f.memory_triangle,
        &H::memory_triangle);
  visit({"memory_side", "1", Group::memory, particles, Use::kept, 1}, f.memory_side,
        &H::memory_side);
  visit({"owed", "kg m/s", Group::memory, particles, Use::kept}, f.owed, &H::owed);
  visit({"acceleration", "m/s^2", Group::acceleration, particles}, f.acceleration, none);
  visit({"density", "kg/m^3", Group::density, particles}, f.density, none);
  visit({"pressure_term", "m^5/(kg s^2)", Group::pressure, particles, by_projection},
        f.pressure_term, &H::pressure_term);
  visit({"inverse_density", "m^3/kg", Group::inverse_density, particles}, f.inverse_density, none);
  visit({"cell", "1", Group::cells, particles}, f.cell, none);
  visit({"order", "1", Group::cells, particles}, f.order, none);
  visit({"swap_float", "1", Group::sorting, particles}, state.swap_float, none);
  visit({"triangle", "1", Group::near_cloth, particles}, f.triangle, none);
  visit({"beyond_support", "m", Group::near_cloth, particles, Use::sorted}, f.beyond_support, none);
  visit({"weight_b", "1", Group::near_cloth, particles}, f.weight_b, none);
  visit({"weight_c", "1", Group::near_cloth, particles}, f.weight_c, none);
  visit({"normal", "1", Group::near_cloth, particles}, f.normal, none);
  visit({"cloth_distance", "m", Group::near_cloth, particles}, f.cloth_distance, none);
  visit({"plane", "m", Group::near_cloth, particles}, f.plane, none);
  visit({"edge", "1", Group::near_cloth, particles}, f.edge, none);
  visit({"shaded", "1", Group::near_cloth, particles}, f.shaded, none);
  visit({"cloth_density", "1", Group::near_cloth, particles}, f.cloth_density, none);
  visit({"impulse", "kg m/s", Group::impulse, particles}, f.impulse, none);
  visit({"start", "m", Group::start, particles, by_prediction}, f.start, none);
  visit({"end", "m", Group::path, particles}, f.end, none);
  visit({"drift", "m", Group::drift, particles}, f.drift, none);
  visit({"moved", "1", Group::path, particles}, f.moved, none);
  visit({"held", "1", Group::path, particles}, f.held, none);
  visit({"stopped", "1", Group::path, particles}, f.stopped, none);
}

template <class S, class Visit>
void for_each_solve_column(S& state, const Visit& visit) {
  auto& p = state.pressure;
  auto& v = state.viscosity;
  using enum Extent;
  using Group = ColumnGroup;
  visit({"cell_start", "1", Group::cells}, state.fluid.cell_start, none);
  visit({"histogram", "1", Group::sorting}, state.queue.sort.histogram, none);
  visit({"order_in", "1", Group::sorting}, state.queue.sort.order_in, none);
  visit({"key_out", "1", Group::sorting}, state.queue.sort.key_out, none);
  visit({"bytes", "1", Group::sorting}, state.queue.sort.bytes, none);
  visit({"lists.block", "1", Group::lists}, p.lists.block, none);
  visit({"lists.base", "1", Group::lists}, p.lists.base, none);
  visit({"lists.begin", "1", Group::lists}, p.lists.begin, none);
  visit({"lists.blocks", "1", Group::lists}, p.lists.blocks, none);
  visit({"place", "m; p / rho_0", Group::solve, particles}, p.place, none);
  visit({"wall", "kg/m^4", Group::projection, particles}, p.wall, none);
  visit({"correction", "1", Group::projection, particles}, p.correction, none);
  visit({"correction_cross", "1", Group::projection, particles}, p.correction_cross, none);
  visit({"inverse_diagonal", "1", Group::projection, particles}, p.inverse_diagonal, none);
  visit({"scratch_a", "", Group::scratch, particles}, p.scratch_a, none);
  visit({"scratch_b", "", Group::scratch, particles}, p.scratch_b, none);
  visit({"next", "", Group::scratch, particles}, p.next, none);
  visit({"mean_displacement", "m", Group::mean_displacement, particles}, p.mean_displacement, none);
  visit({"source", "kg/m^3", Group::solve, particles}, p.source, none);
  visit({"before", "m^2/s^2", Group::solve, particles}, p.before, none);
  visit({"product", "kg/m^3", Group::solve, particles}, p.product, none);
  visit({"control", "", Group::solve}, p.control, none);
  visit({"hierarchy.partial", "", Group::solve}, p.hierarchy.partial, none);
  visit({"hierarchy.answer", "", Group::solve}, p.hierarchy.answer, none);
  visit({"hierarchy.inverse", "", Group::solve}, p.hierarchy.inverse, none);
  visit({"tension.normal", "1", Group::tension, particles}, state.tension.normal, none);
  visit({"tension.wetting", "1", Group::wetting, particles}, state.tension.wetting, none);
  visit({"body_rate", "1", Group::drag, particles}, v.body_rate, none);
  visit({"body_cross", "1", Group::drag, particles}, v.body_cross, none);
  visit({"body_source", "m/s", Group::drag, particles}, v.body_source, none);
  visit({"solution", "m/s", Group::viscosity}, v.solution, none);
  visit({"residual", "m/s", Group::viscosity}, v.residual, none);
  visit({"direction", "m/s", Group::viscosity}, v.direction, none);
  visit({"product", "m/s", Group::viscosity}, v.product, none);
  visit({"diagonal", "1", Group::viscosity}, v.diagonal, none);
  visit({"cross", "1", Group::viscosity}, v.cross, none);
  visit({"control", "", Group::viscosity}, v.control, none);
}

template <class S, class Visit>
void for_each_contact_column(S& state, const Visit& visit) {
  auto& t = state.contact;
  using enum Extent;
  using Group = ColumnGroup;
  visit({"key", "1", Group::contact, particles}, t.key, none);
  visit({"order", "1", Group::contact}, t.order, none);
  visit({"start", "1", Group::contact}, t.start, none);
  visit({"guarded", "1", Group::path}, t.guarded, none);
  visit({"guard_start", "1", Group::path}, t.guard_start, none);
  visit({"particle", "1", Group::rows, rows}, t.particle, none);
  visit({"vertex", "1", Group::rows, rows_3}, t.vertex, none);
  visit({"weight", "1", Group::rows, rows_3}, t.weight, none);
  visit({"change", "kg m/s or kg m", Group::loads, rows}, t.change, none);
  visit({"impulse", "kg m/s or kg m", Group::loads}, t.impulse, none);
  visit({"normal", "1", Group::exact, rows}, t.normal, none);
  visit({"velocity", "m/s", Group::exact, rows}, t.velocity, none);
  visit({"drag", "kg m/s", Group::exact, rows}, t.drag, none);
  visit({"inverse_row", "kg", Group::exact, rows}, t.inverse_row, none);
  visit({"pressure_target", "kg m/s", Group::exact, rows}, t.pressure_target, none);
  visit({"pressure_rate", "kg", Group::exact, rows}, t.pressure_rate, none);
  visit({"pressure_scale", "1", Group::exact, rows}, t.pressure_scale, none);
  visit({"least", "m/s", Group::exact, rows}, t.least, none);
  visit({"drag_rate", "kg", Group::exact, rows}, t.drag_rate, none);
  visit({"drag_scale", "1", Group::exact, rows}, t.drag_scale, none);
  visit({"lambda", "kg m/s", Group::exact, rows}, t.lambda, none);
  visit({"gradient", "kg/m^4", Group::cloth_rows, rows}, t.gradient, none);
  visit({"recovery", "m", Group::cloth_rows, rows}, t.recovery, none);
  visit({"compliance", "kg^2/m^8", Group::cloth_rows, rows}, t.compliance, none);
  visit({"gap", "m", Group::cloth_rows, rows}, t.gap, none);
  visit({"open", "1", Group::cloth_rows, rows}, t.open, none);
  visit({"rate_along", "1", Group::cloth_drag, rows}, t.rate_along, none);
  visit({"rate_across", "1", Group::cloth_drag, rows}, t.rate_across, none);
}

template <class S, class Visit>
void for_each_cloth_column(S& state, const Visit& visit) {
  auto& c = state.cloth;
  using enum Extent;
  using Group = ColumnGroup;
  using H = HostState;
  visit({"cloth.position", "m", Group::cloth, vertices, Use::kept}, c.position, &H::cloth_position);
  visit({"cloth.velocity", "m/s", Group::cloth, vertices, Use::kept}, c.velocity,
        &H::cloth_velocity);
  visit({"mass", "kg", Group::cloth_fixed}, c.mass, none);
  visit({"inverse_mass", "1/kg", Group::cloth_fixed}, c.inverse_mass, none);
  visit({"damping_rate", "1/s", Group::cloth_fixed}, c.damping_rate, none);
  visit({"spring_end", "1", Group::cloth_fixed}, c.spring_end, none);
  visit({"slot_offset", "1", Group::cloth_fixed}, c.slot_offset, none);
  visit({"rest_length", "m", Group::cloth_fixed}, c.rest_length, none);
  visit({"stiffness", "N/m", Group::cloth_fixed}, c.stiffness, none);
  visit({"spring_damping", "N s/m", Group::cloth_fixed}, c.spring_damping, none);
  visit({"corner", "1", Group::cloth_fixed}, c.corner, none);
  visit({"neighbour", "1", Group::cloth_fixed}, c.neighbour, none);
  visit({"loose_sheet", "1", Group::cloth_fixed}, c.loose_sheet, none);
  visit({"sheet", "1", Group::cloth_fixed}, c.sheet, none);
  visit({"half_thickness", "m", Group::cloth_fixed}, c.half_thickness, none);
  visit({"cloth.wetting", "1", Group::cloth_fixed}, c.wetting, none);
  visit({"no_slip", "1", Group::cloth_fixed}, c.no_slip, none);
  visit({"rest_centroid", "m", Group::cloth_fixed}, c.rest_centroid, none);
  visit({"fan_start", "1", Group::cloth_fixed}, c.fan_start, none);
  visit({"fan_entry", "1", Group::cloth_fixed}, c.fan_entry, none);
  visit({"rim", "1", Group::cloth_fixed}, c.rim, none);
  visit({"seam_pair", "1", Group::cloth_fixed}, c.seam_pair, none);
  visit({"seam_reach", "m", Group::cloth_fixed}, c.seam_reach, none);
  visit({"seam_fan_start", "1", Group::cloth_fixed}, c.seam_fan_start, none);
  visit({"seam_fan_entry", "1", Group::cloth_fixed}, c.seam_fan_entry, none);
  visit({"seam_open", "1", Group::polygons}, c.seam_open, none);
  visit({"corner_shift", "m", Group::cloth_fixed}, c.corner_shift, none);
  visit({"spring_shift", "m", Group::cloth_fixed}, c.spring_shift, none);
  visit({"rest_period", "m", Group::cloth_fixed}, c.rest_period, none);
  visit({"air_share", "1", Group::cloth_fixed}, c.air_share, none);
  visit({"cloth.next", "m", Group::cloth_substep}, c.next, none);
  visit({"cloth.next_velocity", "m/s", Group::cloth_substep}, c.next_velocity, none);
  visit({"cloth.start", "m", Group::cloth_substep}, c.start, none);
  visit({"cloth.predicted", "m/s", Group::cloth_substep}, c.predicted, none);
  visit({"cloth.held", "1", Group::cloth_substep}, c.held, none);
  visit({"cloth.stop_sum", "1", Group::cloth_substep}, c.stop_sum, none);
  visit({"force", "N", Group::cloth_load}, c.force, none);
  visit({"share", "1", Group::cloth_load}, c.share, none);
  visit({"air_diagonal", "kg/s", Group::cloth_air}, c.air_diagonal, none);
  visit({"air_cross", "kg/s", Group::cloth_air}, c.air_cross, none);
  visit({"air_push", "N", Group::cloth_air}, c.air_push, none);
  visit({"centroid", "m", Group::polygons}, c.centroid, none);
  visit({"cloth.cell", "1", Group::polygons}, c.cell, none);
  visit({"cloth.order", "1", Group::polygons}, c.order, none);
  visit({"cloth.cell_start", "1", Group::polygons}, c.cell_start, none);
  visit({"sorted_low", "m", Group::polygons}, c.sorted_low, none);
  visit({"sorted_high", "m", Group::polygons}, c.sorted_high, none);
  visit({"sorted_triangle", "m", Group::polygons}, c.sorted_triangle, none);
  visit({"sorted_shift", "m", Group::polygons}, c.sorted_shift, none);
}

template <class S, class Visit>
void for_each_system_column(S& state, const Visit& visit) {
  using Group = ColumnGroup;
  auto& s = state.cloth_system;
  visit({"tension", "kg", Group::cloth_system}, s.tension, none);
  visit({"axis", "sqrt(kg)", Group::cloth_system}, s.axis, none);
  visit({"inertia", "kg", Group::cloth_system}, s.inertia, none);
  visit({"factor", "kg", Group::cloth_system}, s.factor, none);
  visit({"base", "kg m", Group::cloth_system}, s.base, none);
  visit({"right", "kg m", Group::cloth_system}, s.right, none);
  visit({"free", "1", Group::cloth_system}, s.free, none);
  visit({"change", "m", Group::cloth_system}, s.change, none);
  visit({"answer", "m", Group::cloth_system}, s.answer, none);
  visit({"system.normal", "1", Group::cloth_obstacles}, s.normal, none);
  visit({"grip", "1", Group::cloth_obstacles}, s.grip, none);
  visit({"free_factor", "kg", Group::cloth_obstacles}, s.free_factor, none);
  visit({"slides", "1", Group::cloth_obstacles}, s.slides, none);
  visit({"rub", "kg m", Group::cloth_obstacles}, s.rub, none);
  visit({"cling", "kg", Group::cloth_obstacles}, s.cling, none);
  visit({"system.residual", "kg m", Group::cloth_system}, s.residual, none);
  visit({"scaled", "m", Group::cloth_system}, s.scaled, none);
  visit({"image", "kg m", Group::cloth_system}, s.image, none);
  visit({"system.direction", "m", Group::cloth_system}, s.direction, none);
  visit({"direction_image", "kg m", Group::cloth_system}, s.direction_image, none);
  visit({"system.control", "", Group::cloth_system}, s.control, none);
  visit({"drag_factor", "kg", Group::cloth_drag}, s.drag_factor, none);
}

template <class S, class Visit>
void for_each_shell_column(S& state, const Visit& visit) {
  using enum Extent;
  using Group = ColumnGroup;
  using H = HostState;
  auto& s = state.shell;
  const Use kept = s.any ? Use::kept : Use::rebuilt;
  visit({"landed", "m", Group::shell_history, vertices, kept}, s.landed, &H::shell_landed);
  visit({"rounding", "m", Group::shell_history, vertices, kept}, s.rounding, &H::shell_rounding);
  visit({"left", "m/s", Group::shell_history, vertices, kept}, s.left, &H::shell_left);
  visit({"lost", "m/s", Group::shell_history, vertices, kept}, s.lost, &H::shell_lost);
  visit({"shell.acceleration", "m/s^2", Group::shell_history, vertices, kept}, s.acceleration,
        &H::shell_acceleration);
  visit({"friction", "N", Group::shell_history, vertices, kept}, s.friction, &H::shell_friction);
  visit({"internal", "N", Group::shell_history, vertices, kept}, s.internal, &H::shell_internal);
  visit({"area", "m^2", Group::cloth_fixed}, s.area, none);
  visit({"shell.gradient", "1/m", Group::cloth_fixed}, s.gradient, none);
  visit({"shell.corner", "1", Group::cloth_fixed}, s.corner, none);
  visit({"shell.sheet", "1", Group::cloth_fixed}, s.sheet, none);
  visit({"edge_shift", "m", Group::cloth_fixed}, s.edge_shift, none);
  visit({"law", "", Group::cloth_fixed}, s.law, none);
  visit({"ring_start", "1", Group::cloth_fixed}, s.ring_start, none);
  visit({"row_start", "1", Group::cloth_fixed}, s.row_start, none);
  visit({"shell.end", "1", Group::cloth_fixed}, s.end, none);
  visit({"offset", "1", Group::cloth_fixed}, s.offset, none);
  visit({"bend", "N/m", Group::cloth_fixed}, s.bend, none);
  visit({"fan_slot", "1", Group::cloth_fixed}, s.fan_slot, none);
  visit({"push", "N", Group::cloth_fixed}, s.push, none);
  visit({"patch_start", "1", Group::cloth_fixed}, s.patch_start, none);
  visit({"patch_node", "1", Group::cloth_fixed}, s.patch_node, none);
  visit({"patch_of_start", "1", Group::cloth_fixed}, s.patch_of_start, none);
  visit({"patch_of", "1", Group::cloth_fixed}, s.patch_of, none);
  visit({"patch_of_triangle", "1", Group::cloth_fixed}, s.patch_of_triangle, none);
  visit({"patch_weight", "1/m", Group::cloth_fixed}, s.patch_weight, none);
  visit({"patch_rest", "1", Group::cloth_fixed}, s.patch_rest, none);
  visit({"patch_shift", "1", Group::cloth_fixed}, s.patch_shift, none);
  visit({"patch_moment", "N m^(1/2)", Group::shell_system}, s.moment, none);
  visit({"bend_factor", "s^2", Group::shell_system}, s.bend_factor, none);
  visit({"shell.path", "m/s", Group::shell_system}, s.path, none);
  visit({"about", "m", Group::shell_system}, s.about, none);
  visit({"from", "m", Group::shell_system}, s.from, none);
  visit({"element", "", Group::shell_system}, s.element, none);
  visit({"block", "kg", Group::shell_system}, s.block, none);
  visit({"shell.tension", "kg", Group::shell_system}, s.tension, none);
  visit({"diagonal", "kg", Group::shell_system}, s.diagonal, none);
  visit({"shell.base", "kg m", Group::shell_system}, s.base, none);
}

template <class S, class Visit>
void for_each_wet_column(S& state, const Visit& visit) {
  using enum Extent;
  using Group = ColumnGroup;
  auto& w = state.wet;
  const Use kept = w.any ? Use::kept : Use::rebuilt;
  visit({"wetness", "1", Group::wet_cloth, vertices, kept}, w.wetness, &HostState::cloth_wetness);
  visit({"wet_law", "", Group::cloth_fixed}, w.law, none);
  visit({"dry_mass", "kg", Group::cloth_fixed}, w.dry_mass, none);
  visit({"dry_law", "", Group::cloth_fixed}, w.dry_law, none);
  visit({"dry_bend", "N/m", Group::cloth_fixed}, w.dry_bend, none);
  visit({"dry_push", "N", Group::cloth_fixed}, w.dry_push, none);
  visit({"softness", "1", Group::wet_cloth}, w.softness, none);
}

template <class S, class Visit>
void for_each_cloth_level_column(S& state, const Visit& visit) {
  using Group = ColumnGroup;
  auto& s = state.cloth_levels;
  visit({"leaf", "1", Group::cloth_fixed}, s.leaf, none);
  visit({"leaf.vertex", "1", Group::cloth_fixed}, s.leaf_vertex, none);
  visit({"leaf.weight", "1", Group::cloth_fixed}, s.leaf_weight, none);
  visit({"levels.reach", "1", Group::cloth_fixed}, s.reach, none);
  visit({"levels.rest", "m", Group::cloth_fixed}, s.rest, none);
  visit({"levels.centre", "m", Group::cloth_fixed}, s.centre, none);
  visit({"levels.local", "m", Group::cloth_fixed}, s.local, none);
  visit({"levels.slot_local", "m", Group::cloth_fixed}, s.slot_local, none);
  visit({"levels.partial", "", Group::cloth_system}, s.partial, none);
  visit({"levels.strain", "", Group::cloth_system}, s.strain, none);
  visit({"levels.held", "kg", Group::cloth_system}, s.held, none);
  visit({"levels.inverse", "", Group::cloth_system}, s.inverse, none);
  visit({"levels.moment", "", Group::cloth_system}, s.moment, none);
  visit({"levels.answer", "", Group::cloth_system}, s.answer, none);
}

template <class S, class Visit>
void for_each_pin_column(S& state, const Visit& visit) {
  using Group = ColumnGroup;
  auto& p = state.pins;
  visit({"pin.vertex", "1", Group::pins}, p.vertex, none);
  visit({"pin.pull", "N/m", Group::pins}, p.pull, none);
  visit({"pin.place", "m", Group::pins}, p.place, none);
  visit({"pin.low", "m", Group::pins}, p.low, none);
  visit({"pin.velocity", "m/s", Group::pins}, p.velocity, none);
  visit({"anchor", "kg", Group::cloth_system}, state.cloth_system.anchor, none);
  visit({"anchor_pull", "kg m", Group::cloth_system}, state.cloth_system.anchor_pull, none);
}

template <class S, class Visit>
void for_each_self_contact_column(S& state, const Visit& visit) {
  using Group = ColumnGroup;
  auto& s = state.self_contact;
  visit({"sheet_vertex", "", Group::cloth_fixed}, s.vertex, none);
  visit({"owned", "1", Group::cloth_fixed}, s.owned, none);
  visit({"self.to", "m", Group::self_contact}, s.to, none);
  visit({"self.point", "m", Group::self_contact}, s.point, none);
  visit({"self.low", "m", Group::self_contact}, s.low, none);
  visit({"self.high", "m", Group::self_contact}, s.high, none);
  visit({"self.sorted_low", "m", Group::self_contact}, s.sorted_low, none);
  visit({"self.sorted_high", "m", Group::self_contact}, s.sorted_high, none);
  visit({"self.cell", "1", Group::self_contact}, s.cell, none);
  visit({"self.order", "1", Group::self_contact}, s.order, none);
  visit({"self.cell_start", "1", Group::self_contact}, s.cell_start, none);
  visit({"pair.count", "1", Group::self_contact}, s.count, none);
  visit({"pair.first", "1", Group::self_contact}, s.first, none);
  visit({"pair", "1", Group::self_contact}, s.pair, none);
  visit({"row", "", Group::self_contact}, s.row, none);
  visit({"row.key", "1", Group::self_contact}, s.key, none);
  visit({"row.start", "1", Group::self_contact}, s.start, none);
  visit({"row.entry", "1", Group::self_contact}, s.entry, none);
  visit({"row.entry_weight", "1", Group::self_contact}, s.entry_weight, none);
  visit({"row.bears", "kg, m", Group::self_contact}, s.bears, none);
  visit({"row.pull", "kg m", Group::cloth_system}, s.pull, none);
  visit({"row.block", "kg", Group::self_contact}, s.block, none);
  visit({"row.load", "kg m", Group::self_contact}, s.load, none);
  visit({"wanted", "m", Group::self_contact}, s.wanted, none);
  visit({"portion", "1", Group::self_contact}, s.portion, none);
  visit({"stop", "1", Group::self_contact}, s.stop, none);
  visit({"pair.start", "1", Group::self_contact}, s.pair_start, none);
  visit({"pair.entry", "1", Group::self_contact}, s.pair_entry, none);
}

template <class S, class Visit>
void for_each_triangle_obstacle_column(S& state, const Visit& visit) {
  using Group = ColumnGroup;
  auto& s = state.triangle_obstacles;
  visit({"side", "1", Group::cloth_fixed}, s.side, none);
  visit({"triangle.count", "1", Group::self_contact}, s.count, none);
  visit({"triangle.first", "1", Group::self_contact}, s.first, none);
  visit({"triangle.pair", "", Group::self_contact}, s.pair, none);
  visit({"touch.count", "1", Group::self_contact}, s.touch_count, none);
  visit({"touch.first", "1", Group::self_contact}, s.touch_first, none);
  visit({"touch.found", "", Group::self_contact}, s.found, none);
  visit({"touch", "", Group::self_contact}, s.touch, none);
  visit({"triangle.stop", "1", Group::self_contact}, s.stop, none);
  visit({"carrier", "1", Group::self_contact}, s.carrier, none);
}

template <class Solids, class Visit>
void for_each_solid_column(Solids& solids, ColumnGroup group, const Visit& visit) {
  visit({"view", "", group}, solids.view, none);
  for (auto& field : solids.field) {
    visit({"field.block", "1", group}, field.block, none);
    visit({"field.value", "m", group}, field.value, none);
  }
}

/// Calls visit(ColumnInfo, column, member of HostState or none) for every column.
template <class S, class Visit>
void for_each_column(S& state, const Visit& visit) {
  for_each_fluid_column(state, visit);
  for_each_solve_column(state, visit);
  for_each_contact_column(state, visit);
  for_each_cloth_column(state, visit);
  for_each_system_column(state, visit);
  for_each_shell_column(state, visit);
  for_each_wet_column(state, visit);
  for_each_cloth_level_column(state, visit);
  for_each_pin_column(state, visit);
  for_each_self_contact_column(state, visit);
  for_each_triangle_obstacle_column(state, visit);
  for_each_solid_column(state.obstacles, ColumnGroup::obstacles, visit);
  for_each_solid_column(state.sinks, ColumnGroup::sinks, visit);
  visit({"stopped", "kg m/s", ColumnGroup::stopped}, state.obstacles.stopped, none);
}

/// The same of those that checkpoints hold.
template <class S, class Visit>
void for_each_kept_column(S& state, const Visit& visit) {
  for_each_column(state, [&](const ColumnInfo& info, auto& column, auto host) {
    if constexpr (!std::is_same_v<decltype(host), std::nullptr_t>) {
      if (info.use == Use::kept) visit(info, column, host);
    }
  });
}

/// Room for n particles in the columns of these groups; contents are kept.
inline void resize_particles(State& state, ColumnSet groups, size_t n) {
  const size_t rows = (n + 23) / 8 * 8;
  state.contact.stride = int(rows);
  for_each_column(state, [&](const ColumnInfo& info, auto& column, auto) {
    if (!groups.contains(info.group)) return;
    if (info.extent == Extent::particles) column.resize(n);
    if (info.extent == Extent::rows) column.resize(rows);
    if (info.extent == Extent::rows_3) column.resize(3 * rows);
  });
  if (groups.contains(ColumnGroup::solve)) state.pressure.control.resize(1);
}

template <class T>
size_t bytes_of(const Column<T>& column) {
  return column.capacity() * sizeof(T);
}
inline size_t bytes_of(const VecColumn& c) { return bytes_of(c.x) + bytes_of(c.y) + bytes_of(c.z); }

template <class T>
size_t size_of(const Column<T>& column) {
  return column.size();
}
inline size_t size_of(const VecColumn& c) { return c.x.size(); }

}  // namespace drench::sim::DRENCH_BACKEND
