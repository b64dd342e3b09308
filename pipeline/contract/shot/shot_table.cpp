#include "pipeline/contract/shot/shot_table.h"

#include "pipeline/contract/shot/shot_rows.h"

namespace drench::shot_table {

namespace {

template <size_t I>
void* axis_field(void* domain) {
  return &static_cast<Domain*>(domain)->axis[I];
}

template <size_t I>
Row axis_row(std::string_view key, std::string_view description) {
  Row row;
  row.section = "domain";
  row.key = key;
  row.kind = Kind::choice;
  row.stages = simulate;
  row.description = description;
  row.field = axis_field<I>;
  return row.choice<Axis>();
}

Row grid_pins_row() {
  Row row;
  row.section = "cloth";
  row.key = "pins";
  row.kind = Kind::grid_pins;
  row.stages = simulate;
  row.description =
      "held vertices of a grid: one or an array of these names; u0 is the edge where u starts. "
      "Turned into [[cloth.pin]] vertices. A sheet that spans a periodic axis has no rim there, "
      "but "
      "rim and corners hold that line, too: name the two other edges";
  row.choices.assign(enum_names<GridPins>.begin(), enum_names<GridPins>.end());
  return row;
}

constexpr const char* contact_angle =
    "at which the fluid's surface meets it, measured within the fluid, where there is "
    "fluid.surface_tension: below 90 it wets, above it beads";

std::vector<Parameter> shot_rows() {
  return {
      row<&Shot::name>("shot", "name", "", none, render,
                       "name in file names and headers; the file's stem unless given")
          .as(Kind::text),
      row<&Shot::timeline>(
          "shot", "frames", "frame", {-9999999, 9999999}, simulate,
          "[first, last], inclusive; the first is the initial state. Only the first "
          "is part of a simulation's identity"),
      row<&Shot::timeline, &Timeline::fps>("shot", "fps", "1/s", {0.01, 1e5}, simulate | render,
                                           "frames a second"),
      row<&Shot::preroll>("shot", "preroll", "s", {0, 1000}, simulate,
                          "time simulated before the first frame"),
      row<&Shot::seed>("shot", "seed", "", seeds, simulate,
                       "of everything drawn by chance in the simulation"),
      row<&Shot::gravity>(
          "shot", "gravity", "m/s^2", speed, simulate,
          "acceleration of everything; may be animated, as in a tank that is shaken: less the "
          "tank's own acceleration"),
      row<&Shot::frame_rotation_deg>(
          "shot", "frame_rotation_deg", "deg", turns, simulate,
          "angle by which the domain with all in it is turned about frame_axis: fluid and sheets "
          "feel the centrifugal, Coriolis and Euler forces, and gravity, which stays the world's, "
          "turns in it. Positions, velocities and wind are relative to the domain. It turns evenly "
          "between keys, not at all before and after them; at the start all moves with it; may be "
          "animated"),
      row<&Shot::frame_axis>("shot", "frame_axis", "", coordinate, simulate,
                             "about which the domain turns, right-handed; any length but 0"),
      row<&Shot::frame_center>("shot", "frame_center", "m", coordinate, simulate,
                               "a point of that axis"),
      row<&Shot::time_step>("shot", "time_step", "s", {0, 1}, simulate,
                            "fixed step; 0 chooses the largest stable one, step by step"),

      row<&Domain::min>("domain", "min", "m", coordinate, simulate,
                        "lower corner; walls stand here, and periodic axes begin"),
      row<&Domain::max>("domain", "max", "m", coordinate, simulate,
                        "upper corner; walls stand here, and periodic axes begin anew"),
      axis_row<0>("x",
                  "both ends of the x axis; periodic ones are one and the same place, "
                  "and a sheet that spans the axis is joined to itself there"),
      axis_row<1>("y",
                  "both ends of the y axis; periodic ones are one and the same place, "
                  "and a sheet that spans the axis is joined to itself there"),
      axis_row<2>("z",
                  "both ends of the z axis; periodic ones are one and the same place, "
                  "and a sheet that spans the axis is joined to itself there"),
      row<&Domain::slip>("domain", "slip", "", none, simulate,
                         "how the incompressible solver's fluid meets these walls: free, or none "
                         "(it moves with them). automatic is none if a layer that a wall brakes "
                         "grows a spacing thick within 1 s, sqrt(kinematic_viscosity 1 s) >= "
                         "spacing, or if a wall moves; thinner layers cannot be resolved: free"),

      row<&Domain::contact_angle_deg>("domain", "contact_angle_deg", "deg", {30, 150}, simulate,
                                      contact_angle),

      row<&WallVelocity::x_low>("domain.wall_velocity", "x_low", "m/s", speed, simulate,
                                "of the wall at min x; its own x must be 0"),
      row<&WallVelocity::x_high>("domain.wall_velocity", "x_high", "m/s", speed, simulate,
                                 "of the wall at max x"),
      row<&WallVelocity::y_low>("domain.wall_velocity", "y_low", "m/s", speed, simulate,
                                "of the wall at min y; its own y must be 0"),
      row<&WallVelocity::y_high>("domain.wall_velocity", "y_high", "m/s", speed, simulate,
                                 "of the wall at max y"),
      row<&WallVelocity::z_low>("domain.wall_velocity", "z_low", "m/s", speed, simulate,
                                "of the wall at min z; its own z must be 0"),
      row<&WallVelocity::z_high>("domain.wall_velocity", "z_high", "m/s", speed, simulate,
                                 "of the wall at max z"),
  };
}

std::vector<Parameter> fluid_rows() {
  return {
      row<&Fluid::spacing>("fluid", "spacing", "m", {1e-5, 10}, simulate | mesh,
                           "distance a of particles at rest; a particle has mass rest_density a^3"),
      row<&Fluid::support_ratio>("fluid", "support_ratio", "", {0, 6}, simulate,
                                 "support radius of the kernels / spacing; 0 is 2.15 for the "
                                 "incompressible solver and 2 for the weakly compressible one"),
      row<&Fluid::solver>("fluid", "solver", "", none, simulate,
                          "incompressible solves for the pressure that keeps the density, in large "
                          "steps; weakly_compressible follows sound, in small ones. automatic is "
                          "incompressible but for coupling.scheme \"paper\""),
      row<&Fluid::tolerance>("fluid", "tolerance", "", {1e-7, 0.1}, simulate,
                             "of the incompressible solver: mean error of the density over rest "
                             "density that a step may leave. The one knob of quality against time"),
      row<&Fluid::xsph>("fluid", "xsph", "", {0, 1}, simulate,
                        "of the incompressible solver: share of its neighbours' mean velocity that "
                        "a particle takes on every step"),
      row<&Fluid::rest_density>("fluid", "rest_density", "kg/m^3", {1, 1e5}, simulate, "at rest"),
      row<&Fluid::kinematic_viscosity>("fluid", "kinematic_viscosity", "m^2/s", {0, 1000}, simulate,
                                       "of the fluid; water has 1e-6"),
      row<&Fluid::surface_tension>(
          "fluid", "surface_tension", "N/m", {0, 100}, simulate,
          "of the incompressible solver: surface tension against air; water has 0.072. Surfaces "
          "meet walls, obstacles and sheets at their contact_angle_deg"),
      row<&Fluid::artificial_viscosity>(
          "fluid", "artificial_viscosity", "", {0, 10}, simulate,
          "of the weakly compressible solver: alpha of Monaghan 1992; 0 is none"),
      row<&Fluid::sound_speed>(
          "fluid", "sound_speed", "m/s", {0, 1e4}, simulate,
          "of the weakly compressible solver: stiffness; 0 chooses ten times the "
          "largest speed expected"),
      row<&Fluid::write_source>(
          "fluid", "write_source", "", none, simulate,
          "particles and the mesh's vertices get the number of their source: boxes, spheres, "
          "drops, volumes, then emitters, each in the order of the shot, from 0"),
      row<&Fluid::write_age>("fluid", "write_age", "", none, simulate,
                             "particles and the mesh's vertices get their time in the shot, s"),
      row<&Fluid::material>("fluid", "material", "", none, render, "name of a [[material]]"),

      row<&FluidBox::min>("fluid.box", "min", "m", coordinate, simulate, "lower corner").needed(),
      row<&FluidBox::max>("fluid.box", "max", "m", coordinate, simulate, "upper corner").needed(),
      row<&FluidBox::velocity>("fluid.box", "velocity", "m/s", speed, simulate, "at the start"),

      row<&FluidSphere::center>("fluid.sphere", "center", "m", coordinate, simulate, "centre")
          .needed(),
      row<&FluidSphere::radius>("fluid.sphere", "radius", "m", {0, 1e4}, simulate, "radius")
          .needed(),
      row<&FluidSphere::velocity>("fluid.sphere", "velocity", "m/s", speed, simulate,
                                  "at the start"),

      row<&FluidDrops::min>("fluid.drops", "min", "m", coordinate, simulate,
                            "lower corner of the centres")
          .needed(),
      row<&FluidDrops::max>("fluid.drops", "max", "m", coordinate, simulate,
                            "upper corner of the centres")
          .needed(),
      row<&FluidDrops::velocity>("fluid.drops", "velocity", "m/s", speed, simulate, "at the start"),
      row<&FluidDrops::radius>("fluid.drops", "radius", "m", {0, 1e4}, simulate, "of a drop")
          .needed(),
      row<&FluidDrops::count>("fluid.drops", "count", "", {0, 1e6}, simulate, "number of drops")
          .needed(),
      row<&FluidDrops::particles>(
          "fluid.drops", "particles", "", {0, 2e8}, simulate,
          "exactly so many particles in all; 0: as many as the radius holds"),
  };
}

std::vector<Parameter> cloth_rows() {
  return {
      row<&Cloth::name>(
          "cloth", "name", "", none, simulate | render,
          "name of the sheet, part of its file names; cloth, cloth2, ... unless given")
          .identity(),
      row<&Cloth::corner>("cloth", "corner", "m", coordinate, simulate,
                          "grid: where u and v start"),
      row<&Cloth::u>("cloth", "u", "m", coordinate, simulate, "grid: one edge"),
      row<&Cloth::v>("cloth", "v", "m", coordinate, simulate, "grid: the other edge"),
      row<&Cloth::cells>(
          "cloth", "cells", "", {1, 4096}, simulate,
          "grid: [along u, along v]; vertex j (cells_u + 1) + i stands at i along u"),
      row<&Cloth::mesh_file>("cloth", "mesh", "", none, simulate,
                             "PLY or OBJ file of triangles instead of a grid"),
      row<&Cloth::weld>("cloth", "weld", "m", {-1, 1}, simulate,
                        "mesh: vertices on free edges within this distance of one another are "
                        "sewn, as exporters split them at seams of the texture; 0 keeps them "
                        "apart, -1 is 1e-5 of the mesh's diagonal"),
      grid_pins_row(),
      row<&Cloth::velocity>("cloth", "velocity", "m/s", speed, simulate, "at the start"),
      row<&Cloth::areal_density>("cloth", "areal_density", "kg/m^2", {1e-4, 1e4}, simulate,
                                 "mass of an area; cotton has about 0.2"),
      row<&Cloth::adjacent_stiffness>("cloth", "adjacent_stiffness", "N/m", {0, 1e9}, simulate,
                                      "two-dimensional modulus of the springs along edges"),
      row<&Cloth::diagonal_stiffness>(
          "cloth", "diagonal_stiffness", "N/m", {0, 1e9}, simulate,
          "of the springs along both diagonals; half of adjacent_stiffness is isotropic"),
      row<&Cloth::damping>("cloth", "damping", "1/s", {0, 1e4}, simulate,
                           "rate at which velocity is lost"),
      row<&Cloth::spring_damping>("cloth", "spring_damping", "", {0, 1}, simulate,
                                  "along each spring, fraction of critical; keeps momentum"),
      row<&Cloth::retardation_time>("cloth", "retardation_time", "s", {0, 1}, simulate,
                                    "inner friction, viscosity over stiffness of every spring: a "
                                    "swing of period T loses 1 - exp(-2 pi^2 t / T) of its height "
                                    "with this t; cotton about 0.005. Beside incompressible fluid "
                                    "only"),
      row<&Cloth::thickness>("cloth", "thickness", "m", {1e-6, 1}, simulate, "thickness"),
      row<&Cloth::slip>("cloth", "slip", "", none, simulate,
                        "how the incompressible solver's fluid meets it: free, or none (it moves "
                        "with the sheet, which it drags along). automatic is as that of "
                        "domain.slip"),
      row<&Cloth::contact_angle_deg>("cloth", "contact_angle_deg", "deg", {30, 150}, simulate,
                                     contact_angle),
      row<&Cloth::material>("cloth", "material", "", none, render, "name of a [[material]]"),
      row<&Cloth::matte>("cloth", "matte", "", none, render, matte_text),

      row<&ClothPin::vertices>("cloth.pin", "vertices", "", {0, 4294967294.0}, simulate,
                               "indices of vertices held where they start"),
      row<&ClothPin::box>(
          "cloth.pin", "box", "m", coordinate, simulate,
          "{min = [x, y, z], max = [x, y, z]}: every vertex inside it at the start"),

      row<&Coupling::scheme>("coupling", "scheme", "", none, simulate,
                             "exact, or paper: Harada, Koshizuka, Kawaguchi 2007 as published"),
  };
}

std::vector<Parameter> obstacle_rows() {
  constexpr unsigned all = simulate | mesh | render;
  return {
      row<&Obstacle::type>("obstacle", "type", "", none, all, "its shape").needed().identity(),
      row<&Obstacle::name>("obstacle", "name", "", none, all,
                           "obstacle, obstacle2, ... unless given")
          .identity(),
      row<&Obstacle::position>("obstacle", "position", "m", coordinate, all,
                               "a point of the plane, the centre of the box or sphere, the origin "
                               "of the mesh; may be animated"),
      row<&Obstacle::rotation_deg>("obstacle", "rotation_deg", "deg", {-360000, 360000}, all,
                                   "about x, then y, then z through position; may be animated"),
      row<&Obstacle::position>("obstacle", "interp", "", none, all,
                               "between the keys of position and rotation_deg")
          .interpolation({Interpolation::linear, Interpolation::smooth}),
      row<&Obstacle::normal>("obstacle", "normal", "", coordinate, all,
                             "points from the solid to the fluid; any length but 0")
          .only(ObstacleType::plane),
      row<&Obstacle::size>("obstacle", "size", "m", {0, 1e5}, all, "edges").only(ObstacleType::box),
      row<&Obstacle::radius>("obstacle", "radius", "m", {0, 1e5}, all, "radius")
          .only(ObstacleType::sphere),
      row<&Obstacle::mesh_file>("obstacle", "mesh", "", none, all,
                                "closed PLY or OBJ; with %04d in the name one file for every frame "
                                "of the shot, of the same triangles")
          .as(Kind::mesh_files)
          .only(ObstacleType::mesh),
      row<&Obstacle::scale>("obstacle", "scale", "", {1e-6, 1e6}, all,
                            "metres for a unit of the file")
          .only(ObstacleType::mesh),
      row<&Obstacle::friction>("obstacle", "friction", "", {0, 100}, simulate,
                               "Coulomb's coefficient of cloth on it"),
      row<&Obstacle::slip>("obstacle", "slip", "", none, simulate,
                           "how the incompressible solver's fluid meets it: free, or none (it "
                           "moves with the surface). automatic is as that of domain.slip, but that "
                           "motion does not matter"),
      row<&Obstacle::contact_angle_deg>("obstacle", "contact_angle_deg", "deg", {30, 150}, simulate,
                                        contact_angle),
      row<&Obstacle::material>("obstacle", "material", "", none, render, "name of a [[material]]"),
      row<&Obstacle::visible>("obstacle", "visible", "", none, render, "drawn"),
      row<&Obstacle::matte>("obstacle", "matte", "", none, render, matte_text),
  };
}

std::vector<Parameter> probe_rows() {
  return {
      row<&Probe::type>("probe", "type", "", none, simulate, "what is measured on every step")
          .needed()
          .identity(),
      row<&Probe::name>("probe", "name", "", none, simulate,
                        "part of its file's name, sim/probe.NAME.csv; probe, probe2, ... unless "
                        "given")
          .identity(),
      row<&Probe::position>("probe", "position", "m", coordinate, simulate,
                            "height: the vertical line through it; pressure: centre of the disc; "
                            "velocity: centre of the ball; tip: the vertex nearest to it at rest")
          .only(ProbeType::height, ProbeType::pressure, ProbeType::tip, ProbeType::velocity),
      row<&Probe::normal>("probe", "normal", "", coordinate, simulate,
                          "of the disc; any length but 0. A disc within half a spacing of a wall "
                          "of the domain, an obstacle or a sheet, and along it, measures what is "
                          "pushed there; of a sheet the side that it points to")
          .only(ProbeType::pressure),
      row<&Probe::radius>("probe", "radius", "m", {1e-6, 1e4}, simulate,
                          "of the disc or ball; below a spacing it counts as one")
          .only(ProbeType::pressure, ProbeType::velocity),
      row<&Probe::direction>("probe", "direction", "", coordinate, simulate,
                             "along which the farthest fluid is looked for; any length but 0")
          .only(ProbeType::front),
      row<&Probe::on>("probe", "on", "", none, simulate,
                      "an obstacle by name: position and normal are its own coordinates, in m from "
                      "its position along its turned axes, and move with it; a plane's y axis is "
                      "its normal")
          .as(Kind::label)
          .only(ProbeType::height, ProbeType::pressure, ProbeType::velocity),
      row<&Probe::interval>("probe", "interval", "s", {0, 1e6}, simulate,
                            "between rows, at ends of steps; 0: a row for every step"),
      row<&Probe::window>("probe", "window", "s", {0, 1}, simulate,
                          "the mean columns are means over so much time before each row")
          .only(ProbeType::pressure, ProbeType::force),
      row<&Probe::target>("probe", "target", "", none, simulate,
                          "what the fluid pushes: a domain wall, x_low to z_high, an obstacle or "
                          "a sheet, by name")
          .only(ProbeType::force),
      row<&Probe::cloth>("probe", "cloth", "", none, simulate, "name of the sheet")
          .only(ProbeType::tip),
      row<&Probe::vertex>("probe", "vertex", "", {-1, 2e9}, simulate,
                          "of the sheet; -1: the one nearest to position at rest")
          .only(ProbeType::tip),
  };
}

// ---- sections

template <auto MemberPointer>
Section single(std::string_view name, std::string_view description) {
  Section section;
  section.name = name;
  section.description = description;
  section.count = [](void*) { return size_t(1); };
  section.at = [](void* owner, size_t) { return field_of<MemberPointer>(owner); };
  return section;
}

Section inside(std::string_view parent, Section section) {
  section.parent = parent;
  return section;
}

template <auto MemberPointer>
Section repeated(std::string_view name, std::string_view parent, std::string_view description) {
  using Owner = typename Member<decltype(MemberPointer)>::Owner;
  Section section;
  section.name = name;
  section.parent = parent;
  section.description = description;
  section.repeated = true;
  section.count = [](void* owner) { return (static_cast<Owner*>(owner)->*MemberPointer).size(); };
  section.at = [](void* owner, size_t i) -> void* {
    return &(static_cast<Owner*>(owner)->*MemberPointer)[i];
  };
  section.append = [](void* owner) { (static_cast<Owner*>(owner)->*MemberPointer).emplace_back(); };
  return section;
}

template <class Object>
Section named(Section section) {
  section.name_of = [](void* object) -> const std::string* {
    return &static_cast<Object*>(object)->name;
  };
  return section;
}

template <class Object>
Section typed(Section section) {
  section.type_of = [](void* object) { return int(static_cast<Object*>(object)->type); };
  return named<Object>(section);
}

Section emitters(Section section) {
  section.type_of = [](void* object) { return int(static_cast<FluidEmitter*>(object)->type); };
  return section;
}

Section sinks(Section section) {
  section.type_of = [](void* object) { return int(static_cast<Sink*>(object)->shape.type); };
  section.name_of = [](void* object) -> const std::string* {
    return &static_cast<Sink*>(object)->shape.name;
  };
  return section;
}

Section whole_shot() {
  Section section;
  section.name = "shot";
  section.description = "Time, chance and gravity.";
  section.count = [](void*) { return size_t(1); };
  section.at = [](void* owner, size_t) { return owner; };
  return section;
}

}  // namespace

const std::vector<Section>& sections() {
  static const std::vector<Section> table{
      whole_shot(),
      single<&Shot::domain>("domain", "The space of the simulation and its walls."),
      inside("domain", single<&Domain::wall_velocity>(
                           "domain.wall_velocity",
                           "Walls that move along themselves, as belts do: they drag the fluid "
                           "of the incompressible solver.")),
      single<&Shot::fluid>("fluid", "The fluid. Without sources there is none."),
      repeated<&Fluid::box>("fluid.box", "fluid", "A block of fluid at the start."),
      repeated<&Fluid::sphere>("fluid.sphere", "fluid", "A ball of fluid at the start."),
      emitters(repeated<&Fluid::emitter>(
          "fluid.emitter", "fluid",
          "An inlet, or a mesh that is kept full, standing or moving as its "
          "keys say.")),
      repeated<&Fluid::drops>("fluid.drops", "fluid",
                              "Drops with centres drawn evenly in a box and kept apart."),
      repeated<&Fluid::volume>("fluid.volume", "fluid",
                               "A closed mesh full of fluid at the start."),
      named<Cloth>(repeated<&Shot::cloth>("cloth", "", "A sheet of cloth: a grid or a mesh file.")),
      repeated<&Cloth::pin>("cloth.pin", "cloth",
                            "Vertices held where they start: a list or a box."),
      typed<Obstacle>(repeated<&Shot::obstacle>(
          "obstacle", "", "A solid in the fluid, standing or moving as its keys say.")),
      sinks(repeated<&Shot::sink>(
          "sink", "", "A drain: takes away the fluid that comes into it. No solid, not drawn.")),
      single<&Shot::wind>("wind", "Air that drags fluid and cloth along, still or moving."),
      single<&Shot::coupling>("coupling", "How fluid and cloth push each other."),
      typed<Probe>(repeated<&Shot::probe>(
          "probe", "", "A measurement, a row for every step in `sim/probe.NAME.csv`.")),
      single<&Shot::surface>("surface", "The surface built around the particles."),
      single<&Shot::foam>("foam", "Spray, foam and bubbles, particles of their own."),
      single<&Shot::camera>("camera", "A thin-lens camera that looks along -Z of its own frame."),
      typed<Light>(repeated<&Shot::light>("light", "", "A light.")),
      typed<Material>(repeated<&Shot::material>(
          "material", "", "A material; water, cotton and ground are built in.")),
      single<&Shot::ground>("ground", "A plane under the scene; the simulation does not know it."),
      single<&Shot::render>("render", "The picture."),
      single<&Shot::layers>("layers", "What else a frame's EXR holds, for compositing."),
      single<&Shot::view>("view",
                          "How PNGs and movies show frames: by the built-in transform, or with any "
                          "of these keys by OpenColorIO."),
  };
  return table;
}

const std::vector<Parameter>& parameters() {
  static const std::vector<Parameter> table = [] {
    std::vector<Parameter> all;
    for (const auto& part :
         {shot_rows(), fluid_rows(), source_rows(), cloth_rows(), obstacle_rows(), probe_rows(),
          foam_rows(), surface_rows(), picture_rows()}) {
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  }();
  return table;
}

const Section* find_section(std::string_view name) {
  for (const Section& section : sections()) {
    if (section.name == name) return &section;
  }
  return nullptr;
}

const Parameter* find_parameter(std::string_view section, std::string_view key) {
  for (const Parameter& parameter : parameters()) {
    if (parameter.section == section && parameter.key == key) return &parameter;
  }
  return nullptr;
}

std::vector<const Parameter*> parameters_of(std::string_view section) {
  std::vector<const Parameter*> rows;
  for (const Parameter& parameter : parameters()) {
    if (parameter.section == section) rows.push_back(&parameter);
  }
  return rows;
}

bool applies(const Parameter& parameter, const Section& section, void* object) {
  if (section.type_of == nullptr) return true;
  return (parameter.types >> section.type_of(object) & 1u) != 0;
}

}  // namespace drench::shot_table
