#include "sim/step_plan.h"

#include "sim/neighbours/sort_particles.h"
#include "sim/passes/air/wind_on_cloth.h"
#include "sim/passes/air/wind_on_fluid.h"
#include "sim/passes/cloth/wet_cloth.h"
#include "sim/passes/coupling/cloth_filter.h"
#include "sim/passes/coupling/cloth_side.h"
#include "sim/passes/coupling/collision_rounds.h"
#include "sim/passes/coupling/contact_paper.h"
#include "sim/passes/coupling/contact_wcsph.h"
#include "sim/passes/motion/turning_frame.h"
#include "sim/passes/obstacle/obstacle_guard.h"
#include "sim/passes/pressure/closed_domain.h"
#include "sim/passes/pressure/incompressible.h"
#include "sim/passes/tension/contact_angle.h"
#include "sim/passes/tension/surface_tension.h"
#include "sim/passes/viscosity/body_drag.h"
#include "sim/passes/viscosity/viscosity_solve.h"
#include "sim/passes/wcsph/wcsph.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

void exact_grid(State& state) {
  find_open_seams(state);
  build_polygon_grid(state, state.parameters.support_radius);
}
/// Particles stand where sheets do: at the start of the step.
ConstVecView beside_sheets(const State& state) {
  return state.parameters.incompressible ? state.fluid.start.view() : state.fluid.position.view();
}
void exact_nearest(State& state) {
  bring_closed_seams_nearer(state);
  find_nearest_triangles(state, beside_sheets(state), state.parameters.support_radius);
}
void exact_sides(State& state) { find_cloth_sides(state, beside_sheets(state)); }
void sort_all_contacts(State& state) { sort_contacts(state, 1e30f); }
void settle_cloth_alone(State& state) {
  state.contact.near = 0;
  if (state.parameters.air_density > 0) wind_on_cloth(state);
  if (state.shell.any) linearise_shell(state);
  linearise_cloth(state);
  start_sheet_rows(state);
  settle_cloth(state);
  finish_cloth(state);
  finish_substep(state.cloth);
}
// Voxels as wide as any centroid is from a corner of its triangle: no reach is added.
void paper_grid(State& state) { build_polygon_grid(state, 0.f); }
void paper_reaction(State& state) {
  sort_contacts(state, 1e30f);
  gather_paper_reaction(state);
}
void paper_move(State& state) {
  move_particles(state);
  move_cloth(state);
}

bool fluid(const Parameters& p, bool) { return p.fluid; }
bool projected(const Parameters& p, bool) { return p.fluid && p.incompressible; }
bool free_of_obstacles(const Parameters& p, bool cloth) {
  return projected(p, cloth) && p.obstacles == 0;
}
bool with_surface(const Parameters& p, bool cloth) {
  return free_of_obstacles(p, cloth) && !p.full;
}
bool without_surface(const Parameters& p, bool cloth) {
  return free_of_obstacles(p, cloth) && p.full;
}
bool around_obstacles(const Parameters& p, bool cloth) {
  return projected(p, cloth) && p.obstacles > 0;
}
bool smoothed(const Parameters& p, bool cloth) { return projected(p, cloth) && p.xsph > 0; }
bool tense(const Parameters& p, bool cloth) { return projected(p, cloth) && p.surface_tension > 0; }
bool wets(const Parameters& p, bool cloth) { return tense(p, cloth) && p.wets; }
bool viscous(const Parameters& p, bool cloth) {
  return projected(p, cloth) && p.dynamic_viscosity > 0;
}
bool dragged(const Parameters& p, bool cloth) {
  return viscous(p, cloth) && (p.no_slip_obstacles || p.no_slip_sheets);
}
bool windy(const Parameters& p, bool cloth) {
  return projected(p, cloth) && p.air_density > 0 && p.fluid_drag > 0;
}
bool compressible(const Parameters& p, bool) { return p.fluid && !p.incompressible; }
// Solver::refresh runs what stands before the compressible fluid's density once more.
bool turning(const Parameters& p, bool cloth) { return p.turns && !compressible(p, cloth); }
bool turning_compressible(const Parameters& p, bool cloth) {
  return p.turns && compressible(p, cloth);
}
bool coupled(const Parameters& p, bool cloth) { return p.fluid && cloth && !p.paper; }
bool coupled_exactly(const Parameters& p, bool cloth) {
  return coupled(p, cloth) && !p.incompressible;
}
bool strong(const Parameters& p, bool cloth) { return coupled(p, cloth) && p.incompressible; }
bool strong_shells(const Parameters& p, bool cloth) { return strong(p, cloth) && p.shells; }
bool wets_sheets(const Parameters& p, bool cloth) {
  return cloth && p.wet_sheets && sheets_are_implicit(p);
}
bool strong_meeting(const Parameters& p, bool cloth) {
  return strong(p, cloth) && (p.self_contact || (p.shells && p.obstacles > 0));
}
bool strong_in_wind(const Parameters& p, bool cloth) {
  return strong(p, cloth) && p.air_density > 0;
}
bool paper(const Parameters& p, bool cloth) { return p.fluid && cloth && p.paper; }
bool fluid_alone(const Parameters& p, bool cloth) { return compressible(p, cloth) && !cloth; }
bool cloth_alone(const Parameters& p, bool cloth) { return !p.fluid && cloth; }
bool explicit_alone(const Parameters& p, bool cloth) {
  return cloth_alone(p, cloth) && !sheets_are_implicit(p);
}
bool implicit_alone(const Parameters& p, bool cloth) {
  return cloth_alone(p, cloth) && sheets_are_implicit(p);
}

