#include "tests/sim/skip_terms.h"

#include "tests/sim/support.h"

namespace drench::sim_tests {
namespace {

/// A block of water that falls onto a floor, all that may be left out left out.
Shot water(FluidSolver solver) {
  Shot shot = empty_shot();
  shot.timeline = {1001, 1010, 100};
  shot.gravity = V3d(0, -9.81, 0);
  shot.fluid.solver = solver;
  shot.domain.axis[1] = Axis::walls;
  shot.time_step = solver == FluidSolver::incompressible ? 1e-3 : 2e-4;
  shot.fluid.xsph = shot.fluid.kinematic_viscosity = 0;
  shot.fluid.sound_speed = 20;  // m/s; chosen by itself it is ready for emitters yet to start
  add_box(shot, V3d(-0.04, -0.985, -0.04), {8, 8, 8}, V3d(0.3, -0.5, 0));
  return shot;
}
/// The same above a sheet that is pinned at its edges.
Shot on_sheet(FluidSolver solver) {
  Shot shot = water(solver);
  pin_edges(add_sheet(shot, 0.2, -0.99, 8));
  Cloth& sheet = shot.cloth[0];
  sheet.retardation_time = sheet.damping = sheet.spring_damping = 0;
  return shot;
}

/// The same above a shell.
Shot on_shell(FluidSolver solver) {
  Shot shot = on_sheet(solver);
  shot.cloth[0].model = ClothModel::shell;
  return shot;
}
void bend(Shot& shot, double rigidity) {
  for (Cloth& sheet : shot.cloth) sheet.bend_warp = sheet.bend_weft = sheet.bend_bias = rigidity;
}
/// The same above a shell that stretches and does nothing else.
Shot on_bare_shell(FluidSolver solver) {
  Shot shot = on_shell(solver);
  Cloth& sheet = shot.cloth[0];
  sheet.damping_time = 0, sheet.stretch_limit = 100, sheet.self_collision = false;
  bend(shot, 0);
  return shot;
}
/// Above a bare shell and a second one below it, within reach, that goes through it.
Shot on_two_shells(FluidSolver solver) {
  Shot shot = on_bare_shell(solver);
  Cloth& lower = shot.cloth.emplace_back(shot.cloth[0]);
  lower.name = "lower", lower.corner.y -= 1.2 * lower.thickness, lower.velocity.y = 0.1;
  return shot;
}
/// Those two without water.
Shot two_shells(FluidSolver solver) {
  Shot shot = on_two_shells(solver);
  shot.fluid.box.clear();
  return shot;
}
/// A shell that swings about an edge, without water.
Shot swinging_shell(FluidSolver solver) {
  Shot shot = on_bare_shell(solver);
  shot.fluid.box.clear();
  Cloth& sheet = shot.cloth[0];
  sheet.corner.y = 0;
  sheet.pin[0].vertices = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  return shot;
}

void lay_shell(Shot& shot, double height) {
  Cloth& sheet = add_sheet(shot, 0.2, height, 8);
  sheet.model = ClothModel::shell;
  pin_edges(sheet);
}
void sew(Cloth& cloth, const std::vector<uint32_t>& from, const std::vector<uint32_t>& to) {
  ClothSeam& seam = cloth.seam.emplace_back();
  seam.vertices = from, seam.to_vertices = to;
  seam.stiffness = 0.05;
}
void blow(Shot& shot) {
  shot.wind.present = true, shot.wind.velocity = V3d(9, 0, 0), shot.wind.fluid_drag = 0;
}
void blow_on_fluid(Shot& shot) { blow(shot), shot.wind.fluid_drag = 1; }
void still_air(Shot& shot) { blow_on_fluid(shot), shot.wind.air_density = 0; }
void ball(Shot& shot, const V3d& centre) {
  Obstacle obstacle;
  obstacle.name = "ball", obstacle.type = ObstacleType::sphere, obstacle.radius = 0.03;
  obstacle.position = centre;
  shot.obstacle.push_back(obstacle);
}
void drain(Shot& shot, const V3d& centre) {
  Sink sink;
  sink.shape.name = "drain", sink.shape.type = ObstacleType::sphere, sink.shape.radius = 0.03;
  sink.shape.position = centre;
  shot.sink.push_back(sink);
}
/// The same beside a ball, along which it slips whatever its viscosity.
Shot beside_ball(FluidSolver solver) {
  Shot shot = water(solver);
  ball(shot, V3d(0.06, -0.98, 0));
  return shot;
}
/// The same with a surface that is tense.
Shot tense(FluidSolver solver) {
  Shot shot = water(solver);
  shot.fluid.surface_tension = 0.072;
  return shot;
}
/// The same with walls that hold it.
Shot held_by_walls(FluidSolver solver) {
  Shot shot = water(solver);
  shot.domain.slip = Slip::none, shot.fluid.kinematic_viscosity = 1e-5;
  return shot;
}
void inlet(Shot& shot, double start) {
  FluidEmitter emitter;
  emitter.center = V3d(0, -0.5, 0), emitter.radius = 0.03, emitter.speed = 1, emitter.start = start;
  shot.fluid.emitter.push_back(emitter);
}

constexpr FluidSolver projected = FluidSolver::incompressible,
                      compressible = FluidSolver::weakly_compressible;

const Term terms[] = {
    {"xsph",
     projected,
     water,
     [](Shot& s) { s.fluid.xsph = 0.05; },
     [](Shot& s) { s.fluid.xsph = 0; },
     Leaves::the_plan,
     {"smooth_velocities"},
     {}},
    {"explicit_viscosity",
     projected,
     water,
     [](Shot& s) { s.fluid.kinematic_viscosity = 1e-5; },
     [](Shot& s) { s.fluid.kinematic_viscosity = 0; },
     Leaves::the_plan,
     {"apply_viscosity"},
     {}},
    {"implicit_viscosity",
     projected,
     water,
     [](Shot& s) { s.fluid.kinematic_viscosity = 1e-2; },
     [](Shot& s) { s.fluid.kinematic_viscosity = 0; },
     Leaves::the_plan,
     {"apply_viscosity"},
     {"implicit viscosity"}},
    {"no_slip_walls",
     projected,
     water,
     [](Shot& s) { s.domain.slip = Slip::none, s.fluid.kinematic_viscosity = 1e-5; },
     [](Shot& s) { s.domain.slip = Slip::none; },
     Leaves::the_plan,
     {"apply_viscosity"},
     {}},
    {"moving_wall",
     projected,
     held_by_walls,
     [](Shot& s) { s.domain.wall_velocity.y_low = V3d(0.5, 0, 0); },
     [](Shot& s) { s.domain.wall_velocity.y_high = V3d(0.5, 0, 0); },
     Leaves::the_plan,
     {},
     {}},
    {"no_slip_obstacle",
     projected,
     beside_ball,
     [](Shot& s) { s.obstacle[0].slip = Slip::none, s.fluid.kinematic_viscosity = 1e-5; },
     [](Shot& s) { s.obstacle[0].slip = Slip::none; },
     Leaves::the_plan,
     {"apply_viscosity", "find_body_drag"},
     {"drag of obstacles and cloth"}},
    {"no_slip_sheet",
     projected,
     on_sheet,
     [](Shot& s) { s.cloth[0].slip = Slip::none, s.fluid.kinematic_viscosity = 1e-5; },
     [](Shot& s) { s.cloth[0].slip = Slip::none; },
     Leaves::the_plan,
     {"apply_viscosity", "find_body_drag"},
     {"implicit viscosity", "drag of obstacles and cloth", "drag of cloth"}},
    {"surface_tension",
     projected,
     water,
     [](Shot& s) { s.fluid.surface_tension = 0.072; },
     [](Shot& s) { s.fluid.surface_tension = 0; },
     Leaves::the_plan,
     {"apply_surface_tension"},
     {"surface tension"}},
    {"contact_angle",
     projected,
     tense,
     [](Shot& s) { s.domain.contact_angle_deg = 60; },
     [](Shot& s) { s.domain.contact_angle_deg = 90; },
     Leaves::the_plan,
     {"apply_contact_angles"},
     {"contact angles"}},
    {"wind_on_fluid",
     projected,
     water,
     blow_on_fluid,
     still_air,
     Leaves::the_plan,
     {"wind_on_fluid"},
     {}},
    {"drag_of_fluid",
     projected,
     water,
     blow_on_fluid,
     blow,
     Leaves::the_plan,
     {"wind_on_fluid"},
     {}},
    {"wind_on_cloth",
     projected,
     on_sheet,
     blow,
     still_air,
     Leaves::the_plan,
     {"wind_on_cloth"},
     {"air on cloth"}},
    {"wind_on_explicit_cloth",
     compressible,
     on_sheet,
     blow,
     still_air,
     Leaves::the_plan,
     {},
     {"air on cloth"}},
    {"retardation",
     projected,
     on_sheet,
     [](Shot& s) { s.cloth[0].retardation_time = 0.005; },
     [](Shot& s) { s.cloth[0].retardation_time = 0; },
     Leaves::the_plan,
     {},
     {}},
    {"damping_of_springs",
     projected,
     on_sheet,
     [](Shot& s) { s.cloth[0].spring_damping = 0.1; },
     [](Shot& s) { s.cloth[0].spring_damping = 0; },
     Leaves::the_plan,
     {},
     {}},
    {"damping",
     projected,
     on_sheet,
     [](Shot& s) { s.cloth[0].damping = 20; },
     [](Shot& s) { s.cloth[0].damping = 0; },
     Leaves::the_plan,
     {},
     {}},
    {"soaking",
     projected,
     on_shell,
     [](Shot& s) { s.cloth[0].soaks = true, s.cloth[0].soak_time = 0.02; },
     [](Shot& s) { s.cloth[0].wetness = 0, s.cloth[0].dry_time = 1; },
     Leaves::the_plan,
     {"wet_cloth"},
     {"wet cloth"}},
    {"damping_of_explicit_cloth",
     compressible,
     on_sheet,
     [](Shot& s) { s.cloth[0].damping = 20; },
     [](Shot& s) { s.cloth[0].damping = 0; },
     Leaves::the_plan,
     {},
     {}},
    {"emitter",
     projected,
     water,
     [](Shot& s) { inlet(s, 0); },
     [](Shot& s) { inlet(s, 1e6); },
     Leaves::the_plan,
     {},
     {}},
    {"emitter_weakly_compressible",
     compressible,
     water,
     [](Shot& s) { inlet(s, 0); },
     [](Shot& s) { inlet(s, 1e6); },
     Leaves::the_plan,
     {},
     {}},
    {"sink",
     projected,
     water,
     [](Shot& s) { drain(s, V3d(0.02, -0.99, 0)); },
     [](Shot& s) { drain(s, V3d(0, 0.7, 0)); },
     Leaves::the_bits,
     {},
     {"sinks"}},
    {"sink_weakly_compressible",
     compressible,
     water,
     [](Shot& s) { drain(s, V3d(0.02, -0.99, 0)); },
     [](Shot& s) { drain(s, V3d(0, 0.7, 0)); },
     Leaves::the_bits,
     {},
     {"sinks"}},
    {"obstacle",
     projected,
     water,
     [](Shot& s) { ball(s, V3d(0.1, -0.99, 0)); },
     [](Shot& s) { ball(s, V3d(0, 0.7, 0)); },
     Leaves::the_bits,
     {"predict_around_obstacles", "project_around_obstacles"},
     {"obstacles", "momentum that obstacles stop"}},
    {"bending_of_shell",
     projected,
     on_bare_shell,
     [](Shot& s) { bend(s, 1e-4); },
     [](Shot& s) { bend(s, 0); },
     Leaves::the_plan,
     {},
     {}},
    {"damping_in_shell",
     projected,
     on_bare_shell,
     [](Shot& s) { s.cloth[0].damping_time = 0.005; },
     [](Shot& s) { s.cloth[0].damping_time = 0; },
     Leaves::the_plan,
     {},
     {}},
    {"damping_of_shell",
     projected,
     on_bare_shell,
     [](Shot& s) { s.cloth[0].damping = 20; },
     [](Shot& s) { s.cloth[0].damping = 0; },
     Leaves::the_plan,
     {},
     {}},
    {"stretch_limit_of_shell",
     projected,
     on_bare_shell,
     [](Shot& s) { s.cloth[0].stretch_limit = 1.0001; },
     [](Shot& s) { s.cloth[0].stretch_limit = 1.05; },
     Leaves::the_plan,
     {},
     {}},
    {"wet_constants_of_shell",
     projected,
     on_shell,
     [](Shot& s) { s.cloth[0].wetness = 1; },
     [](Shot& s) {
       Cloth& sheet = s.cloth[0];
       sheet.water_capacity = 1, sheet.soak_time = 0.01;
       sheet.wet_modulus_ratio = 0.1, sheet.wet_friction = 0.1;
     },
     Leaves::the_plan,
     {"wet_cloth"},
     {"wet cloth"}},
    {"no_slip_shell",
     projected,
     on_shell,
     [](Shot& s) { s.cloth[0].slip = Slip::none, s.fluid.kinematic_viscosity = 1e-5; },
     [](Shot& s) { s.cloth[0].slip = Slip::none; },
     Leaves::the_plan,
     {"apply_viscosity", "find_body_drag"},
     {"implicit viscosity", "drag of obstacles and cloth", "drag of cloth"}},
    {"wind_on_shell",
     projected,
     on_shell,
     blow,
     still_air,
     Leaves::the_plan,
     {"wind_on_cloth"},
     {"air on cloth"}},
    {"shell",
     projected,
     water,
     [](Shot& s) { lay_shell(s, -0.99); },
     [](Shot& s) { lay_shell(s, 0.5); },
     Leaves::the_bits,
     {"polygon_grid", "nearest_triangle", "sheet_side", "sort_near", "start_rows",
      "linearise_shell", "linearise_cloth", "start_sheet_rows", "move_with_sheets"},
     {"cloth", "topology of cloth", "substeps of cloth", "forces on cloth", "polygon grid",
      "implicit step of cloth", "last step of shells", "implicit step of shells",
      "contact among sheets", "nearest triangles", "remembered sides", "near list of cloth",
      "rows of cloth", "rows of cloth in the pressure solve", "loads of cloth", "starts of paths",
      "paths", "drift of paths"}},
    {"contact_of_shells",
     projected,
     on_two_shells,
     [](Shot& s) { s.cloth[0].self_collision = s.cloth[1].self_collision = true; },
     [](Shot& s) { s.cloth[0].self_collision = true; },  // with itself alone
     Leaves::the_bits,
     {"start_sheet_rows"},
     {"contact among sheets"}},
    {"contact_of_shells_without_water",
     projected,
     two_shells,
     [](Shot& s) { s.cloth[0].self_collision = s.cloth[1].self_collision = true; },
     [](Shot& s) { s.cloth[0].self_collision = true; },
     Leaves::the_bits,
     {},
     {"contact among sheets"}},
    {"seam_of_shell",
     projected,
     on_shell,
     [](Shot& s) { sew(s.cloth[0], {30}, {31}); },
     [](Shot& s) { sew(s.cloth[0], {0}, {1}); },  // of its pinned edge
     Leaves::the_bits,
     {},
     {}},
    {"obstacle_under_shell",
     projected,
     on_shell,
     [](Shot& s) { ball(s, V3d(0, -1.03, 0)); },
     [](Shot& s) { ball(s, V3d(0, 0.7, 0)); },
     Leaves::the_bits,
     {"predict_around_obstacles", "project_around_obstacles"},
     {"obstacles", "cloth at obstacles", "momentum that obstacles stop"}},
    {"obstacle_at_swinging_shell",
     projected,
     swinging_shell,
     [](Shot& s) { ball(s, V3d(0, -0.04, 0)); },
     [](Shot& s) { ball(s, V3d(0, 0.7, 0)); },
     Leaves::the_bits,
     {},
     {"obstacles", "cloth at obstacles", "momentum that obstacles stop", "contact among sheets"}},
    {"sheet",
     projected,
     water,
     [](Shot& s) { pin_edges(add_sheet(s, 0.2, -0.99, 8)); },
     [](Shot& s) { pin_edges(add_sheet(s, 0.2, 0.5, 8)); },
     Leaves::the_bits,
     {"polygon_grid", "nearest_triangle", "sheet_side", "sort_near", "start_rows",
      "linearise_cloth", "move_with_sheets"},
     {"cloth", "topology of cloth", "substeps of cloth", "forces on cloth", "polygon grid",
      "implicit step of cloth", "nearest triangles", "remembered sides", "near list of cloth",
      "rows of cloth", "rows of cloth in the pressure solve", "loads of cloth", "starts of paths",
      "paths", "drift of paths"}},
    {"moving_pin",
     projected,
     on_sheet,
     [](Shot& s) {
       s.cloth[0].pin[0].position.keys = {{1001, V3d(0)}, {1003, V3d(0, 2e-3, 0)}};
     },
     [](Shot& s) { s.cloth[0].pin[0].release = 100; },
     Leaves::the_bits,
     {},
     {"pins that move"}},
    {"seam",
     projected,
     on_sheet,
     [](Shot& s) { sew(s.cloth[0], {30}, {31}); },
     [](Shot& s) { sew(s.cloth[0], {0}, {1}); },  // of its pinned edge
     Leaves::the_bits,
     {},
     {}},
    {"obstacle_under_cloth",
     projected,
     on_sheet,
     [](Shot& s) { ball(s, V3d(0, -1.03, 0)); },
     [](Shot& s) { ball(s, V3d(0, 0.7, 0)); },
     Leaves::the_bits,
     {"predict_around_obstacles", "project_around_obstacles"},
     {"obstacles", "cloth at obstacles", "momentum that obstacles stop"}},
};

}  // namespace

std::span<const Term> skip_terms() { return terms; }

}  // namespace drench::sim_tests
