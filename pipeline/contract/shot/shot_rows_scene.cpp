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

}  // namespace

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
                                      contact_angle_text),

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

}  // namespace drench::shot_table