using enum ColumnGroup;
constexpr ColumnSet moving = position | velocity;
constexpr ColumnSet walls =
    projection | solve;  // of the pressure solve, at the predicted positions
constexpr ColumnSet sheets = cloth | cloth_fixed;
constexpr ColumnSet near_list = near_cloth | contact | rows | cloth_fixed;
/// What a pressure solve writes beside cloth.
constexpr ColumnSet response =
    cloth_system | shell_system | cloth_obstacles | loads | self_contact | sorting;

constexpr bool of_sheets = true;

const Pass all_passes[] = {
    {"turn_frame", turning, moving | cloth, velocity, turn_frame, cloth},
    {"predict_particles", free_of_obstacles, moving, moving, predict_particles, start},
    {"predict_around_obstacles", around_obstacles, moving, moving | stopped,
     predict_around_obstacles, start},
    {"sort_particles", fluid, position, moving | pressure | cells | sorting, sort_particles,
     memory | near_cloth | start},
    {"polygon_grid", coupled, sheets, polygons | sorting, exact_grid},
    {"nearest_triangle", coupled, position | start | sheets | polygons | memory, near_cloth,
     exact_nearest},
    {"sheet_side", coupled, position | start | sheets | polygons, near_cloth | memory, exact_sides},
    {"sort_near", strong, near_cloth, contact | sorting, sort_all_contacts},
    {"start_rows", strong, near_list | memory, rows | loads | memory | cloth_load, start_contacts},
    {"wet_cloth", wets_sheets, moving | cells | sheets | shell_history,
     cloth | cloth_fixed | shell_history | wet_cloth, soak_sheets},
    // Explicit sheets feel it substep by substep, in cloth_verlet.
    {"wind_on_cloth", strong_in_wind, sheets, cloth_air, wind_on_cloth, {}, of_sheets},
    {"linearise_shell",
     strong_shells,
     sheets | pins,
     shell_system | shell_history,
     linearise_shell,
     {},
     of_sheets},
    {"linearise_cloth",
     strong,
     sheets | pins | cloth_load | cloth_air,
     cloth_system,
     linearise_cloth,
     {},
     of_sheets},
    {"start_sheet_rows",
     strong_meeting,
     sheets | shell_system | shell_history,
     self_contact | cloth_system | sorting,
     start_sheet_rows,
     {},
     of_sheets},
    {"find_neighbours", projected, position | cells, density | lists | projection | scratch | solve,
     find_neighbours, cloth_rows},
    {"apply_surface_tension", tense, velocity | lists | walls, velocity | tension | scratch,
     apply_surface_tension, memory},
    {"apply_contact_angles", wets, velocity | lists | walls | tension, velocity | wetting | scratch,
     apply_contact_angles},
    {"smooth_velocities", smoothed, velocity | lists, velocity | scratch, smooth_velocities},
    {"project_closed_domain", without_surface, moving | lists | projection,
     moving | pressure | solve | scratch | mean_displacement | projection, project_closed_domain,
     response},
    {"project_density", with_surface, moving | density | pressure | lists | projection,
     moving | pressure | solve | scratch, project_density, response},
    {"project_around_obstacles", around_obstacles, moving | density | pressure | lists | projection,
     moving | pressure | solve | scratch | projection | stopped, project_around_obstacles,
     response},
    {"find_body_drag", dragged, velocity | solve, drag, find_body_drag, cloth_drag},
    {"apply_viscosity", viscous, velocity | lists | solve | drag, velocity | scratch | viscosity,
     apply_viscosity, cloth_drag | cloth_system | loads},
    {"wind_on_fluid", windy, moving | density | lists | solve, velocity, wind_on_fluid},
    {"paper_polygon_grid", paper, sheets, polygons | sorting, paper_grid},
    {"paper_nearest_centroid", paper, position | sheets | polygons, near_cloth,
     find_nearest_centroids},
    {"density", compressible, position | cells, density | pressure | inverse_density, sum_density,
     near_cloth},
    {"pressure_viscosity", compressible, moving | pressure | inverse_density | cells, acceleration,
     pressure_viscosity},
    {"paper_forces", paper, near_cloth | moving, acceleration | impulse, add_paper_forces},
    {"turn_frame", turning_compressible, moving | cloth, velocity, turn_frame, cloth},
    {"integrate_velocity", compressible, acceleration, velocity, integrate_velocity},
    {"sort_contacts", coupled_exactly, near_cloth, contact | sorting, sort_wcsph_contacts},
    {"start_contacts", coupled_exactly, near_list | memory, rows | loads | memory | cloth_load,
     start_contacts},
    {"cloth_predict", coupled_exactly, sheets | cloth_load, cloth_substep | cloth_air,
     cloth_predict},
    {"contact_exact", coupled_exactly, near_list | velocity | pressure | inverse_density | sheets,
     velocity | exact | loads | cloth_load | cloth_substep, solve_contacts},
    {"paper_reaction", paper, impulse | near_cloth, contact | cloth_load | sorting, paper_reaction},
    {"move_particles", fluid_alone, moving, moving, move_particles},
    {"move_cloth", explicit_alone, sheets, cloth | cloth_substep | cloth_air, move_cloth},
    {"settle_cloth",
     implicit_alone,
     sheets | pins,
     cloth | cloth_substep | cloth_system | cloth_obstacles | cloth_air | stopped | shell_system |
         shell_history | self_contact | sorting,
     settle_cloth_alone,
     {},
     of_sheets},
    {"move_with_sheets", strong,
     moving | near_list | sheets | pins | start | drift | cloth_system | shell_system,
     moving | cloth | cloth_substep | near_cloth | memory | path | drift | projection | contact |
         sorting | cloth_load | stopped | shell_history | self_contact,
     move_with_sheets},
    {"move_coupled", coupled_exactly, moving | near_list | sheets,
     moving | cloth | cloth_substep | near_cloth | memory | path | start | cloth_air | contact |
         sorting,
     move_coupled},
    {"paper_move", paper, moving | sheets, moving | cloth | cloth_substep, paper_move},
};

}  // namespace

std::span<const Pass> every_pass() { return all_passes; }

std::vector<Pass> step_plan(const Parameters& parameters, bool cloth) {
  std::vector<Pass> plan;
  for (const Pass& pass : all_passes) {
    if (!pass.when(parameters, cloth)) continue;
    plan.push_back(pass);
    // The published coupling remembers nothing from step to step.
    const ColumnSet forgotten = parameters.paper ? memory | near_cloth | start : ColumnSet();
    if (cloth) plan.back().writes |= pass.writes_beside_cloth.without(forgotten);
  }
  return plan;
}

void step_cloth_alone(State& state) {
  state.cloth.force.clear(state.queue);
  if (state.parameters.turns) turn_frame(state);
  if (state.wet.any) soak_sheets(state);
  state.contact.near = 0;
  if (all_sheets_sleep(state)) return;
  state.parameters.incompressible ? settle_cloth_alone(state) : move_cloth(state);
}

}  // namespace drench::sim::DRENCH_BACKEND
