#include "pipeline/contract/shot/shot_rows.h"

namespace drench::shot_table {

namespace {

std::vector<Parameter> emitter_rows() {
  return {
      row<&FluidEmitter::type>("fluid.emitter", "type", "", none, simulate,
                               "an inlet, or a closed mesh that is kept full")
          .identity(),
      row<&FluidEmitter::center>("fluid.emitter", "center", "m", coordinate, simulate,
                                 "centre of the inlet, or where the origin of the mesh stands; may "
                                 "be animated: the fluid takes on its velocity")
          .needed(),
      row<&FluidEmitter::direction>("fluid.emitter", "direction", "", coordinate, simulate,
                                    "the way the fluid leaves; any length but 0; may be animated")
          .only(EmitterType::disc),
      row<&FluidEmitter::center>("fluid.emitter", "interp", "", none, simulate,
                                 "between the keys of center, direction and rotation_deg")
          .interpolation({Interpolation::linear, Interpolation::smooth}),
      row<&FluidEmitter::radius>("fluid.emitter", "radius", "m", {0, 1e4}, simulate, "of the inlet")
          .only(EmitterType::disc),
      row<&FluidEmitter::u>("fluid.emitter", "u", "m", coordinate, simulate,
                            "half of one edge; the fluid leaves along u x v")
          .only(EmitterType::rectangle),
      row<&FluidEmitter::v>("fluid.emitter", "v", "m", coordinate, simulate,
                            "half of the other edge, at right angles to u")
          .only(EmitterType::rectangle),
      row<&FluidEmitter::speed>("fluid.emitter", "speed", "m/s", {0, 1000}, simulate,
                                "relative to the inlet")
          .only(EmitterType::disc, EmitterType::rectangle)
          .needed(),
      row<&FluidEmitter::mesh_file>("fluid.emitter", "mesh", "", none, simulate,
                                    "closed PLY or OBJ: every place in it of the lattice that "
                                    "begins at domain.min is filled whenever it is free")
          .only(EmitterType::mesh)
          .needed(),
      row<&FluidEmitter::rotation_deg>("fluid.emitter", "rotation_deg", "deg", turns, simulate,
                                       "about x, then y, then z through center; may be animated")
          .only(EmitterType::mesh),
      row<&FluidEmitter::scale>("fluid.emitter", "scale", "", {1e-6, 1e6}, simulate,
                                "metres for a unit of the file")
          .only(EmitterType::mesh),
      row<&FluidEmitter::inset>("fluid.emitter", "inset", "", {0, 1}, simulate,
                                "how deep inside the surface particles appear at least / spacing")
          .only(EmitterType::mesh),
      row<&FluidEmitter::velocity>("fluid.emitter", "velocity", "m/s", speed, simulate,
                                   "of new fluid, added to that of the mesh where it appears")
          .only(EmitterType::mesh),
      row<&FluidEmitter::start>("fluid.emitter", "start", "s", {0, 1e9}, simulate,
                                "after the simulation's start"),
      row<&FluidEmitter::stop>("fluid.emitter", "stop", "s", {0, 1e9}, simulate,
                               "after the simulation's start"),
  };
}

std::vector<Parameter> volume_rows() {
  return {
      row<&FluidVolume::mesh_file>("fluid.volume", "mesh", "", none, simulate,
                                   "closed PLY or OBJ; particles stand on the lattice that begins "
                                   "at domain.min")
          .needed(),
      row<&FluidVolume::position>("fluid.volume", "position", "m", coordinate, simulate,
                                  "where the origin of the mesh stands"),
      row<&FluidVolume::rotation_deg>("fluid.volume", "rotation_deg", "deg", turns, simulate,
                                      "about x, then y, then z through position"),
      row<&FluidVolume::scale>("fluid.volume", "scale", "", {1e-6, 1e6}, simulate,
                               "metres for a unit of the file"),
      row<&FluidVolume::inset>("fluid.volume", "inset", "", {0, 1}, simulate,
                               "how deep inside the surface particles stand at least / spacing: "
                               "0.5 stays within a vessel's walls, 0 gives the mesh's volume"),
      row<&FluidVolume::velocity>("fluid.volume", "velocity", "m/s", speed, simulate,
                                  "at the start"),
  };
}

std::vector<Parameter> sink_rows() {
  return {
      row<&Sink::shape, &Obstacle::type>("sink", "type", "", none, simulate, "its shape")
          .needed()
          .identity(),
      row<&Sink::shape, &Obstacle::name>("sink", "name", "", none, simulate,
                                         "in the log; sink, sink2, ... unless given")
          .identity(),
      row<&Sink::shape, &Obstacle::position>("sink", "position", "m", coordinate, simulate,
                                             "a point of the plane, the centre of the box or "
                                             "sphere, the origin of the mesh; may be animated"),
      row<&Sink::shape, &Obstacle::rotation_deg>(
          "sink", "rotation_deg", "deg", turns, simulate,
          "about x, then y, then z through position; may be animated"),
      row<&Sink::shape, &Obstacle::position>("sink", "interp", "", none, simulate,
                                             "between the keys of position and rotation_deg")
          .interpolation({Interpolation::linear, Interpolation::smooth}),
      row<&Sink::shape, &Obstacle::normal>("sink", "normal", "", coordinate, simulate,
                                           "points away from the side that takes fluid; any length "
                                           "but 0")
          .only(ObstacleType::plane),
      row<&Sink::shape, &Obstacle::size>("sink", "size", "m", {0, 1e5}, simulate, "edges")
          .only(ObstacleType::box),
      row<&Sink::shape, &Obstacle::radius>("sink", "radius", "m", {0, 1e5}, simulate, "radius")
          .only(ObstacleType::sphere),
      row<&Sink::shape, &Obstacle::mesh_file>("sink", "mesh", "", none, simulate,
                                              "closed PLY or OBJ")
          .only(ObstacleType::mesh),
      row<&Sink::shape, &Obstacle::scale>("sink", "scale", "", {1e-6, 1e6}, simulate,
                                          "metres for a unit of the file")
          .only(ObstacleType::mesh),
      row<&Sink::start>("sink", "start", "s", {0, 1e9}, simulate, "after the simulation's start"),
      row<&Sink::stop>("sink", "stop", "s", {0, 1e9}, simulate, "after the simulation's start"),
  };
}

std::vector<Parameter> wind_rows() {
  return {
      row<&Wind::present>("wind", "present", "", none, simulate,
                          "there is air; true when [wind] is written"),
      row<&Wind::velocity>("wind", "velocity", "m/s", speed, simulate,
                           "of the air; may be animated"),
      row<&Wind::air_density>("wind", "air_density", "kg/m^3", {0, 100}, simulate,
                              "0 is no air at all"),
      row<&Wind::gust>("wind", "gust", "m/s", {0, 100}, simulate,
                       "RMS of waves that are added to velocity and carried along by it; the same "
                       "for the same shot.seed"),
      row<&Wind::gust_size>("wind", "gust_size", "m", {1e-3, 1e5}, simulate,
                            "longest of these waves; the shortest is a quarter of it"),
      row<&Wind::cloth_drag>("wind", "cloth_drag", "", {0, 100}, simulate,
                             "drag coefficient across a sheet; square plates have 1.17"),
      row<&Wind::cloth_friction>("wind", "cloth_friction", "", {0, 100}, simulate,
                                 "drag coefficient along a sheet, of both sides"),
      row<&Wind::fluid_drag>("wind", "fluid_drag", "", {0, 100}, simulate,
                             "times the drag of drops on the fluid's surface and spray; "
                             "incompressible fluid only"),
  };
}

}  // namespace

std::vector<Parameter> source_rows() {
  std::vector<Parameter> all = emitter_rows();
  for (const auto& part : {volume_rows(), sink_rows(), wind_rows()})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace drench::shot_table
