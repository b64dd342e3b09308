#include "pipeline/contract/shot/shot_rows.h"

namespace drench::shot_table {

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
                                        contact_angle_text),
      row<&Obstacle::material>("obstacle", "material", "", none, render, "name of a [[material]]"),
      row<&Obstacle::visible>("obstacle", "visible", "", none, render, "drawn"),
      row<&Obstacle::matte>("obstacle", "matte", "", none, render, matte_text),
  };
}

}  // namespace drench::shot_table
