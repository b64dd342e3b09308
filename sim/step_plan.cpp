#include "sim/step_plan.h"

#include "sim/neighbours/sort_particles.h"
#include "sim/passes/air/wind_on_cloth.h"
#include "sim/passes/air/wind_on_fluid.h"
#include "sim/passes/coupling/cloth_filter.h"
#include "sim/passes/coupling/cloth_side.h"
#include "sim/passes/coupling/contact_exact.h"
#include "sim/passes/coupling/contact_paper.h"
#include "sim/passes/coupling/move.h"
#include "sim/passes/motion/turning_frame.h"
#include "sim/passes/obstacle/obstacle_guard.h"
#include "sim/passes/pressure/closed_domain.h"
#include "sim/passes/pressure/incompressible.h"
#include "sim/passes/tension/surface_tension.h"
#include "sim/passes/tension/wetting.h"
#include "sim/passes/viscosity/body_drag.h"
#include "sim/passes/viscosity/viscosity_solve.h"
#include "sim/passes/wcsph/wcsph.h"

namespace drench::sim::DRENCH_BACKEND {

namespace {

void exact_grid(State& state) { build_polygon_grid(state, state.parameters.support_radius); }
/// Particles stand where sheets do: at the start of the step.
ConstVecView beside_sheets(const State& state) {
  return state.parameters.incompressible ? state.fluid.start.view() : state.fluid.position.view();
}
void exact_nearest(State& state) {
  find_nearest_triangles(state, beside_sheets(state), state.parameters.support_radius);
}
void exact_sides(State& state) { find_sheet_sides(state, beside_sheets(state)); }
void sort_all_contacts(State& state) { sort_contacts(state, 1e30f); }
void settle_cloth_alone(State& state) {
  state.contact.near = 0;
  if (state.parameters.air_density > 0) wind_on_cloth(state);
  linearise_cloth(state);
  settle_sheets(state);
  finish_sheets(state);
  finish_substep(state.cloth);
}
// The paper's voxels have the rest distance between centroids as edge: no reach is added.
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
bool wetting(const Parameters& p, bool cloth) { return tense(p, cloth) && p.wets; }
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
bool exact(const Parameters& p, bool cloth) { return coupled(p, cloth) && !p.incompressible; }
bool strong(const Parameters& p, bool cloth) { return coupled(p, cloth) && p.incompressible; }
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

constexpr unsigned moving = column_position | column_velocity;

const Pass all_passes[] = {
    {"turn_frame", turning, column_position, column_velocity, turn_frame},
    {"predict_particles", free_of_obstacles, moving, moving, predict_particles},
    {"predict_around_obstacles", around_obstacles, moving, moving, predict_around_obstacles},
    {"sort_particles", fluid, column_position, moving, sort_particles},
    {"polygon_grid", coupled, column_cloth, column_cloth, exact_grid},
    {"nearest_triangle", coupled, column_position | column_cloth, column_sheet, exact_nearest},
    {"sheet_side", coupled, column_position | column_cloth, column_sheet | column_memory,
     exact_sides},
    {"sort_near", strong, column_sheet, column_contact, sort_all_contacts},
    {"start_rows", strong, column_sheet | column_contact, column_cloth, start_contacts},
    // Explicit sheets feel it substep by substep, in cloth_verlet.
    {"wind_on_cloth", strong_in_wind, column_cloth, column_cloth, wind_on_cloth},
    {"linearise_cloth", strong, column_cloth, column_cloth_system, linearise_cloth},
    {"find_neighbours", projected, column_position, column_density | column_projection,
     find_neighbours},
    {"apply_surface_tension", tense, column_velocity | column_projection,
     column_velocity | column_projection | column_tension, apply_surface_tension},
    {"apply_contact_angles", wetting, column_velocity | column_projection | column_tension,
     column_velocity | column_projection | column_tension, apply_contact_angles},
    {"smooth_velocities", smoothed, column_velocity | column_projection,
     column_velocity | column_projection, smooth_velocities},
    {"project_closed_domain", without_surface, moving | column_density | column_projection,
     moving | column_density | column_projection, project_closed_domain},
    {"project_density", with_surface, moving | column_density | column_projection,
     moving | column_density | column_projection, project_density},
    {"project_around_obstacles", around_obstacles, moving | column_density | column_projection,
     moving | column_density | column_projection, project_around_obstacles},
    {"find_body_drag", dragged, column_velocity | column_projection, column_drag, find_body_drag},
    {"apply_viscosity", viscous, column_velocity | column_projection,
     column_velocity | column_projection, apply_viscosity},
    {"wind_on_fluid", windy, moving | column_density | column_projection, column_velocity,
     wind_on_fluid},
    {"paper_polygon_grid", paper, column_cloth, column_cloth, paper_grid},
    {"paper_nearest_centroid", paper, column_position | column_cloth, column_sheet,
     find_nearest_centroids},
    {"density", compressible, column_position, column_density, sum_density},
    {"pressure_viscosity", compressible, moving | column_density, column_acceleration,
     pressure_viscosity},
    {"paper_forces", paper, column_sheet, column_acceleration | column_contact, add_paper_forces},
    {"turn_frame", turning_compressible, column_position, column_velocity, turn_frame},
    {"integrate_velocity", compressible, column_acceleration, column_velocity, integrate_velocity},
    {"sort_contacts", exact, column_sheet, column_contact, sort_exact_contacts},
    {"start_contacts", exact, column_sheet | column_contact, column_velocity | column_cloth,
     start_contacts},
    {"cloth_predict", exact, column_cloth, column_cloth, cloth_predict},
    {"contact_exact", exact, column_sheet | column_density | column_cloth,
     column_velocity | column_contact | column_cloth, solve_contacts},
    {"paper_reaction", paper, column_contact, column_cloth, paper_reaction},
    {"move_particles", fluid_alone, moving, moving, move_particles},
    {"move_cloth", explicit_alone, column_cloth, column_cloth, move_cloth},
    {"settle_cloth", implicit_alone, column_cloth, column_cloth | column_cloth_system,
     settle_cloth_alone},
    {"move_with_sheets", strong, moving | column_cloth | column_cloth_system,
     moving | column_cloth | column_contact, move_with_sheets},
    {"move_coupled", exact, moving | column_cloth, moving | column_cloth | column_contact,
     move_coupled},
    {"paper_move", paper, moving | column_cloth, moving | column_cloth, paper_move},
};

}  // namespace

std::span<const Pass> every_pass() { return all_passes; }

std::vector<Pass> step_plan(const Parameters& parameters, bool cloth) {
  std::vector<Pass> plan;
  for (const Pass& pass : all_passes) {
    if (pass.when(parameters, cloth)) plan.push_back(pass);
  }
  return plan;
}

void step_cloth_alone(State& state) {
  state.cloth.force.clear();
  if (state.parameters.turns) turn_frame(state);
  state.parameters.incompressible ? settle_cloth_alone(state) : move_cloth(state);
}

}  // namespace drench::sim::DRENCH_BACKEND
