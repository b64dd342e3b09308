#pragma once
// What a step reads besides the state: numbers derived once from the shot. Host and device, both
// builds.

#include <cstdint>

namespace drench::sim {

struct Parameters {
  // fluid
  float spacing = 0, support_radius = 0;      // m, a and h
  float particle_mass = 0, rest_density = 0;  // kg, kg/m^3
  float lattice_sum = 1;        // of the density kernel over a cubic lattice, times a^3
  float wall_scale = 1;         // of the half-space integral: a lattice at a wall is whole
  float sound_speed = 0;        // m/s; of the incompressible fluid: a tenth of it is to be expected
  bool incompressible = false;  // solver: pressures by a solve, or by an equation of state
  float tolerance = 1e-4f;      // of the incompressible solver: mean density error over rest
  int most_iterations = 100;    // of it, a step
  bool full = false;            // it fills a closed domain: density is made even, not reduced
  float xsph = 0;               // share of the neighbours' mean velocity taken on a step
  float dynamic_viscosity = 0;  // Pa s, fluid on fluid and on cloth
  float wall_viscosity = 0;     // Pa s, fluid on domain walls: the physical one
  // viscosity of the incompressible solver
  float viscous_tolerance = 1e-4f;  // residual of the solve over its right side, in RMS
  int most_viscous_iterations = 200;
  bool no_slip = false;                                    // at the domain's walls
  bool no_slip_obstacles = false, no_slip_sheets = false;  // at any of them
  float wall_velocity[3][2][3] = {};  // m/s, of an axis' lower and upper wall, along them
  float gravity[3] = {0, 0, 0};       // m/s^2, that moves what is free to
  float held[3] = {0, 0, 0};          // m/s^2, gravity between the walls of a full box: pressure
  float surface_tension = 0;          // N/m
  float wetting = 0;                  // cosine of the contact angle at the domain's walls
  bool wets = false;                  // at anything at another angle than a right one
  bool turns = false;                 // the domain does, as FrameNow says
  float carried = 0;                  // m/s^2, bound of the centrifugal acceleration in it
  // domain, in the local frame
  double origin[3] = {0, 0, 0};  // m, local = world - origin
  float low[3], high[3];         // m, local
  bool wall[3] = {true, true, true}, periodic[3] = {false, false, false};  // neither is open
  int obstacles = 0, sinks = 0;
  // cloth
  bool fluid = true;             // any source of particles
  float cloth_dt_limit = 1e30f;  // s, of the stiffest vertex
  bool shells = false;           // any sheet is one
  bool factors_sheets = true;    // beside fluid, on the CPU, where it pays; else only sweeps
  bool wet_sheets = false;       // any takes up water, or starts wet
  bool self_contact = false;     // any sheet meets itself and others
  bool ties = false;             // pins that do more than hold where a vertex starts, or seams
  bool paper = false;            // coupling scheme
  bool every_path = false;       // is tested, also of what cannot meet a sheet: for tests
  float shell_margin = 0;        // m, that walls keep from shells where nothing else is; 0: not so
  // air, which moves as WindNow says; 0: none
  float air_density = 0;                     // kg/m^3
  float cloth_drag = 0, cloth_friction = 0;  // coefficients across and along a sheet
  float fluid_drag = 0;                      // times the drag of drops
  // time
  double fixed_dt = 0;  // s, 0 is adaptive
};

/// Sets the gravity of a step, m/s^2: what the walls of a full box hold is pressure alone.
void set_gravity(Parameters& parameters, const float (&gravity)[3]);

/// dt nu / h^2, which rules how viscosity is stepped. The largest eigenvalue of the viscous matrix
/// is about 50 times as large: up to 0.01 an explicit step is stable with room for clumps.
inline float viscous_strength(const Parameters& p, double dt) {
  return float(dt) * p.dynamic_viscosity / (p.rest_density * p.support_radius * p.support_radius);
}
/// The share of the neighbours' mean velocity (XSPH) that does to smooth flows what viscosity does:
/// the kernel (WendlandC2) has a second moment of h^2 / 15 along an axis.
inline float smoothing_of_viscosity(const Parameters& p, double dt) {
  return 30.f * viscous_strength(p, dt);
}
/// A viscosity that is less than a hundredth of the smoothing of a step is added to that. Not where
/// anything holds the fluid: smoothing lets slip.
inline bool smoothing_takes_viscosity(const Parameters& p, double dt) {
  return !(p.no_slip || p.no_slip_obstacles || p.no_slip_sheets) &&
         smoothing_of_viscosity(p, dt) <= 0.01f * p.xsph;
}
/// Sheets may be far lighter than the fluid that they hold: beside them it always is.
inline bool viscosity_is_implicit(const Parameters& p, double dt) {
  return p.incompressible && (viscous_strength(p, dt) > 0.01f || p.no_slip_sheets);
}

/// Room for a particle (passes/coupling/collision_rounds.h) that walls leave before cloth,
/// spacings.
constexpr float cloth_wall_margin = 0.25f;

/// The same where there are shells alone, which need room for themselves only: thicknesses of the
/// thickest, of which half is in the sheet.
constexpr float shell_wall_margin = 0.75f;

/// Whether sheets make implicit steps (sim/passes/cloth/cloth_implicit.h), or explicit substeps:
/// these have nothing that holds a vertex at an obstacle, or takes it along.
inline bool sheets_are_implicit(const Parameters& p) {
  return p.fluid ? p.incompressible : p.obstacles > 0 || p.shells || p.ties;
}

/// Bounds that rule the next step, from the state at the end of a step.
struct Limits {
  float max_speed = 0;         // m/s, fluid and cloth
  float max_acceleration = 0;  // m/s^2, fluid
  float residual = 0;          // mean density error that the pressure solve left, over rest
  int iterations = 0;          // of the pressure solve
  int sheet_sweeps = 0;        // of the conjugate gradients of the sheets
  int sheets_cut_short = 0;    // 1: these were too few for their tolerance at the end of the step
  float viscous_residual = 0;  // RMS that a viscous solve cut short left, over that of the velocity
  int viscous_iterations = 0;  // of the viscous solve
  float step = 0;              // s, of the step that was made
  float pressure = 0;          // peak of the pressure solve, over rest density, m^2/s^2
  int bad_particle = -1;       // index of the first particle that is not finite or absurdly fast
  int bad_vertex = -1;
};

}  // namespace drench::sim
